#include "regressor.h"

#include "token.h"
#include "vec3.h"

enum { LINEAR = 0, ANGULAR = 3, ROWS = ROBOT_JOINTS, TORQUE = REGRESSOR_COLUMNS };

/* Wrench per unit of each parameter, as a mean over the step. */
typedef struct {
    vec3_t force, moment;
} pull_t;

void regressor_init(regressor_t *self) {
    *self = (regressor_t){0};
}

static vec3_t scaled(vec3_t v, num_t scale, uint32_t *saturations) {
    return (vec3_t){.x = num_mul(scale, v.x, saturations),
                    .y = num_mul(scale, v.y, saturations),
                    .z = num_mul(scale, v.z, saturations)};
}

static vec3_t mean_of(vec3_t a, vec3_t b, uint32_t *saturations) {
    return scaled(vec3_add(a, b, saturations), NUM(0.5), saturations);
}

static vec3_t angular_rate(const motion_t *motion, const num_t velocity[], uint32_t *saturations) {
    num_t sum[3];
    for (uint32_t axis = 0; axis < 3u; ++axis) {
        num_wide_t along = num_widen(NUM(0));
        for (uint32_t i = 0; i < (uint32_t)ROWS; ++i) {
            along += num_wide(motion->jacobian[(uint32_t)ANGULAR + axis][i], velocity[i]);
        }
        sum[axis] = num_narrow(along, saturations);
    }
    return (vec3_t){.x = sum[0], .y = sum[1], .z = sum[2]};
}

/* The second-order low-pass of bank.h. `u` carries the factor 1 - a, as the observer's update does. */
static void low_pass(const channel_config_t *c, uint32_t g, num_t level[], num_t slope[], const num_t u[],
                     uint32_t *saturations) {
    for (uint32_t i = 0; i < (uint32_t)ROWS; ++i) {
        const num_t x = level[i];
        const num_t v = slope[i];
        level[i] =
            num_narrow(num_wide(c->own[g], x) + num_wide(c->cross[g], v) + num_wide(c->in[g], u[i]), saturations);
        slope[i] =
            num_narrow(num_wide(c->back[g], x) + num_wide(c->stay[g], v) + num_wide(c->in_back[g], u[i]), saturations);
    }
}

/* Joint torque of each parameter, times 1 - a. */
static void pulls(regressor_t *self, const observer_t *observer, num_t per_step, vec3_t gravity, const motion_t *motion,
                  vec3_t velocity, vec3_t rate, pull_t pull[REGRESSOR_COLUMNS]) {
    uint32_t *const sat = &self->saturations;
    const vec3_t fall = scaled(gravity, observer->gain, sat);
    const vec3_t change = scaled(vec3_subtract(velocity, self->velocity, sat), per_step, sat);
    const vec3_t push = vec3_subtract(change, fall, sat);
    const vec3_t turn = scaled(vec3_subtract(rate, self->rate, sat), per_step, sat);
    const vec3_t mean = mean_of(rate, self->rate, sat);
    const vec3_t x = mean_of(motion->tool_x, self->tool_x, sat);
    const vec3_t y = mean_of(motion->tool_y, self->tool_y, sat);
    const vec3_t z = mean_of(motion->tool_z, self->tool_z, sat);
    const vec3_t axis[3] = {{x.x, y.x, z.x}, {x.y, y.y, z.y}, {x.z, y.z, z.z}};
    const vec3_t none = {NUM(0), NUM(0), NUM(0)};
    pull[0] = (pull_t){.force = scaled(push, NUM(REGRESSOR_MASS_KG), sat), .moment = none};
    for (uint32_t a = 0; a < 3u; ++a) {
        const vec3_t arm = scaled(axis[a], NUM(REGRESSOR_MOMENT), sat);
        const vec3_t inward = vec3_cross(mean, vec3_cross(mean, arm, sat), sat);
        pull[1u + a] = (pull_t){.force = vec3_add(vec3_cross(turn, arm, sat), scaled(inward, observer->gain, sat), sat),
                                .moment = vec3_cross(arm, push, sat)};
    }
    pull[4] = (pull_t){.force = none, .moment = scaled(turn, NUM(REGRESSOR_INERTIA), sat)};
}

/* In place: the mean of both ends. */
static void mean_jacobian(regressor_t *self, const motion_t *motion) {
    uint32_t *const sat = &self->saturations;
    for (uint32_t r = 0; r < MOTION_TWIST_ROWS; ++r) {
        for (uint32_t i = 0; i < (uint32_t)ROWS; ++i) {
            self->jacobian[r][i] = num_mul(NUM(0.5), num_add(self->jacobian[r][i], motion->jacobian[r][i], sat), sat);
        }
    }
}

static void columns(regressor_t *self, const channel_config_t *filter, uint32_t g, const motion_t *motion,
                    const pull_t pull[REGRESSOR_COLUMNS]) {
    uint32_t *const sat = &self->saturations;
    mean_jacobian(self, motion);
    for (uint32_t c = 0; c < REGRESSOR_COLUMNS; ++c) {
        const pull_t *const p = &pull[c];
        num_t u[ROWS];
        for (uint32_t i = 0; i < (uint32_t)ROWS; ++i) {
            u[i] = num_narrow(
                num_wide(self->jacobian[0][i], p->force.x) + num_wide(self->jacobian[1][i], p->force.y) +
                    num_wide(self->jacobian[2][i], p->force.z) + num_wide(self->jacobian[3][i], p->moment.x) +
                    num_wide(self->jacobian[4][i], p->moment.y) + num_wide(self->jacobian[5][i], p->moment.z),
                sat);
        }
        low_pass(filter, g, self->column[c], self->slope[c], u, sat);
    }
}

static void remember(regressor_t *self, const motion_t *motion, vec3_t velocity, vec3_t rate) {
    for (uint32_t r = 0; r < MOTION_TWIST_ROWS; ++r) {
        for (uint32_t i = 0; i < (uint32_t)ROWS; ++i) {
            self->jacobian[r][i] = motion->jacobian[r][i];
        }
    }
    self->tool_x = motion->tool_x;
    self->tool_y = motion->tool_y;
    self->tool_z = motion->tool_z;
    self->velocity = velocity;
    self->rate = rate;
}

void regressor_step(regressor_t *self, const regressor_config_t *config, const observer_config_t *gains,
                    const robot_t *robot, const motion_t *motion, const observer_t *observer,
                    const acceleration_t *acceleration, const num_t velocity[]) {
    if (config->used != 0u) {
        const vec3_t rate = angular_rate(motion, velocity, &self->saturations);
        if ((observer->gap < 1u) || (observer->gap > OBSERVER_MAX_GAP)) {
            const uint32_t saturations = self->saturations;
            regressor_init(self);
            self->saturations = saturations;
        } else {
            const uint32_t g = observer->gap - 1u;
            pull_t pull[REGRESSOR_COLUMNS];
            pulls(self, observer, gains->momentum_gain[g], robot->gravity, motion, acceleration->velocity, rate, pull);
            columns(self, &config->low_pass, g, motion, pull);
            low_pass(&config->low_pass, g, self->torque, self->slope[TORQUE], observer->update, &self->saturations);
        }
        remember(self, motion, acceleration->velocity, rate);
    }
    self->token = token_next(acceleration->token, TOKEN_REGRESSOR, 0u);
}
