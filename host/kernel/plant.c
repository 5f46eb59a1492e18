#include "plant.h"

#include <math.h>
#include <string.h>

#include "noise.h"

#define FRICTION_RAD_S 0.01 /* velocity at which Coulomb friction reaches 76 % of its value */
#define RAMP_S         0.3  /* duration in which a wave grows from rest */

/* --- masses ------------------------------------------------------------------------------------------------------- */

static void attach(const kernel_setup_t *setup, const kernel_run_t *run, mjModel *model) {
    model->body_mass[setup->payload] = run->payload_mass;
    for (int axis = 0; axis < 3; ++axis) {
        model->body_ipos[3 * setup->payload + axis] = run->payload_com[axis];
        model->body_inertia[3 * setup->payload + axis] = run->payload_inertia[axis];
    }
}

static void load_masses(const kernel_setup_t *setup, const kernel_run_t *run, mjModel *model, mjData *data) {
    for (uint32_t i = 0; i < setup->joints; ++i) {
        const int body = setup->body[i];
        model->body_mass[body] = setup->mass[i] * run->mass_scale[i];
        for (int axis = 0; axis < 3; ++axis) {
            model->body_inertia[3 * body + axis] = setup->inertia[i][axis] * run->mass_scale[i];
        }
    }
    attach(setup, run, model);
    if (run->push == KERNEL_CONTACT) {
        model->body_mass[setup->hand_body] = run->part_mass;
        model->geom_size[3 * setup->hand_geom] = run->part_radius;
        model->geom_rbound[setup->hand_geom] = run->part_radius;
    }
    mj_setConst(model, data);
}

/* --- the controller's model --------------------------------------------------------------------------------------- */

static void nominal_place(plant_t *self, const double *position, const double *velocity) {
    mjModel *const model = (mjModel *)self->setup->nominal;
    mjData *const data = self->nominal;
    for (uint32_t i = 0; i < self->setup->joints; ++i) {
        data->qpos[i] = position[i];
        data->qvel[i] = velocity[i];
    }
    mj_kinematics(model, data);
    mj_comPos(model, data);
    mj_comVel(model, data);
}

void plant_start(plant_t *self, const kernel_setup_t *setup, const kernel_run_t *run, mjModel *model, mjData *data,
                 mjData *nominal) {
    *self = (plant_t){.setup = setup, .run = run, .model = model, .data = data, .nominal = nominal};
    load_masses(setup, run, model, data);
    /* The controller knows its payload; the guard does not. */
    attach(setup, run, (mjModel *)setup->nominal);
    mj_setConst((mjModel *)setup->nominal, nominal);
    mj_resetData(model, data);
    for (uint32_t i = 0; i < setup->joints; ++i) {
        data->qpos[i] = run->start[i];
    }
    mj_forward(model, data);
    nominal_place(self, run->start, data->qvel);
    double bias[KERNEL_JOINTS];
    mj_rne((const mjModel *)setup->nominal, nominal, 0, bias);
    for (uint32_t i = 0; i < setup->joints; ++i) {
        self->torque[i] = data->qfrc_bias[i];
        self->load[i] = data->qfrc_bias[i] - bias[i];
    }
}

/* --- motion ------------------------------------------------------------------------------------------------------- */

static void move(const kernel_run_t *run, uint32_t joints, double time_s, reference_t *out) {
    const double share = time_s / run->move_s;
    const double leg = floor(share);
    const double u = share - leg;
    const bool back = fmod(leg, 2.0) != 0.0;
    const double s = u * u * u * (10.0 - 15.0 * u + 6.0 * u * u);
    const double ds = 30.0 * u * u * (1.0 - u) * (1.0 - u) / run->move_s;
    const double dds = 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / (run->move_s * run->move_s);
    for (uint32_t i = 0; i < joints; ++i) {
        const double from = back ? run->goal[i] : run->start[i];
        const double way = back ? run->start[i] - run->goal[i] : run->goal[i] - run->start[i];
        out->position[i] = from + s * way;
        out->velocity[i] = ds * way;
        out->acceleration[i] = dds * way;
    }
}

