/* The conditions of a permission: start-up, deadlines, trips, resets. */
#include "guard_fixture.h"

static bench_t bench;

void setUp(void) {
    start(&bench);
}
void tearDown(void) {}

static void test_motion_is_not_permitted_before_every_input_was_received(void) {
    silent_cycles(&bench, 70u);
    TEST_ASSERT_EQUAL(GUARD_STATE_WAITING, bench.out.state);
    TEST_ASSERT_EQUAL(GUARD_REASON_WAITING_SYNC, bench.out.reason);
    for (uint32_t i = 0; i < 50u; ++i) {
        cycle_without(&bench, 1u << 3);
        TEST_ASSERT_FALSE(bench.out.permitted);
    }
    TEST_ASSERT_EQUAL(GUARD_REASON_WAITING_JOINT, bench.out.reason);
    TEST_ASSERT_EQUAL(4, bench.out.joint);
}

static void test_the_first_tick_is_the_self_test_and_permits_nothing(void) {
    cycle(&bench);
    TEST_ASSERT_FALSE(bench.out.permitted);
    TEST_ASSERT_EQUAL(GUARD_STATE_SELF_TEST, bench.out.state);
    uint32_t taken = 1;
    while ((bench.out.state == GUARD_STATE_SELF_TEST) && (taken < 100u)) {
        cycle(&bench);
        ++taken;
        TEST_ASSERT_FALSE(bench.out.permitted);
    }
    TEST_ASSERT_EQUAL(GUARD_STATE_WAITING, bench.out.state);
    TEST_ASSERT_TRUE(taken <= 66u);
}

static void test_permission_is_given_with_fresh_inputs_in_every_tick(void) {
    run_until_permitted(&bench);
    for (uint32_t i = 0; i < 500u; ++i) {
        cycle(&bench);
        TEST_ASSERT_TRUE(bench.out.permitted);
        TEST_ASSERT_EQUAL(GUARD_REASON_NONE, bench.out.reason);
        TEST_ASSERT_EQUAL(0x010, bench.out.frame[0].id);
        TEST_ASSERT_EQUAL_HEX8(0xE1, bench.out.frame[0].data[2]); /* Permission 1, PermissionInverted 14 */
        TEST_ASSERT_EQUAL(bench.cycle & 0x0F, bench.out.frame[0].data[3] >> 4);
    }
}

static void test_without_a_task_motion_is_never_permitted(void) {
    bench.task = TASK_INVALID;
    for (uint32_t i = 0; i < 50u; ++i) {
        cycle(&bench);
        TEST_ASSERT_FALSE(bench.out.permitted);
    }
    TEST_ASSERT_EQUAL(GUARD_REASON_TASK_INVALID, bench.out.reason);
    TEST_ASSERT_EQUAL(GUARD_STATE_WAITING, bench.out.state);
}

static void test_one_lost_cycle_is_bridged(void) {
    run_until_permitted(&bench);
    for (uint32_t lost = 1; lost < DEADLINE_CYCLES; ++lost) {
        silent_cycles(&bench, lost);
        TEST_ASSERT_TRUE(bench.out.permitted);
        cycles(&bench, 20u);
        TEST_ASSERT_TRUE(bench.out.permitted);
    }
}

static void test_a_silent_bus_ends_the_permission_at_the_deadline_and_latches(void) {
    run_until_permitted(&bench);
    silent_cycles(&bench, DEADLINE_CYCLES);
    TEST_ASSERT_TRUE(bench.out.permitted);
    silent_cycles(&bench, 1u);
    assert_stopped(&bench, GUARD_REASON_SYNC_TIMEOUT, 0u);
    cycles(&bench, 100u);
    assert_stopped(&bench, GUARD_REASON_SYNC_TIMEOUT, 0u);
}

static void test_one_silent_joint_ends_the_permission_at_the_deadline_and_is_named(void) {
    for (uint32_t joint = 0; joint < JOINTS; ++joint) {
        start(&bench);
        run_until_permitted(&bench);
        uint32_t taken = 0;
        while (bench.out.permitted && (taken < 100u)) {
            cycle_without(&bench, 1u << joint);
            ++taken;
        }
        TEST_ASSERT_EQUAL(DEADLINE_CYCLES + 1u, taken);
        assert_stopped(&bench, GUARD_REASON_JOINT_TIMEOUT, joint + 1u);
    }
}

