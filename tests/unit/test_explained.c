/* The size of the explained part: the estimate, its limits, and the acceleration that a payload may explain. */
#include "explained.h"

#include "core_fixture.h"
#include "robots.h"
#include "vec3.h"

#define N     7u
#define DECAY 0.951229424500714 /* exp(-50/s 1 ms) */

static const robot_t *robot;
static motion_t motion;
static observer_t observer;
static observer_config_t gains;
static acceleration_t measured;
static acceleration_config_t bounds;
static regressor_t regressor;
static index_t index_state;
static explained_t explained;
static explained_config_t limits;
static subspace_config_t config;
static index_config_t task;
static num_t pose[ROBOT_MAX_JOINTS];
static num_t rates[ROBOT_MAX_JOINTS];

void setUp(void) {
    const double q[N] = {0.3, 0.8, -0.4, -1.3, 0.6, 0.9, 0.2};
    robot = &robot_ku_dex;
    config = (subspace_config_t){.order = (uint32_t)ORDER_PROJECT_FIRST,
                                 .projector = (uint32_t)PROJECTOR_HARD,
                                 .tolerance = NUM(0.005),
                                 .lever_m = NUM(0.1),
                                 .softness = NUM(0.05)};
    limits = (explained_config_t){.mass_max_kg = NUM(3),
                                  .arm_max_m = NUM(0.2),
                                  .force_max_n = NUM(140),
                                  .moment_max_nm = NUM(40),
                                  .force_slack_n = NUM(25),
                                  .moment_slack_nm = NUM(10)};
    bounds = (acceleration_config_t){.force_floor_n = NUM(0.5), .error_max = NUM(2)};
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        limits.residual_max_nm[i] = NUM(200);
        pose[i] = (i < N) ? num_of(q[i]) : NUM(0);
        rates[i] = NUM(0);
    }
    for (uint32_t g = 0; g < OBSERVER_MAX_GAP; ++g) {
        const double decay = pow(DECAY, g + 1.0);
        gains.decay[g] = num_of(decay);
        gains.gain[g] = num_of(1.0 - decay);
        gains.momentum_gain[g] = num_of((1.0 - decay) / ((g + 1.0) * 1e-3));
    }
    motion_init(&motion);
    observer_init(&observer);
    acceleration_init(&measured);
    index_init(&index_state);
    explained_init(&explained);
    motion_step(&motion, robot, pose, rates);
    observer.decay = num_of(DECAY);
    observer.gain = num_of(1.0 - DECAY);
    observer.gap = 1u;
}
void tearDown(void) {
    TEST_ASSERT_EQUAL(0, explained.saturations);
    TEST_ASSERT_EQUAL(0, measured.saturations);
}

/* `ticks` ticks with a constant force (N) and moment (Nm) at the end-effector, with the observer's sign: r = -J^T w. */
static void hold_wrench(const double w[6], uint32_t ticks) {
    for (uint32_t k = 0; k < ticks; ++k) {
        for (uint32_t i = 0; i < N; ++i) {
            double torque = 0.0;
            for (uint32_t row = 0; row < 6u; ++row) {
                torque -= value_of(motion.jacobian[row][i]) * w[row];
            }
            observer.update[i] = num_of((1.0 - DECAY) * torque);
            observer.residual[i] = num_of(DECAY * value_of(observer.residual[i]) + (1.0 - DECAY) * torque);
        }
        index_step(&index_state, &config, &task, robot, &motion, &observer, &measured, &regressor);
        explained_step(&explained, &limits, &config, 2u, robot, &observer, &measured, &task, &index_state);
    }
}

/* A single component above every limit: the value that saturates for the squares is still an excess. */
static void test_the_largest_limits_can_be_exceeded(void) {
    const double force[6] = {0.0, 0.0, -470.0, 0.0, 0.0, 0.0};
    const double moment[6] = {0.0, 0.0, 0.0, 80.0, 0.0, 0.0};
    limits.force_max_n = NUM(EXPLAINED_FORCE_LIMIT);
    task = (index_config_t){.kind = (uint32_t)INDEX_CONTACT, .components = 0x04u};
    hold_wrench(force, 200u);
    TEST_ASSERT_EQUAL(EXPLAINED_FORCE, explained.excess);
    setUp();
    limits.moment_max_nm = NUM(40);
    task = (index_config_t){.kind = (uint32_t)INDEX_CONTACT, .components = 0x08u};
    hold_wrench(moment, 200u);
    TEST_ASSERT_EQUAL(EXPLAINED_MOMENT, explained.excess);
    setUp();
    limits.mass_max_kg = NUM(50);
    limits.force_slack_n = NUM(60);
    task = (index_config_t){.kind = (uint32_t)INDEX_PAYLOAD};
    hold_wrench(force, 200u);
    TEST_ASSERT_EQUAL(EXPLAINED_FORCE, explained.excess);
}