static void wave(const kernel_run_t *run, uint32_t joints, double time_s, reference_t *out) {
    const double u = fmin(time_s / RAMP_S, 1.0);
    const double w = u * u * u * (10.0 - 15.0 * u + 6.0 * u * u);
    const double dw = (u < 1.0) ? 30.0 * u * u * (1.0 - u) * (1.0 - u) / RAMP_S : 0.0;
    const double ddw = (u < 1.0) ? 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / (RAMP_S * RAMP_S) : 0.0;
    double x[KERNEL_WAVES], dx[KERNEL_WAVES], ddx[KERNEL_WAVES];
    for (int k = 0; k < KERNEL_WAVES; ++k) {
        const double rate = run->frequency[k];
        const double angle = rate * time_s + run->phase[k];
        const double value = sin(angle) - sin(run->phase[k]);
        x[k] = w * value;
        dx[k] = dw * value + w * rate * cos(angle);
        ddx[k] = ddw * value + 2.0 * dw * rate * cos(angle) - w * rate * rate * sin(angle);
    }
    for (uint32_t i = 0; i < joints; ++i) {
        out->position[i] = run->start[i];
        out->velocity[i] = out->acceleration[i] = 0.0;
        for (int k = 0; k < KERNEL_WAVES; ++k) {
            out->position[i] += run->amplitude[k][i] * x[k];
            out->velocity[i] += run->amplitude[k][i] * dx[k];
            out->acceleration[i] += run->amplitude[k][i] * ddx[k];
        }
    }
}

static void planned(const plant_t *self, double time_s, reference_t *out) {
    const kernel_run_t *const run = self->run;
    if (run->motion == KERNEL_MOVE) {
        move(run, self->setup->joints, time_s, out);
    } else if (run->motion == KERNEL_WAVE) {
        wave(run, self->setup->joints, time_s, out);
    } else {
        memset(out, 0, sizeof *out);
        memcpy(out->position, run->start, sizeof run->start);
    }
}

void plant_stop(plant_t *self, double time_s) {
    planned(self, time_s, &self->stop_from);
    double fastest = 0.0;
    for (uint32_t i = 0; i < self->setup->joints; ++i) {
        fastest = fmax(fastest, fabs(self->stop_from.velocity[i]));
    }
    self->stopping = true;
    self->stop_at_s = time_s;
    self->stop_s = fastest / self->setup->deceleration_rad_s2;
}

/* All joints come to rest together, so that the direction of motion does not change. */
static void stopped(const plant_t *self, double time_s, reference_t *out) {
    const double since = time_s - self->stop_at_s;
    const double t = fmin(since, self->stop_s);
    for (uint32_t i = 0; i < self->setup->joints; ++i) {
        const double speed = self->stop_from.velocity[i];
        const double rate = (self->stop_s > 0.0) ? speed / self->stop_s : 0.0;
        out->position[i] = self->stop_from.position[i] + speed * t - 0.5 * rate * t * t;
        out->velocity[i] = speed - rate * t;
        out->acceleration[i] = (since < self->stop_s) ? -rate : 0.0;
    }
}

/* --- control ------------------------------------------------------------------------------------------------------ */

static void follow_tip(plant_t *self, const reference_t *wanted) {
    const mjModel *const model = (const mjModel *)self->setup->nominal;
    const double period = self->setup->period_us * 1e-6;
    mjtNum jacobian[3 * KERNEL_JOINTS];
    mj_jacSite(model, self->nominal, jacobian, NULL, self->setup->tip);
    for (int axis = 0; axis < 3; ++axis) {
        double speed = 0.0;
        for (uint32_t i = 0; i < self->setup->joints; ++i) {
            speed += jacobian[axis * model->nv + (int)i] * wanted->velocity[i];
        }
        self->tip_acceleration[axis] = self->tip_known ? (speed - self->tip_velocity[axis]) / period : 0.0;
        self->tip_velocity[axis] = speed;
    }
    self->tip_known = true;
}