static void test_a_silent_task_ends_the_permission_at_its_deadline(void) {
    run_until_permitted(&bench);
    uint32_t taken = 0;
    while (bench.out.permitted && (taken < 100u)) {
        next_cycle(&bench);
        receive(&bench, sync_frame(&bench));
        for (uint32_t i = 0; i < JOINTS; ++i) {
            receive(&bench, joint_frame(&bench, i));
        }
        tick(&bench);
        ++taken;
    }
    TEST_ASSERT_EQUAL(2u * DEADLINE_CYCLES + 1u, taken);
    assert_stopped(&bench, GUARD_REASON_TASK_TIMEOUT, 0u);
}

static void test_a_collision_trips_with_joint_value_and_number(void) {
    run_until_permitted(&bench);
    bench.torque[2] = (int16_t)(bench.torque[2] + 800); /* 8 Nm against a threshold of 2 Nm */
    uint32_t taken = 0;
    while (bench.out.permitted && (taken < 100u)) {
        cycle(&bench);
        ++taken;
    }
    assert_stopped(&bench, GUARD_REASON_COLLISION, 3u);
    /* 8 (1 - exp(-0.05 k)) passes 2 at k = 6; the debounce of 2 makes it 7. */
    TEST_ASSERT_EQUAL(7, taken);
    TEST_ASSERT_EQUAL(1, bench.out.trip_number);
    TEST_ASSERT_EQUAL(2, bench.out.stop_category);
    TEST_ASSERT_TRUE(bench.out.value_nm > NUM(2.0));
    TEST_ASSERT_TRUE(bench.out.threshold_nm == NUM(2.0));
    TEST_ASSERT_EQUAL_HEX8(0xF0, bench.out.frame[0].data[2]);
}

static void collide(uint32_t cycles_long) {
    bench.torque[2] = (int16_t)(bench.torque[2] + 800);
    cycles(&bench, cycles_long);
    bench.torque[2] = (int16_t)(bench.torque[2] - 800);
    assert_stopped(&bench, GUARD_REASON_COLLISION, 3u);
}

static void test_a_trip_stays_when_the_collision_is_over(void) {
    run_until_permitted(&bench);
    collide(20u);
    cycles(&bench, 1000u);
    assert_stopped(&bench, GUARD_REASON_COLLISION, 3u);
}

static void test_a_reset_that_names_the_trip_restores_the_permission(void) {
    run_until_permitted(&bench);
    collide(20u);
    cycles(&bench, 200u);
    ask_reset(&bench, bench.out.trip_number);
    TEST_ASSERT_TRUE(bench.out.permitted);
    TEST_ASSERT_EQUAL(0, bench.guard.counters.resets_refused);
}

static void test_a_reset_with_another_number_is_refused_and_counted(void) {
    run_until_permitted(&bench);
    collide(20u);
    cycles(&bench, 200u);
    ask_reset(&bench, (uint8_t)(bench.out.trip_number + 1u));
    assert_stopped(&bench, GUARD_REASON_COLLISION, 3u);
    TEST_ASSERT_EQUAL(1, bench.guard.counters.resets_refused);
}

static void test_a_reset_during_the_collision_is_refused(void) {
    run_until_permitted(&bench);
    bench.torque[2] = (int16_t)(bench.torque[2] + 800);
    cycles(&bench, 300u);
    ask_reset(&bench, bench.out.trip_number);
    assert_stopped(&bench, GUARD_REASON_COLLISION, 3u);
    TEST_ASSERT_EQUAL(1, bench.guard.counters.resets_refused);
}