/* A column of 0.3 Nm, a torque of 1 Nm along it: the projector with s = 0.05 Nm explains 0.09 / (0.09 + 0.0025), the
 * estimate with s = 0.5 Nm gives 0.3 e / (0.09 + 0.25). */
static void test_the_estimate_of_a_regressor_is_as_soft_as_its_columns_are_in_nm(void) {
    config.projector = (uint32_t)PROJECTOR_SOFT;
    task = (index_config_t){.kind = (uint32_t)INDEX_REGRESSOR};
    regressor_init(&regressor);
    regressor.column[0][3] = NUM(0.3);
    regressor.torque[3] = NUM(1);
    for (uint32_t k = 0; k < 400u; ++k) {
        index_step(&index_state, &config, &task, robot, &motion, &observer, &measured, &regressor);
        explained_step(&explained, &limits, &config, 2u, robot, &observer, &measured, &task, &index_state);
    }
    ASSERT_CLOSE(0.3 * (0.09 / 0.0925) / 0.34, value_of(explained.coefficient[0]), 0.01);
    regressor_init(&regressor);
}

static void test_every_index_that_explains_torque_has_columns_and_limits(void) {
    const double force[6] = {0.0, 0.0, 300.0, 0.0, 0.0, 0.0};
    for (uint32_t kind = INDEX_RESIDUAL + 1u; kind < (uint32_t)INDEX_KIND_COUNT; ++kind) {
        setUp();
        config.projector = (uint32_t)PROJECTOR_SOFT;
        task =
            (index_config_t){.kind = kind, .components = (kind == (uint32_t)INDEX_CONTACT) ? INDEX_ALL_COMPONENTS : 0u};
        regressor.column[0][3] = NUM(0.3);
        regressor.torque[3] = NUM(30);
        hold_wrench(force, 400u);
        TEST_ASSERT_TRUE(index_state.columns > 0u);
        TEST_ASSERT_TRUE(explained.tripped);
    }
    regressor_init(&regressor);
}

static void test_a_payload_within_its_limits_is_permitted(void) {
    const double w[6] = {0.0, 0.0, -3.0 * 9.81, 1.0, 2.0, 0.0};
    task = (index_config_t){.kind = INDEX_PAYLOAD};
    hold_wrench(w, 400u);
    TEST_ASSERT_FALSE(explained.tripped);
}

/* Up and down: no payload has a negative weight, and none weighs 9 kg. */
static void test_a_clamped_hand_under_the_gripper_is_not_a_payload(void) {
    const double forces[] = {60.0, 300.0, -90.0, -300.0};
    for (uint32_t f = 0; f < 4u; ++f) {
        setUp();
        const double w[6] = {0.0, 0.0, forces[f], 0.0, 0.0, 0.0};
        task = (index_config_t){.kind = INDEX_PAYLOAD};
        hold_wrench(w, 400u);
        TEST_ASSERT_TRUE(explained.tripped);
        TEST_ASSERT_EQUAL(EXPLAINED_FORCE, explained.excess);
    }
}

static void test_a_moment_beyond_any_payload_is_an_excess(void) {
    const double w[6] = {0.0, 0.0, -20.0, 60.0, 0.0, 0.0};
    limits.force_slack_n = NUM(400); /* a part of a moment looks like weight */
    task = (index_config_t){.kind = INDEX_PAYLOAD};
    hold_wrench(w, 400u);
    TEST_ASSERT_TRUE(explained.tripped);
    TEST_ASSERT_EQUAL(EXPLAINED_MOMENT, explained.excess);
}

static void test_a_contact_beyond_its_force_is_an_excess_in_any_direction(void) {
    random_start(81);
    for (int round = 0; round < ((SPARSER > 1) ? 4 : 40); ++round) {
        double d[3] = {random_one(), random_one(), random_one()};
        const double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        const double w[6] = {250.0 * d[0] / length, 250.0 * d[1] / length, 250.0 * d[2] / length, 0.0, 0.0, 0.0};
        const double half[6] = {100.0 * d[0] / length, 100.0 * d[1] / length, 100.0 * d[2] / length, 0.0, 0.0, 0.0};
        setUp();
        task = (index_config_t){.kind = INDEX_CONTACT, .components = 0x07u};
        hold_wrench(half, 300u);
        TEST_ASSERT_FALSE(explained.tripped);
        hold_wrench(w, 300u);
        TEST_ASSERT_TRUE(explained.tripped);
    }
}

