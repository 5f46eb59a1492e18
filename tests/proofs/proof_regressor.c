/* firmware/core/regressor.c: any filter that config_check accepts, any Jacobian below 64, now and in the last tick.
 * Each part is shown alone; the next one calls stubs that assert what the part requires. */
#include "num_sums.h"

#include "regressor.c"
#include "stub_object.h"

/* Below 64, so that the rounded mean of two is at most 64. */
static bool is_bounded(const num_t jacobian[][ROBOT_MAX_JOINTS]) {
    bool all = true;
    for (uint32_t row = 0; row < MOTION_TWIST_ROWS; ++row) {
        for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
            all = all && stub_below(jacobian[row][i], 28u);
        }
    }
    return all;
}

/* config_filters.c */
static bool filter_is_bounded(const channel_config_t *c) {
    bool all = true;
    for (uint32_t g = 0; g < OBSERVER_MAX_GAP; ++g) {
        all = all && sum_is_factor(c->own[g]) && sum_is_factor(c->cross[g]) && sum_is_factor(c->in[g]) &&
              sum_is_factor(c->back[g]) && sum_is_factor(c->stay[g]) && sum_is_factor(c->in_back[g]);
    }
    return all;
}

static regressor_t regressor;
static regressor_config_t config;
static observer_config_t gains;
static robot_t robot;
static motion_t motion;
static observer_t observer;
static acceleration_t acceleration;

static void any_input(void) {
    __CPROVER_havoc_object(&regressor);
    __CPROVER_havoc_object(&config);
    __CPROVER_havoc_object(&gains);
    __CPROVER_havoc_object(&robot);
    __CPROVER_havoc_object(&motion);
    __CPROVER_havoc_object(&observer);
    __CPROVER_havoc_object(&acceleration);
    ASSUME(filter_is_bounded(&config.low_pass));
    ASSUME(is_bounded(motion.jacobian) && is_bounded(regressor.jacobian));
}

void proof_regressor_low_pass(void) {
    num_t level[ROBOT_MAX_JOINTS], slope[ROBOT_MAX_JOINTS], u[ROBOT_MAX_JOINTS];
    uint32_t g, saturations;
    any_input();
    ASSUME(g < OBSERVER_MAX_GAP);
    low_pass(&config.low_pass, g, level, slope, u, &saturations);
    REACHED;
}

/* Any numbers, one by one: CBMC is slower after a change of the whole array. */
static void any_torque(num_t torque[]) {
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        num_t any;
        torque[i] = any;
    }
}

void stub_low_pass(const channel_config_t *c, uint32_t g, num_t level[], num_t slope[], const num_t u[],
                   uint32_t *saturations) {
    *saturations += 0u;
    HOLDS(__CPROVER_r_ok(c, sizeof(*c)) && filter_is_bounded(c) && (g < OBSERVER_MAX_GAP), "constants of the gap");
    HOLDS(__CPROVER_r_ok(u, ROBOT_JOINTS * sizeof(*u)), "the input is there");
    any_torque(level);
    any_torque(slope);
}

/* vec3_cross: proof_vec3_cross. */
vec3_t stub_cross(vec3_t a, vec3_t b, uint32_t *saturations) {
    (void)a;
    (void)b;
    return (vec3_t){.x = stub_number(saturations), .y = stub_number(saturations), .z = stub_number(saturations)};
}

void proof_regressor_pulls(void) {
    pull_t pull[REGRESSOR_COLUMNS];
    num_t per_step;
    vec3_t gravity, velocity, rate;
    any_input();
    pulls(&regressor, &observer, per_step, gravity, &motion, velocity, rate, pull);
    REACHED;
}

void stub_pulls(regressor_t *self, const observer_t *of, num_t per_step, vec3_t gravity, const motion_t *now,
                vec3_t velocity, vec3_t rate, pull_t pull[REGRESSOR_COLUMNS]) {
    (void)per_step;
    (void)gravity;
    (void)velocity;
    (void)rate;
    self->saturations += 0u;
    HOLDS(__CPROVER_r_ok(of, sizeof(*of)) && __CPROVER_r_ok(now, sizeof(*now)), "the stages before are there");
    stub_object(pull, REGRESSOR_COLUMNS * sizeof(*pull));
}

/* The entries after the mean. */
static bool are_factors(const num_t jacobian[][ROBOT_MAX_JOINTS]) {
    bool all = true;
    for (uint32_t row = 0; row < MOTION_TWIST_ROWS; ++row) {
        for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
            all = all && sum_is_factor(jacobian[row][i]);
        }
    }
    return all;
}

void proof_regressor_mean(void) {
    any_input();
    mean_jacobian(&regressor, &motion);
    HOLDS(are_factors(regressor.jacobian), "the mean is at most 64");
    REACHED;
}

void stub_mean(regressor_t *self, const motion_t *now) {
    HOLDS(is_bounded(self->jacobian) && is_bounded(now->jacobian), "both Jacobians are below 64");
    for (uint32_t row = 0; row < MOTION_TWIST_ROWS; ++row) {
        for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
            num_t any;
            ASSUME(sum_is_factor(any));
            self->jacobian[row][i] = any;
        }
    }
}

void proof_regressor_columns(void) {
    pull_t pull[REGRESSOR_COLUMNS];
    uint32_t g;
    any_input();
    ASSUME(g < OBSERVER_MAX_GAP);
    columns(&regressor, &config.low_pass, g, &motion, pull);
    REACHED;
}

void stub_columns_of(regressor_t *self, const channel_config_t *filter, uint32_t g, const motion_t *now,
                     const pull_t pull[REGRESSOR_COLUMNS]) {
    HOLDS(__CPROVER_r_ok(filter, sizeof(*filter)) && filter_is_bounded(filter) && (g < OBSERVER_MAX_GAP),
          "constants of the gap");
    HOLDS(is_bounded(self->jacobian) && is_bounded(now->jacobian), "both Jacobians are below 64");
    HOLDS(__CPROVER_r_ok(pull, REGRESSOR_COLUMNS * sizeof(*pull)), "the wrench of each parameter is there");
    for (uint32_t c = 0; c < REGRESSOR_COLUMNS; ++c) {
        any_torque(self->column[c]);
    }
    stub_object(self->jacobian, sizeof(self->jacobian));
}

void proof_regressor_step(void) {
    num_t velocity[ROBOT_MAX_JOINTS];
    any_input();
    regressor_step(&regressor, &config, &gains, &robot, &motion, &observer, &acceleration, velocity);
    HOLDS(is_bounded(regressor.jacobian), "the Jacobian of the last sample is below 64");
    regressor_init(&regressor);
    HOLDS(is_bounded(regressor.jacobian), "so is that of the start");
    REACHED;
}
