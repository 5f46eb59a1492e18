/* After a start or a trip: the reset that ends the latch, and the effect of a worse event. */
#include "guard_fixture.h"

static bench_t bench;

void setUp(void) {
    start(&bench);
}
void tearDown(void) {}

/* --- starts and resets -------------------------------------------------------------------------------------------- */

static void test_the_first_permission_needs_a_reset_that_names_the_number(void) {
    run_until(&bench, GUARD_REASON_AWAITING_RESET);
    cycles(&bench, 500u);
    TEST_ASSERT_EQUAL(GUARD_REASON_AWAITING_RESET, bench.out.reason);
    ask_reset(&bench, 1u);
    TEST_ASSERT_FALSE(bench.out.permitted);
    TEST_ASSERT_EQUAL(1, bench.guard.counters.resets_refused);
    ask_reset(&bench, 0u);
    TEST_ASSERT_TRUE(bench.out.permitted);
}

static void test_a_latch_survives_a_restart_as_a_missing_permission(void) {
    for (uint32_t cause = GUARD_START_UNKNOWN; cause <= (uint32_t)GUARD_START_SERVICE; ++cause) {
        start(&bench);
        guard_note_start(&bench.guard, (guard_start_t)cause, 1u, GUARD_VARIANT_PRODUCT);
        cycles(&bench, 1000u);
        TEST_ASSERT_FALSE(bench.out.permitted);
        const bool expected = (cause == (uint32_t)GUARD_START_POWER_ON) || (cause == (uint32_t)GUARD_START_COMMANDED);
        TEST_ASSERT_EQUAL(expected ? GUARD_REASON_AWAITING_RESET : GUARD_REASON_RESTARTED, bench.out.reason);
    }
}

static void test_restarts_are_limited(void) {
    for (uint32_t restarts = 0; restarts <= GUARD_MAX_RESTARTS + 2u; ++restarts) {
        start(&bench);
        guard_note_start(&bench.guard, GUARD_START_WATCHDOG, restarts, GUARD_VARIANT_PRODUCT);
        cycles(&bench, 400u);
        if (restarts <= GUARD_MAX_RESTARTS) {
            TEST_ASSERT_EQUAL(GUARD_REASON_RESTARTED, bench.out.reason);
        } else {
            assert_fault(&bench, GUARD_REASON_RESTART_LIMIT);
        }
    }
}

static void test_an_edge_counts_only_if_both_frames_came_after_the_trip(void) {
    run_until_permitted(&bench);
    receive(&bench, reset_frame(&bench, 1u, false)); /* Request 0 before the trip */
    cycle(&bench);
    bench.sensor_status[0] = 2u;
    cycle(&bench);
    assert_stopped(&bench, GUARD_REASON_SENSOR_STATUS, 1u);
    bench.sensor_status[0] = 0u;
    cycles(&bench, 3u * SETTLING_CYCLES);
    receive(&bench, reset_frame(&bench, 1u, true)); /* Request 1 after it */
    cycle(&bench);
    assert_stopped(&bench, GUARD_REASON_SENSOR_STATUS, 1u);
    ask_reset(&bench, 1u);
    TEST_ASSERT_TRUE(bench.out.permitted);
}

static void test_a_trip_reported_before_the_first_tick_is_not_forgotten(void) {
    receive(&bench, (can_frame_t){.id = protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND].id, .length = 8u});
    cycles(&bench, 100u);
    assert_stopped(&bench, GUARD_REASON_ANOTHER_GUARD, 0u);
}

static void test_a_saturated_result_blocks_the_first_permission(void) {
    for (uint32_t i = 0; i < 600u; ++i) {
        ++bench.guard.observer.saturations;
        receive(&bench, reset_frame(&bench, 0u, (i % 2u) != 0u));
        cycle(&bench);
        TEST_ASSERT_FALSE(bench.out.permitted);
    }
}

static void test_the_worse_of_two_faults_in_one_tick_stays(void) {
    run_until_permitted(&bench);
    guard_trip(&bench.guard, GUARD_REASON_STATE_CORRUPT);
    guard_trip(&bench.guard, GUARD_REASON_BUS_OFF);
    cycle(&bench);
    assert_fault(&bench, GUARD_REASON_STATE_CORRUPT);
}

/* --- monitoring while stopped ------------------------------------------------------------------------------------- */

