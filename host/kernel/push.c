#include "push.h"

#include <math.h>
#include <string.h>

#define PI               3.141592653589793
#define IMPEDANCE        0.1   /* MuJoCo's contact impedance: a spring and damper that adds little mass */
#define TISSUE_DAMPING   0.4   /* damping ratio of the part's mass on its tissue */
#define AIM_RAD_S        25.0  /* bandwidth of the sideways correction by the arm behind the part */
#define SPEED_RATE_PER_S 800.0 /* gain of the part's speed control, within its force */
#define STANDOFF_M       0.12  /* free distance before the strike */
#define GIVE_UP_S        0.6   /* a strike without contact is withdrawn after this time */
#define WITHDRAW_M_S     0.5
#define PARK_M           10.0 /* below the base */
#define CLAMP_RISE_S     0.05
#define SIDES            12 /* directions around a link that are tried for a free approach */

double push_half_sine(double force_n, double push_s, double since_s) {
    return ((since_s < 0.0) || (since_s >= push_s)) ? 0.0 : force_n * sin(PI * since_s / push_s);
}

/* Of a push with a prescribed force, N. */
static double size_of(const kernel_run_t *run, double since_s) {
    if (run->push == KERNEL_PULSE) {
        return push_half_sine(run->force_n, run->push_s, since_s);
    }
    const double rise_s = (run->push == KERNEL_CLAMP) ? CLAMP_RISE_S : run->push_s;
    const double share = (since_s >= rise_s) ? 1.0 : 0.5 * (1.0 - cos(PI * since_s / rise_s));
    return run->force_n * share;
}