void plant_control(plant_t *self, double time_s, double *torque) {
    const kernel_setup_t *const setup = self->setup;
    const mjModel *const model = (const mjModel *)setup->nominal;
    const double period = setup->period_us * 1e-6;
    const double w = setup->bandwidth_rad_s;
    reference_t wanted = {0};
    if (self->stopping) {
        stopped(self, time_s, &wanted);
    } else {
        planned(self, time_s, &wanted);
    }
    nominal_place(self, self->data->qpos, self->data->qvel);
    follow_tip(self, &wanted);
    for (uint32_t i = 0; i < setup->joints; ++i) {
        const double error = wanted.position[i] - self->data->qpos[i];
        if (!self->stopping) {
            self->integral[i] += period * error;
        }
        self->nominal->qacc[i] = wanted.acceleration[i] + 3.0 * w * w * error +
                                 3.0 * w * (wanted.velocity[i] - self->data->qvel[i]) + w * w * w * self->integral[i];
    }
    mjtNum needed[KERNEL_JOINTS];
    mj_rne(model, self->nominal, 1, needed);
    for (uint32_t i = 0; i < setup->joints; ++i) {
        const double value = needed[i] + model->dof_armature[i] * self->nominal->qacc[i] + self->load[i];
        torque[i] = fmax(-setup->torque_max[i], fmin(setup->torque_max[i], value));
    }
}

/* --- physics ------------------------------------------------------------------------------------------------------ */

static double guiding(const kernel_run_t *run, double time_s) {
    const double since = time_s - run->guide_start_s;
    const double left = 2.0 * run->guide_rise_s + run->guide_hold_s - since;
    if ((since <= 0.0) || (left <= 0.0)) {
        return 0.0;
    }
    return 0.5 - 0.5 * cos(3.141592653589793 * fmin(fmin(since, left) / run->guide_rise_s, 1.0));
}

void plant_begin_cycle(plant_t *self) {
    memset(self->torque, 0, sizeof self->torque);
}

bool plant_step(plant_t *self, double time_s, const double *torque) {
    const kernel_setup_t *const setup = self->setup;
    const kernel_run_t *const run = self->run;
    mjData *const data = self->data;
    for (uint32_t i = 0; i < setup->joints; ++i) {
        data->ctrl[i] = torque[i];
        data->qfrc_applied[i] = self->push[i];
    }
    const double share = guiding(run, time_s);
    if (share > 0.0) {
        double force[3], moment[3];
        for (int axis = 0; axis < 3; ++axis) {
            force[axis] = share * run->guide_force[axis];
            moment[axis] = share * run->guide_moment[axis];
        }
        mj_applyFT(self->model, data, force, moment, data->site_xpos + 3 * setup->tip, setup->body[setup->joints - 1u],
                   data->qfrc_applied);
    }
    mj_step(self->model, data);
    for (uint32_t i = 0; i < setup->joints; ++i) {
        self->torque[i] += (torque[i] - self->model->dof_armature[i] * data->qacc[i]) / (double)setup->substeps;
    }
    return data->warning[mjWARN_BADQACC].number == 0 && data->warning[mjWARN_BADQPOS].number == 0;
}

/* --- sensors ------------------------------------------------------------------------------------------------------ */

static double stepped(double value, double quantum) {
    return (quantum > 0.0) ? quantum * rint(value / quantum) : value;
}

void plant_read(plant_t *self, uint32_t cycle, reading_t *reading) {
    const kernel_sensors_t *const sensors = &self->run->sensors;
    const uint32_t joints = self->setup->joints;
    reading_t *const now = &self->late[self->readings % PLANT_DELAY];
    memcpy(now->position, self->data->qpos, joints * sizeof(double));
    memcpy(now->velocity, self->data->qvel, joints * sizeof(double));
    memcpy(now->torque, self->torque, joints * sizeof(double));
    const uint32_t delay = (self->readings < sensors->delay) ? self->readings : sensors->delay;
    const reading_t *const seen = &self->late[(self->readings - delay) % PLANT_DELAY];
    ++self->readings;
    for (uint32_t i = 0; i < joints; ++i) {
        double noise[4];
        normals(self->run->seed, self->run->number, cycle, i, noise);
        const double q = seen->position[i];
        const double qd = seen->velocity[i];
        const double torque = sensors->gain[i] * seen->torque[i] + sensors->offset[i] +
                              sensors->ripple[i] * sin(sensors->ripple_per_turn * q + sensors->phase[i]) +
                              sensors->friction[i] * tanh(qd / FRICTION_RAD_S) + sensors->torque_noise * noise[0];
        reading->torque[i] = stepped(torque, sensors->torque_quantum);
        reading->velocity[i] = stepped(qd + sensors->velocity_noise * noise[1], sensors->velocity_quantum);
        reading->position[i] = stepped(q + sensors->position_noise * noise[2], sensors->position_quantum);
    }
}