static void stop_by_collision(void) {
    run_until_permitted(&bench);
    push(&bench, 2u, 800);
    for (uint32_t i = 0; (i < 50u) && bench.out.permitted; ++i) {
        cycle(&bench);
    }
    push(&bench, 2u, -800);
    TEST_ASSERT_EQUAL(2, bench.out.stop_category);
    cycles(&bench, 2u * SETTLING_CYCLES); /* the contact is over, the robot retreats */
    assert_stopped(&bench, GUARD_REASON_COLLISION, 3u);
}

static void test_a_second_collision_raises_the_category_with_a_new_number(void) {
    stop_by_collision();
    const uint8_t number = bench.out.trip_number;
    push(&bench, 2u, -900);
    cycles(&bench, 50u);
    assert_stopped(&bench, GUARD_REASON_COLLISION, 3u);
    TEST_ASSERT_EQUAL(1, bench.out.stop_category);
    TEST_ASSERT_EQUAL(number + 1u, bench.out.trip_number);
}

static void test_a_continuing_collision_is_not_a_second_one(void) {
    run_until_permitted(&bench);
    push(&bench, 2u, 800);
    cycles(&bench, 300u);
    assert_stopped(&bench, GUARD_REASON_COLLISION, 3u);
    TEST_ASSERT_EQUAL(1, bench.out.trip_number);
    TEST_ASSERT_EQUAL(2, bench.out.stop_category);
}

static void test_a_contact_that_grows_on_another_joint_is_a_second_one(void) {
    run_until_permitted(&bench);
    push(&bench, 2u, 800);
    cycles(&bench, 700u); /* the stop is over, but the first contact remains */
    TEST_ASSERT_EQUAL(1, bench.out.trip_number);
    TEST_ASSERT_EQUAL(2, bench.out.stop_category);
    bench.torque[4] = (int16_t)(bench.torque[4] + 600);
    cycles(&bench, 50u);
    assert_stopped(&bench, GUARD_REASON_COLLISION, 5u);
    TEST_ASSERT_EQUAL(1, bench.out.stop_category);
    TEST_ASSERT_EQUAL(2, bench.out.trip_number);
    TEST_ASSERT_TRUE(bench.out.value_nm > bench.out.threshold_nm);
}

static void test_silence_faults_and_the_board_raise_the_category_of_a_stop(void) {
    stop_by_collision();
    silent_cycles(&bench, 10u);
    assert_stopped(&bench, GUARD_REASON_SYNC_TIMEOUT, 0u);
    TEST_ASSERT_EQUAL(1, bench.out.stop_category);
    TEST_ASSERT_EQUAL(2, bench.out.trip_number);
    start(&bench);
    stop_by_collision();
    bench.sensor_status[4] = 2u;
    cycle(&bench);
    assert_stopped(&bench, GUARD_REASON_SENSOR_STATUS, 5u);
    TEST_ASSERT_EQUAL(1, bench.out.stop_category);
    static const guard_reason_t reasons[] = {GUARD_REASON_BUS_OFF, GUARD_REASON_SHUTDOWN};
    for (uint32_t i = 0; i < 2u; ++i) {
        start(&bench);
        stop_by_collision();
        guard_trip(&bench.guard, reasons[i]);
        cycle(&bench);
        assert_stopped(&bench, reasons[i], 0u);
        TEST_ASSERT_EQUAL(1, bench.out.stop_category);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_first_permission_needs_a_reset_that_names_the_number);
    RUN_TEST(test_a_latch_survives_a_restart_as_a_missing_permission);
    RUN_TEST(test_restarts_are_limited);
    RUN_TEST(test_an_edge_counts_only_if_both_frames_came_after_the_trip);
    RUN_TEST(test_a_trip_reported_before_the_first_tick_is_not_forgotten);
    RUN_TEST(test_a_saturated_result_blocks_the_first_permission);
    RUN_TEST(test_the_worse_of_two_faults_in_one_tick_stays);
    RUN_TEST(test_a_second_collision_raises_the_category_with_a_new_number);
    RUN_TEST(test_a_continuing_collision_is_not_a_second_one);
    RUN_TEST(test_a_contact_that_grows_on_another_joint_is_a_second_one);
    RUN_TEST(test_silence_faults_and_the_board_raise_the_category_of_a_stop);
    return UNITY_END();
}
