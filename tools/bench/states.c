#include "states.h"

static const num_t QUARTER_TURN = NUM(1.57079633);
static const num_t HALF_TURN = NUM(3.14159265);
static const num_t WHOLE_TURN = NUM(6.28318531);

/* Axes aligned, opposed or at right angles; an angle that the joint cannot reach is replaced by its negative. */
static num_t special_angle(const robot_joint_t *joint, random_t *random) {
    const uint32_t quarters = random_below(random, 4);
    num_t angle = ((quarters & 1u) != 0u) ? QUARTER_TURN : NUM(0);
    angle -= ((quarters & 2u) != 0u) ? HALF_TURN : NUM(0);
    angle -= joint->zero_rad;
    angle += (angle < -HALF_TURN) ? WHOLE_TURN : NUM(0);
    angle += (angle < joint->position_min_rad) ? HALF_TURN : NUM(0);
    angle -= (angle > joint->position_max_rad) ? HALF_TURN : NUM(0);
    return num_max(joint->position_min_rad, num_min(joint->position_max_rad, angle));
}

/* `beside`: largest deviation from a special angle, rad. */
static num_t position(const robot_joint_t *joint, random_t *random, bool special, num_t beside) {
    if (!special || (random_below(random, 2) == 0u)) {
        return random_between(random, joint->position_min_rad, joint->position_max_rad);
    }
    uint32_t saturations = 0;
    return special_angle(joint, random) + num_mul(random_unit(random), beside, &saturations);
}

static vec3_t acceleration(const robot_t *robot, random_t *random) {
    const uint32_t choice = random_below(random, 4);
    if (choice == 0u) {
        return (vec3_t){NUM(0), NUM(0), NUM(0)};
    }
    if (choice == 1u) {
        return robot->gravity;
    }
    uint32_t saturations = 0;
    return (vec3_t){.x = num_mul(random_unit(random), NUM(8), &saturations),
                    .y = num_mul(random_unit(random), NUM(8), &saturations),
                    .z = num_mul(random_unit(random), NUM(8), &saturations)};
}

static void torques(bench_state_t *self, const robot_t *robot, random_t *random) {
    for (uint32_t i = 0; i < robot->joint_count; ++i) {
        self->torque[i] = random_between(random, -robot->joint[i].torque_max_nm, robot->joint[i].torque_max_nm);
    }
}

void states_jump(bench_state_t *self, const guard_config_t *config, random_t *random) {
    const robot_t *const robot = &config->robot;
    const bool special = random_below(random, 3) != 0u;
    static const num_t distances[] = {NUM(0), NUM(0), NUM(1e-4), NUM(1e-2)};
    const num_t beside = distances[random_below(random, 4)];
    const bool still = random_below(random, 8) == 0u;
    for (uint32_t i = 0; i < robot->joint_count; ++i) {
        const num_t limit = robot->joint[i].velocity_max_rad_s;
        self->position[i] = position(&robot->joint[i], random, special, beside);
        self->velocity[i] = still ? NUM(0) : random_between(random, -limit, limit);
    }
    torques(self, robot, random);
    self->acceleration = acceleration(robot, random);
}

void states_advance(bench_state_t *self, const guard_config_t *config, random_t *random) {
    uint32_t saturations = 0;
    for (uint32_t i = 0; i < config->robot.joint_count; ++i) {
        const robot_joint_t *const joint = &config->robot.joint[i];
        /* The period in s to a part in 2^22: below 10^-3 rad in any case. */
        const num_t step =
            num_mul(num_mul(self->velocity[i], num_from_int((int32_t)(config->period_us / 100u)), &saturations),
                    NUM(1e-4), &saturations);
        const num_t next = self->position[i] + step;
        const bool inside = (next > joint->position_min_rad) && (next < joint->position_max_rad);
        self->position[i] += inside ? step : -step;
        self->velocity[i] = inside ? self->velocity[i] : -self->velocity[i];
    }
    torques(self, &config->robot, random);
}

bool states_next(bench_state_t *self, const guard_config_t *config, random_t *random, uint32_t index) {
    const bool jump = (index % 2u) == 0u;
    if (jump) {
        states_jump(self, config, random);
    } else {
        states_advance(self, config, random);
    }
    return jump;
}
