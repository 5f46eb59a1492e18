/* Which configuration blocks the guard runs on, and which it refuses with what reason. */
#include "guard_fixture.h"

static guard_config_t config;

void setUp(void) {
    config = make_config();
}
void tearDown(void) {}

static void assert_status(guard_status_t expected) {
    guard_t guard;
    seal_config(&config);
    TEST_ASSERT_EQUAL(expected, config_check(&config));
    TEST_ASSERT_EQUAL(expected, guard_init(&guard, &config));
    TEST_ASSERT_EQUAL((expected == GUARD_OK) ? GUARD_STATE_SELF_TEST : GUARD_STATE_UNINITIALISED, guard.state);
    config = make_config();
}

static void test_a_good_block_is_accepted(void) {
    assert_status(GUARD_OK);
}

static void test_a_foreign_block_is_refused_by_what_is_foreign(void) {
    config.magic ^= 1u;
    assert_status(GUARD_BAD_MAGIC);
    config.schema += 1u;
    assert_status(GUARD_BAD_SCHEMA);
    config.size -= 4u;
    assert_status(GUARD_BAD_SIZE);
    config.numeric = 3u - NUM_NUMERIC;
    assert_status(GUARD_BAD_NUMERIC);
    config.wire ^= 1u;
    assert_status(GUARD_BAD_WIRE);
}

static void test_any_flipped_bit_is_refused(void) {
    for (uint32_t bit = 0; bit < 8u * sizeof(config); ++bit) {
        ((uint8_t *)&config)[bit / 8u] ^= (uint8_t)(1u << (bit % 8u));
        TEST_ASSERT_NOT_EQUAL(GUARD_OK, config_check(&config));
        ((uint8_t *)&config)[bit / 8u] ^= (uint8_t)(1u << (bit % 8u));
    }
    TEST_ASSERT_EQUAL(GUARD_OK, config_check(&config));
}

static void test_timing_that_cannot_hold_is_refused(void) {
    uint32_t *const positive[] = {
        &config.period_us,        &config.sync_deadline_us, &config.joint_deadline_us, &config.task_deadline_us,
        &config.tick_deadline_us, &config.tick_budget_us,   &config.reset_healthy_us,  &config.format};
    for (size_t i = 0; i < sizeof(positive) / sizeof(positive[0]); ++i) {
        *positive[i] = 0u;
        assert_status(GUARD_BAD_TIMING);
    }
    config.sync_deadline_us = PERIOD_US - 1u;
    assert_status(GUARD_BAD_TIMING);
    config.joint_deadline_us = (CONFIG_MAX_GAP + 1u) * PERIOD_US; /* more than one observer step can bridge */
    assert_status(GUARD_BAD_TIMING);
    config.format = FORMAT_FD + 1u;
    assert_status(GUARD_BAD_TIMING);
}

static void test_a_task_that_cannot_detect_is_refused(void) {
    config.task[TASK_PAYLOAD].threshold_nm[6] = NUM(0);
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_PAYLOAD].threshold_nm[0] = NUM(-1);
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_NONE].debounce_ticks = 0u;
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_NONE].index = INDEX_CONTACT + 1u;
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_INVALID].index = INDEX_RESIDUAL;
    assert_status(GUARD_BAD_TASK);
    for (uint32_t t = 0; t < TASK_COUNT; ++t) {
        config.task[t].index = INDEX_OFF;
    }
    assert_status(GUARD_BAD_TASK);
}

static void shorten(uint32_t joints) {
    config.robot.joint_count = joints;
    memset(&config.robot.joint[joints], 0, (ROBOT_MAX_JOINTS - joints) * sizeof(robot_joint_t));
}

static void test_an_index_that_would_see_nothing_is_refused_with_its_reason(void) {
    for (uint32_t joints = 1; joints <= JOINTS; ++joints) {
        shorten(joints);
        assert_status((joints < 7u) ? ((joints < 6u) ? GUARD_PAYLOAD_NEEDS_6_JOINTS : GUARD_CONTACT_NEEDS_7_JOINTS)
                                    : GUARD_OK);
        shorten(joints);
        config.task[TASK_PAYLOAD].index = INDEX_OFF;
        config.task[TASK_CONTACT].index = INDEX_OFF;
        assert_status(GUARD_OK);
    }
}