static double dot(const double *a, const double *b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void to_base(const plant_t *plant, uint32_t link, const double *in_link, double *out) {
    mju_mulMatVec3(out, plant->data->xmat + 9 * plant->setup->body[link], in_link);
}

/* --- contact ------------------------------------------------------------------------------------------------------ */

/* Aim of the strike: point, velocity and direction, base frame. */
static void aim(const push_t *self, const plant_t *plant, double *point, double *velocity, double *direction) {
    const uint32_t link = plant->run->link;
    const int body = plant->setup->body[link];
    const int nv = (int)plant->model->nv;
    mjtNum jacobian[3 * (KERNEL_JOINTS + 3)];
    to_base(plant, link, self->target, point);
    mju_addTo3(point, plant->data->xpos + 3 * body);
    mj_jac(plant->model, plant->data, jacobian, NULL, point, body);
    mju_mulMatVec(velocity, jacobian, plant->data->qvel, 3, nv);
    to_base(plant, link, self->direction, direction);
}

/* A unit vector perpendicular to the link's capsule at `angle`, pointing towards its axis. */
static void across(const double *capsule, double angle, double *direction) {
    double axis[3] = {capsule[3] - capsule[0], capsule[4] - capsule[1], capsule[5] - capsule[2]};
    if (mju_normalize3(axis) < 1e-9) {
        axis[0] = axis[1] = 0.0;
        axis[2] = 1.0;
    }
    const double other[3] = {fabs(axis[0]) < 0.7 ? 1.0 : 0.0, fabs(axis[0]) < 0.7 ? 0.0 : 1.0, 0.0};
    double u[3], v[3];
    mju_cross(u, axis, other);
    mju_normalize3(u);
    mju_cross(v, axis, u);
    for (int i = 0; i < 3; ++i) {
        direction[i] = -(cos(angle) * u[i] + sin(angle) * v[i]);
    }
}

/* Gives the contact pairs the tissue's stiffness and damping. MuJoCo's direct form solref = (-k, -b) acts per unit of
 * the inverse mass that it estimates for the pair. */
static void soften(const plant_t *plant) {
    const kernel_run_t *const run = plant->run;
    mjModel *const model = plant->model;
    const double damping = 2.0 * TISSUE_DAMPING * sqrt(run->part_stiffness * run->part_mass);
    for (uint32_t i = 0; i < plant->setup->joints; ++i) {
        const double inverse = 1.0 / run->part_mass + model->body_invweight0[2 * plant->setup->body[i]];
        const double per_newton = (1.0 - IMPEDANCE) * inverse;
        model->pair_solref[mjNREF * plant->setup->pair[i]] = -run->part_stiffness * per_newton;
        model->pair_solref[mjNREF * plant->setup->pair[i] + 1] = -damping * per_newton;
    }
}

static double reach(const plant_t *plant) {
    return STANDOFF_M + plant->run->part_radius + plant->setup->capsule[plant->run->link][6];
}

static void place(const plant_t *plant, const double *point, const double *velocity) {
    const kernel_setup_t *const setup = plant->setup;
    memcpy(plant->data->qpos + setup->hand_position, point, 3 * sizeof(double));
    plant->data->qpos[setup->hand_position + 2] += PARK_M;
    memcpy(plant->data->qvel + setup->hand_speed, velocity, 3 * sizeof(double));
}

static void park(push_t *self, const plant_t *plant) {
    const kernel_setup_t *const setup = plant->setup;
    mju_zero(plant->data->qpos + setup->hand_position, 3);
    mju_zero(plant->data->qvel + setup->hand_speed, 3);
    mju_zero(plant->data->qfrc_applied + setup->hand_speed, 3);
    self->state = PART_PARKED;
}

/* Places the part in front of its target, moving with it, on the first free side. */
static void start(push_t *self, plant_t *plant, double time_s) {
    const kernel_setup_t *const setup = plant->setup;
    self->started = true;
    soften(plant);
    for (int side = 0; side < SIDES; ++side) {
        double point[3], velocity[3], direction[3];
        across(setup->capsule[plant->run->link], plant->run->angle + side * (2.0 * PI / SIDES), self->direction);
        aim(self, plant, point, velocity, direction);
        mju_addToScl3(point, direction, -reach(plant));
        place(plant, point, velocity);
        mj_kinematics(plant->model, plant->data);
        bool is_free = true;
        for (uint32_t i = 0; i < setup->joints; ++i) {
            const double gap =
                mj_geomDistance(plant->model, plant->data, setup->link_geom[i], setup->hand_geom, 1.0, NULL);
            is_free = is_free && (gap > 0.0);
        }
        if (is_free) {
            self->state = PART_APPROACHING;
            self->since_s = time_s;
            return;
        }
    }
    self->obstructed = true;
    park(self, plant);
}

static void drive(push_t *self, plant_t *plant, double time_s) {
    const kernel_setup_t *const setup = plant->setup;
    const kernel_run_t *const run = plant->run;
    mjData *const data = plant->data;
    double point[3], velocity[3], direction[3], offset[3], drift[3];
    aim(self, plant, point, velocity, direction);
    mju_sub3(offset, data->qpos + setup->hand_position, point);
    offset[2] -= PARK_M;
    mju_sub3(drift, data->qvel + setup->hand_speed, velocity);
    const double ahead = dot(offset, direction);
    const double forward = dot(drift, direction);
    const double elapsed = time_s - self->since_s;
    const double gain = SPEED_RATE_PER_S * run->part_mass;
    const bool over = ((self->state == PART_APPROACHING) && (elapsed > GIVE_UP_S + STANDOFF_M / run->speed_m_s)) ||
                      ((self->state == PART_PUSHING) && (elapsed > run->push_s));
    if (over) {
        self->state = PART_WITHDRAWING;
        self->since_s = time_s;
    }
    if ((self->state == PART_WITHDRAWING) && (ahead < -reach(plant))) {
        park(self, plant);
        return;
    }
    double wanted = -WITHDRAW_M_S;
    double most = run->force_n;
    if (self->state == PART_APPROACHING) {
        wanted = run->speed_m_s;
    } else if (self->state == PART_PUSHING) {
        wanted = fmax(run->speed_m_s, run->force_n / gain); /* follows a link that yields, but no faster */
        most = push_half_sine(run->force_n, run->push_s, elapsed);
    } else {
        /* withdraws with the available force */
    }
    const double push = fmax(-run->force_n, fmin(most, gain * (wanted - forward)));
    for (int i = 0; i < 3; ++i) {
        const double sideways = offset[i] - ahead * direction[i];
        const double slip = drift[i] - forward * direction[i];
        data->qfrc_applied[setup->hand_speed + i] =
            push * direction[i] - run->part_mass * (AIM_RAD_S * AIM_RAD_S * sideways + 2.0 * AIM_RAD_S * slip);
    }
}

/* --- both kinds --------------------------------------------------------------------------------------------------- */

void push_init(push_t *self, const plant_t *plant) {
    const kernel_run_t *const run = plant->run;
    *self = (push_t){.state = PART_PARKED};
    if (run->push == KERNEL_CONTACT) {
        const double *const capsule = plant->setup->capsule[run->link];
        for (int i = 0; i < 3; ++i) {
            self->target[i] = (1.0 - run->along) * capsule[i] + run->along * capsule[3 + i];
        }
    }
}

void push_before_step(push_t *self, plant_t *plant, double time_s) {
    const kernel_run_t *const run = plant->run;
    memset(plant->push, 0, sizeof plant->push);
    if ((run->push == KERNEL_NO_PUSH) || (time_s < run->onset_s)) {
        return;
    }
    if (run->push != KERNEL_CONTACT) {
        const double force_n = size_of(run, time_s - run->onset_s);
        self->force_n = force_n;
        self->link = run->link + 1u;
        if (force_n <= 0.0) {
            return;
        }
        double point[3], force[3], jacobian[3 * (KERNEL_JOINTS + 3)];
        const int body = plant->setup->body[run->link];
        to_base(plant, run->link, run->point, point);
        mju_addTo3(point, plant->data->xpos + 3 * body);
        mju_copy3(self->towards, run->direction);
        mju_scl3(force, run->direction, force_n);
        mj_jac(plant->model, plant->data, jacobian, NULL, point, body);
        for (uint32_t i = 0; i < plant->setup->joints; ++i) {
            for (int axis = 0; axis < 3; ++axis) {
                plant->push[i] += jacobian[axis * plant->model->nv + (int)i] * force[axis];
            }
        }
        return;
    }
    if (!self->started) {
        start(self, plant, time_s);
    }
    if (self->state != PART_PARKED) {
        drive(self, plant, time_s);
    }
}

void push_after_step(push_t *self, plant_t *plant, double time_s) {
    if (plant->run->push != KERNEL_CONTACT) {
        return;
    }
    self->force_n = 0.0;
    if (self->state == PART_PARKED) {
        return;
    }
    const mjData *const data = plant->data;
    double largest = 0.0;
    for (int c = 0; c < data->ncon; ++c) {
        const int *const geom = data->contact[c].geom;
        if ((geom[0] != plant->setup->hand_geom) && (geom[1] != plant->setup->hand_geom)) {
            continue;
        }
        const int other = (geom[0] == plant->setup->hand_geom) ? geom[1] : geom[0];
        mjtNum wrench[6];
        mj_contactForce(plant->model, data, c, wrench);
        const double force_n = mju_norm3(wrench);
        self->force_n += force_n;
        for (uint32_t i = 0; (force_n > largest) && (i < plant->setup->joints); ++i) {
            self->link = (plant->setup->link_geom[i] == other) ? i + 1u : self->link;
        }
        largest = fmax(largest, force_n);
    }
    if ((self->force_n > 0.0) && (self->state == PART_APPROACHING)) {
        self->state = PART_PUSHING;
        self->since_s = time_s;
    }
}
