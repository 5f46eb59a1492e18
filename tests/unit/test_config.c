/* Configuration blocks that the guard accepts, and the reason for each refused one. Tasks and the bank of filters:
 * test_config_tasks.c. */
#include <stddef.h>

#include "config_fixture.h"

void setUp(void) {
    config = make_config();
}
void tearDown(void) {}

static void test_a_good_block_is_accepted(void) {
    assert_status(GUARD_OK);
}

static void test_a_foreign_block_is_refused_with_the_difference(void) {
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
    for (uint32_t bit = 0; bit < 8u * sizeof(config); bit += ON_HOST_ELSE(1u, 61u)) {
        ((uint8_t *)&config)[bit / 8u] ^= (uint8_t)(1u << (bit % 8u));
        TEST_ASSERT_NOT_EQUAL(GUARD_OK, config_check(&config));
        ((uint8_t *)&config)[bit / 8u] ^= (uint8_t)(1u << (bit % 8u));
    }
    TEST_ASSERT_EQUAL(GUARD_OK, config_check(&config));
}

static void test_impossible_timing_is_refused(void) {
    uint32_t *const positive[] = {&config.period_us,        &config.sync_deadline_us, &config.joint_deadline_us,
                                  &config.task_deadline_us, &config.tick_deadline_us, &config.tick_budget_us,
                                  &config.reset_healthy_us, &config.format,           &config.settling_us,
                                  &config.task_dwell_cycles};
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

/* No deadline, period or waiting time may be so long that the guard detects a person too late. */
static void test_times_that_make_the_guard_blind_are_refused(void) {
    uint32_t *const times[] = {&config.period_us,        &config.sync_deadline_us, &config.joint_deadline_us,
                               &config.task_deadline_us, &config.tick_deadline_us, &config.tick_budget_us,
                               &config.settling_us,      &config.task_dwell_cycles};
    for (size_t i = 0; i < sizeof(times) / sizeof(times[0]); ++i) {
        *times[i] = UINT32_MAX; /* 71 minutes */
        assert_status(GUARD_BAD_TIMING);
        *times[i] = 10u * 1000u * PERIOD_US;
        assert_status(GUARD_BAD_TIMING);
    }
    config.task_deadline_us = 16u * PERIOD_US; /* the counter cannot distinguish 16 cycles from none */
    assert_status(GUARD_BAD_TIMING);
    config.reset_healthy_us = config.settling_us - 1u;
    assert_status(GUARD_BAD_TIMING);
}

static void test_an_invalid_robot_table_is_refused(void) {
    config.robot.joint_count = 0u;
    assert_status(GUARD_BAD_ROBOT);
    config.robot.joint_count = ROBOT_MAX_JOINTS + 1u;
    assert_status(GUARD_BAD_ROBOT);
    config.robot.joint[7].inertia_zz = NUM(1); /* after the last joint */
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

static void test_an_observer_that_is_not_a_low_pass_is_refused(void) {
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
    config.subspace.order = 3u;
    assert_status(GUARD_BAD_SUBSPACE);
    config.subspace.softness = config.subspace.tolerance / 2;
    assert_status(GUARD_BAD_SUBSPACE);
}

static void test_a_soft_projector_needs_a_tolerance_that_fixed_point_resolves(void) {
    config.subspace.tolerance = NUM(0.003);
    assert_status(GUARD_BAD_SUBSPACE);
    config.subspace.tolerance = NUM(0.003);
    config.subspace.projector = PROJECTOR_HARD;
    assert_status(GUARD_OK);
    config.subspace.projector = 0u;
    assert_status(GUARD_BAD_SUBSPACE);
    config.subspace.projector = PROJECTOR_SOFT + 1u;
    assert_status(GUARD_BAD_SUBSPACE);
}

static void test_an_observer_that_is_too_slow_or_of_another_period_is_refused(void) {
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) { /* K = 0.001 1/s */
        config.observer.gain[g] = NUM(1e-6) * (int32_t)(g + 1u);
        config.observer.decay[g] = NUM(1) - config.observer.gain[g];
        config.observer.momentum_gain[g] = NUM(0.001);
    }
    assert_status(GUARD_BAD_OBSERVER);
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) { /* of half the period */
        config.observer.momentum_gain[g] = config.observer.momentum_gain[g] * 2;
    }
    assert_status(GUARD_BAD_OBSERVER);
    config.settling_us = 20u * PERIOD_US; /* one time constant is not five */
    assert_status(GUARD_BAD_OBSERVER);
    config.observer.decay[2] = config.observer.decay[1];
    config.observer.gain[2] = config.observer.gain[1];
    assert_status(GUARD_BAD_OBSERVER);
}

/* 0.95^k is 0.5 at k = 14. The debounce, the sample's age, the joint deadline and the tick deadline are added. */
static void test_the_worst_case_reaction_time_is_the_sum_of_its_parts(void) {
    TEST_ASSERT_EQUAL((1u + 14u + 2u + DEADLINE_CYCLES + 5u) * PERIOD_US, config_reaction_us(&config));
    config.period_us =
        CONFIG_PERIOD_MAX_US; /* 20 Hz with constants of 1 kHz would violate other bounds, so every part is slow */
    TEST_ASSERT_TRUE(config_reaction_us(&config) > CONFIG_REACTION_MAX_US);
    config = make_config();
}

static void test_an_unknown_stop_category_is_refused(void) {
    config.stop_collision = 3u;
    assert_status(GUARD_BAD_STOP);
    config.stop_input = 2u; /* only a collision may stop with the power on */
    assert_status(GUARD_BAD_STOP);
    config.stop_fault = 2u;
    assert_status(GUARD_BAD_STOP);
}