static void test_a_robot_table_that_cannot_be_walked_is_refused(void) {
    config.robot.joint_count = 0u;
    assert_status(GUARD_BAD_ROBOT);
    config.robot.joint_count = ROBOT_MAX_JOINTS + 1u;
    assert_status(GUARD_BAD_ROBOT);
    config.robot.joint[7].inertia_zz = NUM(1); /* behind the last joint */
    assert_status(GUARD_BAD_ROBOT);
    config.robot.joint[2].cos_twist = NUM(0.5);
    assert_status(GUARD_BAD_ROBOT);
    config.robot.base[1][1] = NUM(2);
    assert_status(GUARD_BAD_ROBOT);
    config.robot.joint[3].position_max_rad = config.robot.joint[3].position_min_rad;
    assert_status(GUARD_BAD_ROBOT);
    config.robot.joint[3].velocity_max_rad_s = NUM(0);
    assert_status(GUARD_BAD_ROBOT);
    config.robot.joint[0].torque_max_nm = NUM(0);
    assert_status(GUARD_BAD_ROBOT);
}

static void test_an_observer_that_is_no_low_pass_is_refused(void) {
    config.observer.decay[0] = NUM(1.0);
    assert_status(GUARD_BAD_OBSERVER);
    config.observer.gain[3] = NUM(-0.1);
    assert_status(GUARD_BAD_OBSERVER);
    config.observer.momentum_gain[1] = NUM(0);
    assert_status(GUARD_BAD_OBSERVER);
    config.observer.torque_sample = 0u;
    assert_status(GUARD_BAD_OBSERVER);
}

static void test_a_projection_without_tolerance_is_refused(void) {
    config.subspace.tolerance = NUM(0);
    assert_status(GUARD_BAD_SUBSPACE);
    config.subspace.lever_m = NUM(0);
    assert_status(GUARD_BAD_SUBSPACE);
    config.subspace.basis = 3u;
    assert_status(GUARD_BAD_SUBSPACE);
}

static void test_an_unknown_stop_category_is_refused(void) {
    config.stop_collision = 3u;
    assert_status(GUARD_BAD_STOP);
    config.stop_input = 3u;
    assert_status(GUARD_BAD_STOP);
    config.stop_fault = 3u;
    assert_status(GUARD_BAD_STOP);
}

static void test_numbers_that_are_none_are_refused(void) {
#ifdef TAUPERP_FIXED
    const num_t nan = INT32_MIN; /* every pattern is a number there; this one has no opposite */
    const num_t infinity = INT32_MIN;
#else
    const float nan = 0.0f / 0.0f;
    const float infinity = 1.0f / 0.0f;
#endif
    config.task[TASK_NONE].threshold_nm[1] = infinity; /* would never trip */
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_NONE].threshold_nm[1] = nan;
    assert_status(GUARD_BAD_TASK);
    config.robot.joint[1].sin_twist = nan;
    assert_status(GUARD_BAD_ROBOT);
    config.observer.momentum_gain[2] = infinity;
    assert_status(GUARD_BAD_OBSERVER);
    config.subspace.tolerance = infinity; /* nothing would count as explained */
    assert_status(GUARD_BAD_SUBSPACE);
}

static void test_the_watch_sees_a_change_within_one_round(void) {
    config_watch_t watch;
    config_watch_start(&watch);
    const uint32_t round = (uint32_t)(sizeof(config) / CONFIG_WATCH_BYTES) + 1u;
    for (uint32_t i = 0; i < 3u * round; ++i) {
        TEST_ASSERT_TRUE(config_watch_step(&watch, &config));
    }
    config.task[TASK_NONE].threshold_nm[0] = NUM(100);
    bool intact = true;
    for (uint32_t i = 0; i < 2u * round; ++i) {
        intact = intact && config_watch_step(&watch, &config);
    }
    TEST_ASSERT_FALSE(intact);
    watch.offset = 3u;
    TEST_ASSERT_FALSE(config_watch_step(&watch, &config));
}

static void test_a_sensor_correction_beyond_its_bounds_is_refused(void) {
    config.sensor.offset_nm[2] = NUM(65);
    assert_status(GUARD_BAD_SENSOR);
    config.sensor.friction_nm[7] = NUM(-1);
    assert_status(GUARD_BAD_SENSOR);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_good_block_is_accepted);
    RUN_TEST(test_a_foreign_block_is_refused_by_what_is_foreign);
    RUN_TEST(test_any_flipped_bit_is_refused);
    RUN_TEST(test_timing_that_cannot_hold_is_refused);
    RUN_TEST(test_a_task_that_cannot_detect_is_refused);
    RUN_TEST(test_an_index_that_would_see_nothing_is_refused_with_its_reason);
    RUN_TEST(test_a_robot_table_that_cannot_be_walked_is_refused);
    RUN_TEST(test_an_observer_that_is_no_low_pass_is_refused);
    RUN_TEST(test_a_projection_without_tolerance_is_refused);
    RUN_TEST(test_an_unknown_stop_category_is_refused);
    RUN_TEST(test_a_sensor_correction_beyond_its_bounds_is_refused);
    RUN_TEST(test_numbers_that_are_none_are_refused);
    RUN_TEST(test_the_watch_sees_a_change_within_one_round);
    return UNITY_END();
}