static void test_a_reset_before_the_inputs_were_good_for_long_enough_is_refused(void) {
    run_until_permitted(&bench);
    silent_cycles(&bench, 10u);
    cycles(&bench, SETTLING_CYCLES + 50u); /* settled, and good for 50 ms of the required 100 ms */
    ask_reset(&bench, bench.out.trip_number);
    assert_stopped(&bench, GUARD_REASON_SYNC_TIMEOUT, 0u);
    cycles(&bench, 60u);
    ask_reset(&bench, bench.out.trip_number);
    TEST_ASSERT_TRUE(bench.out.permitted);
}

static void test_a_request_that_stays_at_one_is_not_a_reset(void) {
    run_until_permitted(&bench);
    ask_reset(&bench, 1u); /* an edge before the trip */
    TEST_ASSERT_EQUAL(1, bench.guard.counters.resets_refused);
    collide(20u);
    for (uint32_t i = 0; i < 200u; ++i) {
        receive(&bench, reset_frame(&bench, bench.out.trip_number, true));
        cycle(&bench);
        TEST_ASSERT_FALSE(bench.out.permitted);
    }
}

static void test_every_trip_has_its_own_number(void) {
    run_until_permitted(&bench);
    const uint32_t trips = ON_HOST_ELSE(299u, 20u); /* beyond the largest number, which is 255 */
    for (uint32_t expected = 1; expected <= trips; ++expected) {
        collide(12u);
        TEST_ASSERT_EQUAL(((expected - 1u) % 255u) + 1u, bench.out.trip_number);
        cycles(&bench, 220u);
        ask_reset(&bench, bench.out.trip_number);
        TEST_ASSERT_TRUE(bench.out.permitted);
    }
    TEST_ASSERT_EQUAL(trips, bench.guard.counters.trips);
}

static void test_a_change_of_task_never_interrupts_the_permission(void) {
    run_until_permitted(&bench);
    for (uint32_t i = 0; i < 600u; ++i) {
        bench.task = (uint8_t)(TASK_NONE + (i % 3u));
        cycle(&bench);
        TEST_ASSERT_TRUE(bench.out.permitted);
        TEST_ASSERT_TRUE(bench.out.task != TASK_INVALID);
    }
}

static void test_an_invalid_task_ends_the_permission_at_once(void) {
    run_until_permitted(&bench);
    bench.task = TASK_INVALID;
    cycle(&bench);
    assert_stopped(&bench, GUARD_REASON_TASK_INVALID, 0u);
    TEST_ASSERT_EQUAL(1, bench.out.stop_category);
}

static void test_a_task_that_is_not_configured_is_invalid(void) {
    guard_config_t config = make_config();
    config.task[TASK_CONTACT].index = (index_config_t){0};
    seal_config(&config);
    start_with(&bench, &config);
    run_until_permitted(&bench);
    bench.task = TASK_CONTACT;
    cycle(&bench);
    assert_stopped(&bench, GUARD_REASON_TASK_INVALID, 0u);
}

static void test_at_time_zero_no_input_counts_as_received(void) {
    bench.now_us = 0u;
    tick(&bench);
    for (uint32_t i = 0; i < 70u; ++i) {
        ++bench.now_us;
        tick(&bench);
    }
    TEST_ASSERT_EQUAL(GUARD_REASON_WAITING_SYNC, bench.out.reason);
}

static void test_the_first_permission_waits_until_the_observer_has_settled(void) {
    uint32_t taken = 0;
    cycle(&bench);
    while (bench.out.state == GUARD_STATE_SELF_TEST) {
        cycle(&bench);
    }
    while ((bench.out.reason != GUARD_REASON_AWAITING_RESET) && (taken < 1000u)) {
        cycle(&bench);
        ++taken;
        TEST_ASSERT_TRUE((bench.out.reason == GUARD_REASON_SETTLING) ||
                         (bench.out.reason == GUARD_REASON_AWAITING_RESET));
    }
    /* The observer settles. Then everything must be good for the healthy time. */
    TEST_ASSERT_EQUAL(1u + 2u * SETTLING_CYCLES, taken); /* the first sample only starts the observer */
}

