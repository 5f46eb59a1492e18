#include "index.h"
#include "regressor.h"

#include "core_fixture.h"
#include "robots.h"
#include "vec3.h"

#define N        7u
#define PERIOD_S 1e-3

/* An arm, and the same arm with a payload as a table with another last link. The difference of their observers' inputs
 * is the torque of the payload. */
static robot_t loaded;
static observer_config_t gains;
static regressor_config_t config;
static subspace_config_t subspace;
static motion_t motion, carried;
static observer_t observer;
static acceleration_t acceleration;
static acceleration_config_t bounds;
static regressor_t regressor;
static index_t index_state;
static num_t q[ROBOT_MAX_JOINTS], qd[ROBOT_MAX_JOINTS], tau[ROBOT_MAX_JOINTS];

static void second_order(channel_config_t *c, double corner) {
    for (uint32_t g = 0; g < OBSERVER_MAX_GAP; ++g) {
        const double span = (g + 1.0) * PERIOD_S, root = sqrt(1.0 - 0.49);
        const double turn = corner * root * span, fade = exp(-0.7 * corner * span);
        const double own = fade * (cos(turn) + 0.7 / root * sin(turn)), cross = fade * sin(turn) / root;
        c->own[g] = num_of(own);
        c->cross[g] = num_of(cross);
        c->back[g] = num_of(-cross);
        c->stay[g] = num_of(fade * (cos(turn) - 0.7 / root * sin(turn)));
        c->in[g] = num_of((1.0 - own) / value_of(gains.gain[g]));
        c->in_back[g] = num_of(cross / value_of(gains.gain[g]));
    }
}

void setUp(void) {
    for (uint32_t g = 0; g < OBSERVER_MAX_GAP; ++g) {
        const double decay = exp(-0.05 * (g + 1.0));
        gains.decay[g] = num_of(decay);
        gains.gain[g] = num_of(1.0 - decay);
        gains.momentum_gain[g] = num_of((1.0 - decay) / ((g + 1.0) * PERIOD_S));
    }
    gains.torque_sample = TORQUE_INSTANT;
    config.used = 1u;
    second_order(&config.low_pass, 120.0);
    subspace = (subspace_config_t){.order = ORDER_PROJECT_FIRST,
                                   .projector = PROJECTOR_SOFT,
                                   .tolerance = NUM(0.005),
                                   .lever_m = NUM(0.1),
                                   .softness = NUM(0.05)};
    bounds = (acceleration_config_t){.force_floor_n = NUM(1), .error_max = NUM(2)};
    loaded = robot_ku_dex;
    motion_init(&motion);
    motion_init(&carried);
    observer_init(&observer);
    acceleration_init(&acceleration);
    regressor_init(&regressor);
    index_init(&index_state);
}
void tearDown(void) {
    TEST_ASSERT_EQUAL(0, regressor.saturations + index_state.saturations + index_state.projection.soft.saturations);
}

/* The payload's torque at rest is J^T [-m g; -mc x g]; in motion it comes from momentum and drift of a mass at a point:
 * the loaded table's last link moves its tip by the payload's place, so J of that table at the place does. */
static double mass_kg;
static double place[3]; /* from the end-effector point, last link's frame */

static void payload_step(double t, uint32_t gap) {
    const uint32_t g0 = ((gap >= 1u) && (gap <= OBSERVER_MAX_GAP)) ? (gap - 1u) : 0u;
    static double momentum_before[N], drift_before[N];
    num_t update[ROBOT_MAX_JOINTS] = {NUM(0)};
    for (uint32_t i = 0; i < N; ++i) {
        const double w = 1.5 + 0.4 * i, size = 0.25; /* the tip moves at about 1 m/s */
        q[i] = num_of(0.3 + 0.2 * i + size * sin(w * t));
        qd[i] = num_of(size * w * cos(w * t));
    }
    loaded.tip.x = robot_ku_dex.tip.x + num_of(place[0]);
    loaded.tip.y = robot_ku_dex.tip.y + num_of(place[1]);
    loaded.tip.z = robot_ku_dex.tip.z + num_of(place[2]);
    motion_step(&motion, &robot_ku_dex, q, qd);
    motion_step(&carried, &loaded, q, qd);
    /* p = J^T m v and drift = (dJ/dt)^T m v - J^T m (-g); dJ/dt by a difference in double of the poses around. */
    double v[3] = {0.0, 0.0, 0.0}, momentum[N], drift[N];
    static motion_t ahead, behind;
    num_t near[ROBOT_MAX_JOINTS], far[ROBOT_MAX_JOINTS];
    const double h = 2e-3;
    for (uint32_t i = 0; i < N; ++i) {
        near[i] = num_of(value_of(q[i]) + h * value_of(qd[i]));
        far[i] = num_of(value_of(q[i]) - h * value_of(qd[i]));
    }
    motion_step(&ahead, &loaded, near, qd);
    motion_step(&behind, &loaded, far, qd);
    for (uint32_t r = 0; r < 3u; ++r) {
        for (uint32_t i = 0; i < N; ++i) {
            v[r] += value_of(carried.jacobian[r][i]) * value_of(qd[i]);
        }
    }
    const double g[3] = {value_of(loaded.gravity.x), value_of(loaded.gravity.y), value_of(loaded.gravity.z)};
    for (uint32_t i = 0; i < N; ++i) {
        momentum[i] = 0.0;
        drift[i] = 0.0;
        for (uint32_t r = 0; r < 3u; ++r) {
            const double rate = (value_of(ahead.jacobian[r][i]) - value_of(behind.jacobian[r][i])) / (2.0 * h);
            momentum[i] += mass_kg * value_of(carried.jacobian[r][i]) * v[r];
            drift[i] += mass_kg * (rate * v[r] + value_of(carried.jacobian[r][i]) * g[r]);
        }
        /* its input to the observer: the change of momentum minus the drift */
        update[i] = num_of(value_of(gains.momentum_gain[g0]) * (momentum[i] - momentum_before[i]) -
                           value_of(gains.gain[g0]) * 0.5 * (drift[i] + drift_before[i]));
        momentum_before[i] = momentum[i];
        drift_before[i] = drift[i];
    }
    observer_step(&observer, &gains, N, &motion, tau, gap);
    for (uint32_t i = 0; i < N; ++i) {
        observer.update[i] = (observer.gap == 0u) ? NUM(0) : update[i];
    }
    acceleration_step(&acceleration, &bounds, &gains, &observer, &robot_ku_dex, &motion, qd,
                      (vec3_t){NUM(0), NUM(0), NUM(0)}, NUM(5));
    regressor_step(&regressor, &config, &gains, &robot_ku_dex, &motion, &observer, &acceleration, qd);
    const index_config_t task = {.kind = INDEX_REGRESSOR};
    index_step(&index_state, &subspace, &task, &robot_ku_dex, &motion, &observer, &acceleration, &regressor);
}