static void test_the_residual_has_its_limit_in_every_task(void) {
    const index_kind_t kinds[] = {INDEX_RESIDUAL, INDEX_PAYLOAD, INDEX_CONTACT};
    const double w[6] = {0.0, 0.0, -20.0, 0.0, 0.0, 0.0};
    for (uint32_t k = 0; k < 3u; ++k) {
        setUp();
        task = (index_config_t){.kind = (uint32_t)kinds[k],
                                .components = (kinds[k] == INDEX_CONTACT) ? INDEX_ALL_COMPONENTS : 0u};
        hold_wrench(w, 300u);
        TEST_ASSERT_FALSE(explained.tripped);
        limits.residual_max_nm[1] = NUM(1);
        hold_wrench(w, 3u);
        TEST_ASSERT_TRUE(explained.tripped);
        TEST_ASSERT_EQUAL(EXPLAINED_RESIDUAL, explained.excess);
        TEST_ASSERT_EQUAL(1, explained.joint);
    }
}

static void test_an_excess_needs_its_debounce(void) {
    const double w[6] = {0.0, 0.0, 300.0, 0.0, 0.0, 0.0};
    task = (index_config_t){.kind = INDEX_PAYLOAD};
    uint32_t beyond = 0;
    for (uint32_t k = 0; (k < 100u) && !explained.tripped; ++k) {
        hold_wrench(w, 1u);
        beyond += (explained.excess != EXPLAINED_NOTHING) ? 1u : 0u;
    }
    TEST_ASSERT_EQUAL(2, beyond);
}

/* --- the commanded acceleration ----------------------------------------------------------------------------------- */

/* The tip moves along x with `actual` m/s^2 while the controller commands `commanded`. */
static void accelerate(double actual, double commanded, uint32_t ticks) {
    static double speed;
    speed = 0.0;
    for (uint32_t k = 0; k < ticks; ++k) {
        speed += actual * 1e-3;
        for (uint32_t i = 0; i < N; ++i) {
            rates[i] = NUM(0);
        }
        rates[0] = num_of(speed / value_of(motion.jacobian[0][0]));
        acceleration_step(&measured, &bounds, &gains, &observer, robot, &motion, rates,
                          (vec3_t){num_of(commanded), NUM(0), NUM(0)}, limits.mass_max_kg);
    }
}

static void test_an_acceleration_that_the_arm_does_not_make_explains_nothing(void) {
    accelerate(0.0, 5.0, 200u);
    TEST_ASSERT_TRUE(measured.across == NUM(0));
    TEST_ASSERT_TRUE(vec3_length(measured.sideways) == NUM(0));
}

static void test_an_acceleration_too_small_to_matter_explains_nothing(void) {
    accelerate(0.0, 0.1, 200u); /* 3 kg: 0.3 N */
    TEST_ASSERT_TRUE(measured.across == NUM(0));
    accelerate(0.0, 0.3, 200u);
    TEST_ASSERT_TRUE(measured.across > NUM(0));
}

static void test_the_sideways_explained_part_is_bounded_by_the_acceleration(void) {
    const double within[6] = {3.0 + 20.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    const double beyond[6] = {60.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    task = (index_config_t){.kind = INDEX_PAYLOAD};
    accelerate(0.0, 1.0, 200u);
    TEST_ASSERT_TRUE(measured.across > NUM(0.9));
    hold_wrench(within, 400u);
    TEST_ASSERT_FALSE(explained.tripped);
    hold_wrench(beyond, 400u);
    TEST_ASSERT_TRUE(explained.tripped);
    TEST_ASSERT_EQUAL(EXPLAINED_FORCE, explained.excess);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_largest_limits_can_be_exceeded);
    RUN_TEST(test_every_index_that_explains_torque_has_columns_and_limits);
    RUN_TEST(test_a_payload_within_its_limits_is_permitted);
    RUN_TEST(test_a_clamped_hand_under_the_gripper_is_not_a_payload);
    RUN_TEST(test_a_moment_beyond_any_payload_is_an_excess);
    RUN_TEST(test_a_contact_beyond_its_force_is_an_excess_in_any_direction);
    RUN_TEST(test_the_residual_has_its_limit_in_every_task);
    RUN_TEST(test_an_excess_needs_its_debounce);
    RUN_TEST(test_the_estimate_of_a_regressor_is_as_soft_as_its_columns_are_in_nm);
    RUN_TEST(test_an_acceleration_that_the_arm_does_not_make_explains_nothing);
    RUN_TEST(test_an_acceleration_too_small_to_matter_explains_nothing);
    RUN_TEST(test_the_sideways_explained_part_is_bounded_by_the_acceleration);
    return UNITY_END();
}