static void test_values_that_are_not_numbers_are_refused(void) {
#ifdef TAUPERP_FIXED
    const num_t nan = INT32_MIN; /* every pattern is a number there; this one has no negative */
    const num_t infinity = INT32_MIN;
#else
    const float nan = 0.0f / 0.0f;
    const float infinity = 1.0f / 0.0f;
#endif
    config.task[TASK_NONE].detector.threshold_nm[0][1] = infinity; /* would never trip */
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_NONE].detector.threshold_nm[0][1] = nan;
    assert_status(GUARD_BAD_TASK);
    config.robot.joint[1].sin_twist = nan;
    assert_status(GUARD_BAD_ROBOT);
    config.observer.momentum_gain[2] = infinity;
    assert_status(GUARD_BAD_OBSERVER);
    config.subspace.tolerance = infinity; /* nothing would count as explained */
    assert_status(GUARD_BAD_SUBSPACE);
}

/* True if the byte is in the row of one of these tasks. */
static bool is_in_row(uint32_t byte, uint32_t first, uint32_t second) {
    const uint32_t begin = (uint32_t)offsetof(guard_config_t, task);
    const uint32_t row = (byte - begin) / (uint32_t)sizeof(task_config_t);
    return (byte >= begin) && ((row == first) || (row == second));
}

static void test_the_watch_detects_any_one_bit_outside_the_other_tasks_rows_at_once(void) {
    const uint32_t begin = (uint32_t)offsetof(guard_config_t, task);
    const uint32_t end = begin + (uint32_t)sizeof(config.task);
    config_watch_t watch;
    config_watch_start(&watch, &config);
    for (uint32_t bit = 0; bit < 8u * (uint32_t)sizeof(config); bit += 7u) {
        uint8_t *const byte = (uint8_t *)&config + bit / 8u;
        const bool common = (bit / 8u < begin) || (bit / 8u >= end);
        TEST_ASSERT_TRUE(config_watch_step(&watch, &config, TASK_NONE, TASK_CONTACT));
        *byte ^= (uint8_t)(1u << (bit % 8u));
        TEST_ASSERT_EQUAL(!common && !is_in_row(bit / 8u, TASK_NONE, TASK_CONTACT),
                          config_watch_step(&watch, &config, TASK_NONE, TASK_CONTACT));
        *byte ^= (uint8_t)(1u << (bit % 8u));
    }
}

static void test_the_watch_detects_any_change_of_one_word_and_an_exchange_of_two(void) {
    config_watch_t watch;
    config_watch_start(&watch, &config);
    uint32_t *const word = (uint32_t *)(void *)config.task[TASK_NONE].detector.threshold_nm[0];
    const uint32_t first = word[0];
    for (uint32_t change = 0x80000000u; change > 0u; change /= 3u) {
        word[0] = first ^ change;
        TEST_ASSERT_FALSE(config_watch_step(&watch, &config, TASK_NONE, TASK_NONE));
        TEST_ASSERT_FALSE(config_watch_step(&watch, &config, TASK_PAYLOAD, TASK_NONE));
        TEST_ASSERT_TRUE(config_watch_step(&watch, &config, TASK_PAYLOAD, TASK_PAYLOAD));
    }
    word[0] = word[1] + 5u;
    config_watch_start(&watch, &config);
    word[0] = word[1];
    word[1] += 5u;
    TEST_ASSERT_FALSE(config_watch_step(&watch, &config, TASK_NONE, TASK_NONE));
}

static void test_a_flipped_bit_of_a_sum_is_detected(void) {
    config_watch_t watch;
    memset(&watch, 0xFF, sizeof(watch));
    config_watch_start(&watch, &config);
    watch.common ^= 0x100u;
    TEST_ASSERT_FALSE(config_watch_step(&watch, &config, TASK_NONE, TASK_NONE));
    watch.common ^= 0x100u;
    watch.row[TASK_PAYLOAD] ^= 0x100u;
    TEST_ASSERT_TRUE(config_watch_step(&watch, &config, TASK_NONE, TASK_NONE));
    TEST_ASSERT_TRUE(config_watch_step(&watch, &config, TASK_NONE, TASK_INVALID));
    TEST_ASSERT_FALSE(config_watch_step(&watch, &config, TASK_NONE, TASK_PAYLOAD));
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
    RUN_TEST(test_a_soft_projector_needs_a_tolerance_that_fixed_point_resolves);
    RUN_TEST(test_a_foreign_block_is_refused_with_the_difference);
    RUN_TEST(test_any_flipped_bit_is_refused);
    RUN_TEST(test_impossible_timing_is_refused);
    RUN_TEST(test_times_that_make_the_guard_blind_are_refused);
    RUN_TEST(test_an_observer_that_is_too_slow_or_of_another_period_is_refused);
    RUN_TEST(test_the_worst_case_reaction_time_is_the_sum_of_its_parts);
    RUN_TEST(test_an_invalid_robot_table_is_refused);
    RUN_TEST(test_an_observer_that_is_not_a_low_pass_is_refused);
    RUN_TEST(test_a_projection_without_tolerance_is_refused);
    RUN_TEST(test_an_unknown_stop_category_is_refused);
    RUN_TEST(test_a_sensor_correction_beyond_its_bounds_is_refused);
    RUN_TEST(test_values_that_are_not_numbers_are_refused);
    RUN_TEST(test_the_watch_detects_any_one_bit_outside_the_other_tasks_rows_at_once);
    RUN_TEST(test_the_watch_detects_any_change_of_one_word_and_an_exchange_of_two);
    RUN_TEST(test_a_flipped_bit_of_a_sum_is_detected);
    return UNITY_END();
}