/* Largest index over the largest torque, both in Nm, while the arm moves for a second. */
static void move(double *left, double *seen, bool gaps) {
    double t = 0.0;
    *left = 0.0;
    *seen = 0.0;
    for (uint32_t k = 0; k < 1000u; ++k) {
        const uint32_t gap = (k == 0u) ? 0u : ((gaps && ((k % 50u) == 0u)) ? 2u : 1u);
        t += PERIOD_S * gap;
        payload_step(t, gap);
        for (uint32_t i = 0; (k > 100u) && (i < N); ++i) {
            *left = fmax(*left, fabs(value_of(index_state.unexplained[i]) / value_of(observer.gain)));
            *seen = fmax(*seen, fabs(value_of(regressor.torque[i])));
        }
    }
}

static void test_a_payload_in_motion_is_explained_without_knowing_it(void) {
    double left, seen;
    mass_kg = 2.0;
    place[0] = 0.05;
    place[1] = -0.03;
    place[2] = 0.08;
    move(&left, &seen, false);
    printf("2 kg: %.1f Nm, of which %.3f Nm remain\n", seen, left);
    TEST_ASSERT_TRUE(seen > 5.0);
    ASSERT_CLOSE(0.0, left, 0.1);
}

static void test_a_payload_stays_explained_after_a_lost_cycle(void) {
    double left, seen;
    mass_kg = 2.0;
    place[0] = 0.05;
    place[1] = -0.03;
    place[2] = 0.08;
    move(&left, &seen, true);
    ASSERT_CLOSE(0.0, left, 0.15);
}

static void test_the_first_column_at_rest_is_the_weight_of_three_kilograms(void) {
    const num_t still[ROBOT_MAX_JOINTS] = {NUM(0)};
    for (uint32_t k = 0; k < 300u; ++k) {
        motion_step(&motion, &robot_ku_dex, q, still);
        observer_step(&observer, &gains, N, &motion, motion.gravity, (k == 0u) ? 0u : 1u);
        acceleration_step(&acceleration, &bounds, &gains, &observer, &robot_ku_dex, &motion, still,
                          (vec3_t){NUM(0), NUM(0), NUM(0)}, NUM(5));
        regressor_step(&regressor, &config, &gains, &robot_ku_dex, &motion, &observer, &acceleration, still);
    }
    for (uint32_t i = 0; i < N; ++i) {
        ASSERT_CLOSE(29.43 * value_of(motion.jacobian[2][i]), value_of(regressor.column[0][i]), 1e-2);
        ASSERT_CLOSE(0.0, value_of(regressor.column[4][i]), 1e-4);
    }
}

static void test_a_restart_of_the_observer_forgets_the_columns(void) {
    double left, seen;
    mass_kg = 1.0;
    move(&left, &seen, false);
    payload_step(2.0, OBSERVER_MAX_GAP + 1u);
    for (uint32_t i = 0; i < N; ++i) {
        TEST_ASSERT_TRUE(regressor.column[0][i] == NUM(0));
        TEST_ASSERT_TRUE(regressor.torque[i] == NUM(0));
    }
}

static void test_without_a_task_that_needs_it_the_regressor_stays_zero(void) {
    double left, seen;
    config.used = 0u;
    mass_kg = 1.0;
    move(&left, &seen, false);
    TEST_ASSERT_TRUE(seen == 0.0);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_payload_in_motion_is_explained_without_knowing_it);
    RUN_TEST(test_a_payload_stays_explained_after_a_lost_cycle);
    RUN_TEST(test_the_first_column_at_rest_is_the_weight_of_three_kilograms);
    RUN_TEST(test_a_restart_of_the_observer_forgets_the_columns);
    RUN_TEST(test_without_a_task_that_needs_it_the_regressor_stays_zero);
    return UNITY_END();
}