static void test_a_collision_at_start_up_permits_nothing_and_latches(void) {
    run_until(&bench, GUARD_REASON_SETTLING);
    bench.torque[2] = (int16_t)(bench.torque[2] + 800);
    for (uint32_t i = 0; i < 2u * SETTLING_CYCLES; ++i) {
        cycle(&bench);
        TEST_ASSERT_FALSE(bench.out.permitted);
    }
    assert_stopped(&bench, GUARD_REASON_COLLISION, 3u);
}

static void test_a_new_trip_needs_its_own_healthy_time(void) {
    run_until_permitted(&bench);
    silent_cycles(&bench, 10u);
    cycles(&bench, 220u);
    ask_reset(&bench, bench.out.trip_number);
    TEST_ASSERT_TRUE(bench.out.permitted);
    bench.sensor_status[0] = 2u;
    cycle(&bench);
    assert_stopped(&bench, GUARD_REASON_SENSOR_STATUS, 1u);
    bench.sensor_status[0] = 0u;
    ask_reset(&bench, bench.out.trip_number);
    assert_stopped(&bench, GUARD_REASON_SENSOR_STATUS, 1u);
    cycles(&bench, 220u);
    ask_reset(&bench, bench.out.trip_number);
    TEST_ASSERT_TRUE(bench.out.permitted);
}

static void test_a_controller_that_starts_with_the_request_set_resets_nothing(void) {
    run_until_permitted(&bench);
    silent_cycles(&bench, 10u);
    cycles(&bench, 220u);
    for (uint32_t i = 0; i < 5u; ++i) {
        receive(&bench, reset_frame(&bench, bench.out.trip_number, true));
        cycle(&bench);
    }
    assert_stopped(&bench, GUARD_REASON_SYNC_TIMEOUT, 0u);
}

static void test_a_saturated_result_ends_the_permission(void) {
    run_until_permitted(&bench);
    ++bench.guard.observer.saturations;
    cycle(&bench);
    assert_stopped(&bench, GUARD_REASON_SATURATED, 0u);
}

static void test_the_guard_fits_its_memory(void) {
    TEST_ASSERT_TRUE(sizeof(guard_t) <= 6144u);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_motion_is_not_permitted_before_every_input_was_received);
    RUN_TEST(test_the_first_tick_is_the_self_test_and_permits_nothing);
    RUN_TEST(test_permission_is_given_with_fresh_inputs_in_every_tick);
    RUN_TEST(test_without_a_task_motion_is_never_permitted);
    RUN_TEST(test_one_lost_cycle_is_bridged);
    RUN_TEST(test_a_silent_bus_ends_the_permission_at_the_deadline_and_latches);
    RUN_TEST(test_one_silent_joint_ends_the_permission_at_the_deadline_and_is_named);
    RUN_TEST(test_a_silent_task_ends_the_permission_at_its_deadline);
    RUN_TEST(test_a_collision_trips_with_joint_value_and_number);
    RUN_TEST(test_a_trip_stays_when_the_collision_is_over);
    RUN_TEST(test_a_reset_that_names_the_trip_restores_the_permission);
    RUN_TEST(test_a_reset_with_another_number_is_refused_and_counted);
    RUN_TEST(test_a_reset_during_the_collision_is_refused);
    RUN_TEST(test_a_reset_before_the_inputs_were_good_for_long_enough_is_refused);
    RUN_TEST(test_a_request_that_stays_at_one_is_not_a_reset);
    RUN_TEST(test_every_trip_has_its_own_number);
    RUN_TEST(test_a_change_of_task_never_interrupts_the_permission);
    RUN_TEST(test_an_invalid_task_ends_the_permission_at_once);
    RUN_TEST(test_a_task_that_is_not_configured_is_invalid);
    RUN_TEST(test_at_time_zero_no_input_counts_as_received);
    RUN_TEST(test_the_first_permission_waits_until_the_observer_has_settled);
    RUN_TEST(test_a_collision_at_start_up_permits_nothing_and_latches);
    RUN_TEST(test_a_new_trip_needs_its_own_healthy_time);
    RUN_TEST(test_a_controller_that_starts_with_the_request_set_resets_nothing);
    RUN_TEST(test_a_saturated_result_ends_the_permission);
    RUN_TEST(test_the_guard_fits_its_memory);
    return UNITY_END();
}
