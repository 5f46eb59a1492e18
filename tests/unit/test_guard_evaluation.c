/* A permission depends on what was evaluated: cycle numbers, snapshots, time, senders, readings, starts. */
#include "guard_fixture.h"

static bench_t bench;

void setUp(void) {
    start(&bench);
}
void tearDown(void) {}

static void push(int32_t raw) {
    bench.torque[2] = (int16_t)(bench.torque[2] + raw);
}

/* One cycle whose number advances by `advance`. */
static void jump(uint32_t advance) {
    bench.cycle = (uint16_t)(bench.cycle + advance - 1u);
    cycle(&bench);
}

/* --- cycles ------------------------------------------------------------------------------------------------------- */

static void test_a_cycle_number_that_jumps_ends_the_permission_at_once(void) {
    static const uint32_t advances[] = {17u, 18u, 33u, 257u, 4097u, 32769u, 65521u};
    for (uint32_t i = 0; i < sizeof(advances) / sizeof(advances[0]); ++i) {
        start(&bench);
        run_until_permitted(&bench);
        jump(advances[i]);
        assert_stopped(&bench, GUARD_REASON_CYCLE_JUMP, 0u);
        TEST_ASSERT_EQUAL(1, bench.guard.counters.sequence_errors);
        cycles(&bench, 3u * SETTLING_CYCLES); /* the robot is accepted again with its new number */
        ask_reset(&bench, bench.out.trip_number);
        TEST_ASSERT_TRUE(bench.out.permitted);
    }
}

static void test_cycle_numbers_that_go_on_jumping_never_permit(void) {
    for (uint32_t i = 0; i < 600u; ++i) {
        jump(17u);
        receive(&bench, reset_frame(&bench, bench.out.trip_number, (i % 2u) != 0u));
        TEST_ASSERT_FALSE(bench.out.permitted);
    }
    TEST_ASSERT_TRUE(bench.guard.counters.sequence_errors > 500u);
}

static void test_an_observer_that_starts_again_needs_its_settling_time(void) {
    run_until_permitted(&bench);
    jump(17u);
    uint32_t taken = 0;
    while (!bench.out.permitted && (taken < 1000u)) {
        receive(&bench, reset_frame(&bench, bench.out.trip_number, (taken % 2u) != 0u));
        cycle(&bench);
        ++taken;
    }
    TEST_ASSERT_TRUE(taken >= 2u * SETTLING_CYCLES);
    TEST_ASSERT_TRUE(bench.guard.settled_cycles >= SETTLING_CYCLES);
}

static void test_snapshots_that_no_tick_evaluates_keep_nothing_fresh(void) {
    run_until_permitted(&bench);
    uint32_t taken = 0;
    while (bench.out.permitted && (taken < 100u)) {
        next_cycle(&bench);
        receive(&bench, sync_frame(&bench));
        receive(&bench, task_frame(&bench));
        for (uint32_t i = 0; i < JOINTS; ++i) {
            receive(&bench, joint_frame(&bench, i));
        }
        bench.guard.inputs.snapshot.taken = true; /* a fault: the complete snapshot is never taken */
        bench.guard.inputs.snapshot.taken_cycle = bench.cycle;
        tick(&bench);
        ++taken;
    }
    TEST_ASSERT_TRUE(taken <= DEADLINE_CYCLES + 1u);
    assert_stopped(&bench, GUARD_REASON_JOINT_TIMEOUT, 0u);
}

static void test_a_contact_from_power_on_never_gets_a_permission(void) {
    push(4000); /* 40 Nm, from the first sample */
    for (uint32_t i = 0; i < 1000u; ++i) {
        cycle(&bench);
        receive(&bench, reset_frame(&bench, bench.out.trip_number, (i % 2u) != 0u));
        TEST_ASSERT_FALSE(bench.out.permitted);
    }
}

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

static void test_a_worse_fault_of_the_same_tick_is_the_one_that_stays(void) {
    run_until_permitted(&bench);
    guard_trip(&bench.guard, GUARD_REASON_STATE_CORRUPT);
    guard_trip(&bench.guard, GUARD_REASON_BUS_OFF);
    cycle(&bench);
    assert_fault(&bench, GUARD_REASON_STATE_CORRUPT);
}

/* --- monitoring while stopped ------------------------------------------------------------------------------------- */

static void stop_by_collision(void) {
    run_until_permitted(&bench);
    push(800);
    for (uint32_t i = 0; (i < 50u) && bench.out.permitted; ++i) {
        cycle(&bench);
    }
    push(-800);
    TEST_ASSERT_EQUAL(2, bench.out.stop_category);
    cycles(&bench, 2u * SETTLING_CYCLES); /* the contact is over, the robot retreats */
    assert_stopped(&bench, GUARD_REASON_COLLISION, 3u);
}

static void test_a_second_collision_raises_the_category_with_a_new_number(void) {
    stop_by_collision();
    const uint8_t number = bench.out.trip_number;
    push(-900);
    cycles(&bench, 50u);
    assert_stopped(&bench, GUARD_REASON_COLLISION, 3u);
    TEST_ASSERT_EQUAL(1, bench.out.stop_category);
    TEST_ASSERT_EQUAL(number + 1u, bench.out.trip_number);
}

static void test_a_collision_that_goes_on_is_not_a_second_one(void) {
    run_until_permitted(&bench);
    push(800);
    cycles(&bench, 300u);
    assert_stopped(&bench, GUARD_REASON_COLLISION, 3u);
    TEST_ASSERT_EQUAL(1, bench.out.trip_number);
    TEST_ASSERT_EQUAL(2, bench.out.stop_category);
}

static void test_a_contact_that_grows_on_another_joint_is_a_second_one(void) {
    run_until_permitted(&bench);
    push(800);
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

static void test_readings_that_are_late_by_multiples_of_sixteen_cycles_are_late(void) {
    for (uint32_t late = 16u; late <= 48u; late += 16u) {
        start(&bench);
        run_until_permitted(&bench);
        uint32_t taken = 0;
        while (bench.out.permitted && (taken < 100u)) {
            next_cycle(&bench);
            receive(&bench, sync_frame(&bench));
            receive(&bench, task_frame(&bench));
            for (uint32_t i = 0; i < JOINTS; ++i) {
                const uint16_t now = bench.cycle;
                bench.cycle = (uint16_t)((i == 4u) ? (now - late) : now);
                const can_frame_t frame = joint_frame(&bench, i);
                bench.cycle = now;
                receive(&bench, frame);
            }
            tick(&bench);
            ++taken;
        }
        assert_stopped(&bench, GUARD_REASON_JOINT_TIMEOUT, 5u);
        TEST_ASSERT_EQUAL(DEADLINE_CYCLES + 1u, taken);
        TEST_ASSERT_TRUE(bench.guard.counters.late_frames >= DEADLINE_CYCLES);
    }
}

/* --- time --------------------------------------------------------------------------------------------------------- */

/* A robot whose cycles take `cycle_us` of guard time instead of a period. True if the guard still permits. */
static bool permits_at(uint32_t cycle_us) {
    start(&bench);
    run_until_permitted(&bench);
    for (uint32_t i = 0; (i < 200u) && bench.out.permitted; ++i) {
        bench.now_us -= PERIOD_US;
        bench.now_us += cycle_us;
        cycle(&bench);
    }
    return bench.out.permitted;
}

static void test_time_and_cycles_must_agree_within_a_quarter(void) {
    TEST_ASSERT_TRUE(permits_at(PERIOD_US));
    TEST_ASSERT_TRUE(permits_at(800u));
    TEST_ASSERT_TRUE(permits_at(1200u));
    TEST_ASSERT_FALSE(permits_at(700u));
    assert_stopped(&bench, GUARD_REASON_CLOCK_RATE, 0u);
    TEST_ASSERT_FALSE(permits_at(1300u));
    assert_stopped(&bench, GUARD_REASON_CLOCK_RATE, 0u);
    TEST_ASSERT_FALSE(permits_at(50u));
    TEST_ASSERT_FALSE(permits_at(1900u));
}

static void test_there_is_no_permission_before_time_and_cycles_have_agreed(void) {
    run_until_permitted(&bench);
    bench.guard.inputs.clocks_agree = false;
    bench.guard.inputs.window_cycles = 0;
    silent_cycles(&bench, DEADLINE_CYCLES + 1u);
    const uint8_t number = bench.out.trip_number;
    for (uint32_t i = 0; i < 20u; ++i) { /* everything else has been good for a long time */
        bench.guard.settled_cycles = UINT16_MAX;
        cycle(&bench);
        TEST_ASSERT_FALSE(bench.guard.healthy);
    }
    cycles(&bench, 300u);
    ask_reset(&bench, number);
    TEST_ASSERT_TRUE(bench.out.permitted);
}

static void test_a_silent_task_is_missed_by_cycles_when_the_clock_is_slow(void) {
    run_until_permitted(&bench);
    uint32_t taken = 0;
    while (bench.out.permitted && (taken < 100u)) {
        ++bench.cycle;
        bench.now_us += PERIOD_US / 50u;
        receive(&bench, sync_frame(&bench));
        for (uint32_t i = 0; i < JOINTS; ++i) {
            receive(&bench, joint_frame(&bench, i));
        }
        tick(&bench);
        ++taken;
    }
    TEST_ASSERT_EQUAL((2u * DEADLINE_CYCLES) + 1u, taken);
    assert_stopped(&bench, GUARD_REASON_TASK_TIMEOUT, 0u);
}

static void test_a_clock_that_stands_is_a_fault(void) {
    run_until_permitted(&bench);
    for (uint32_t i = 0; i < 10u; ++i) {
        bench.now_us -= PERIOD_US;
        cycle(&bench);
    }
    assert_fault(&bench, GUARD_REASON_CLOCK_STOPPED);
}

static void test_a_task_command_of_another_cycle_is_late(void) {
    run_until_permitted(&bench);
    uint32_t taken = 0;
    while (bench.out.permitted && (taken < 100u)) {
        const can_frame_t stale = task_frame(&bench); /* of the cycle before */
        next_cycle(&bench);
        receive(&bench, sync_frame(&bench));
        receive(&bench, stale);
        for (uint32_t i = 0; i < JOINTS; ++i) {
            receive(&bench, joint_frame(&bench, i));
        }
        tick(&bench);
        ++taken;
    }
    TEST_ASSERT_TRUE(taken <= 2u * DEADLINE_CYCLES + 1u);
    TEST_ASSERT_FALSE(bench.out.permitted);
}

/* --- senders ------------------------------------------------------------------------------------------------------ */

static void test_a_sender_with_many_bad_frames_is_a_stop(void) {
    run_until_permitted(&bench);
    uint32_t taken = 0;
    while (bench.out.permitted && (taken < 1000u)) {
        can_frame_t forged = joint_frame(&bench, 3u);
        forged.data[0] ^= 0x55u;
        receive(&bench, forged); /* a bad one before every genuine one */
        cycle(&bench);
        ++taken;
    }
    assert_stopped(&bench, GUARD_REASON_ERROR_RATE, 4u);
    TEST_ASSERT_TRUE(taken <= 20u);
}

static void test_one_bad_frame_in_twenty_has_no_consequence(void) {
    run_until_permitted(&bench);
    for (uint32_t i = 0; i < 2000u; ++i) {
        if ((i % 20u) == 0u) {
            can_frame_t bad = joint_frame(&bench, 3u);
            bad.data[5] ^= 0x10u;
            receive(&bench, bad);
        }
        cycle(&bench);
        TEST_ASSERT_TRUE(bench.out.permitted);
    }
}

/* Each gap is short enough to be bridged, but the gaps do not end. */
static void test_a_joint_that_loses_three_frames_in_four_is_a_stop(void) {
    run_until_permitted(&bench);
    uint32_t taken = 0;
    while (bench.out.permitted && (taken < 1000u)) {
        next_cycle(&bench);
        receive(&bench, sync_frame(&bench));
        receive(&bench, task_frame(&bench));
        for (uint32_t i = 0; i < JOINTS; ++i) {
            if ((i != 3u) || ((taken % 4u) == 3u)) {
                receive(&bench, joint_frame(&bench, i));
            }
        }
        tick(&bench);
        ++taken;
    }
    assert_stopped(&bench, GUARD_REASON_ERROR_RATE, 4u);
    TEST_ASSERT_TRUE(taken <= 30u);
}

/* A GuardReset is an event: after a restart the controller's counter jumps. */
static void test_a_reset_whose_counter_jumps_is_no_sender_with_losses(void) {
    run_until_permitted(&bench);
    for (uint32_t i = 0; i < 20u; ++i) {
        bench.reset_counter += 13u;
        receive(&bench, reset_frame(&bench, 0u, false));
        cycle(&bench);
        TEST_ASSERT_TRUE(bench.out.permitted);
    }
}

static void test_one_lost_frame_in_ten_has_no_consequence(void) {
    run_until_permitted(&bench);
    for (uint32_t k = 0; k < 1000u; ++k) {
        next_cycle(&bench);
        receive(&bench, sync_frame(&bench));
        receive(&bench, task_frame(&bench));
        for (uint32_t i = 0; i < JOINTS; ++i) {
            if ((i != 3u) || ((k % 10u) != 0u)) {
                receive(&bench, joint_frame(&bench, i));
            }
        }
        tick(&bench);
        TEST_ASSERT_TRUE(bench.out.permitted);
    }
}

static void test_a_counter_twice_a_cycle_in_cycle_after_cycle_is_another_sender(void) {
    run_until_permitted(&bench);
    uint32_t taken = 0;
    while (bench.out.permitted && (taken < 100u)) {
        cycle(&bench);
        receive(&bench, joint_frame(&bench, 5u)); /* once more, with the same counter */
        ++taken;
    }
    assert_stopped(&bench, GUARD_REASON_ANOTHER_SENDER, 6u);
    TEST_ASSERT_TRUE(taken <= 5u);
}

static void test_a_single_repetition_is_no_other_sender(void) {
    run_until_permitted(&bench);
    for (uint32_t i = 0; i < 50u; ++i) {
        receive(&bench, joint_frame(&bench, 5u));
        cycles(&bench, 30u);
        TEST_ASSERT_TRUE(bench.out.permitted);
    }
}

/* --- readings ----------------------------------------------------------------------------------------------------- */

static void test_a_position_that_jumps_is_implausible(void) {
    run_until_permitted(&bench);
    bench.position[5] = (int16_t)(bench.position[5] + 80); /* 10 mrad within 1 ms, at zero velocity */
    cycle(&bench);
    assert_stopped(&bench, GUARD_REASON_IMPLAUSIBLE, 6u);
}

static void test_a_velocity_that_the_position_does_not_show_is_implausible(void) {
    run_until_permitted(&bench);
    bench.velocity[6] = 1200; /* 0.3 rad/s, but the position stays */
    cycles(&bench, 40u);
    assert_stopped(&bench, GUARD_REASON_IMPLAUSIBLE, 7u);
}

static void test_a_joint_that_moves_as_it_says_is_plausible(void) {
    run_until_permitted(&bench);
    for (uint32_t i = 0; i < 400u; ++i) {
        bench.velocity[6] = (int16_t)((i < 100u) ? (20 * i) : 2000u); /* up to 0.5 rad/s; joint 7 carries little load */
        static double position;
        position = (i == 0u) ? bench.position[6] : (position + bench.velocity[6] * 0.002); /* raw: 2 quanta a ms */
        bench.position[6] = (int16_t)position;
        cycle(&bench);
        TEST_ASSERT_NOT_EQUAL(GUARD_REASON_IMPLAUSIBLE, bench.out.reason);
    }
}

static void test_a_torque_at_the_end_of_its_range_is_out_of_range(void) {
    run_until_permitted(&bench);
    bench.torque[0] = 20000; /* 200 Nm: the joint's limit */
    cycle(&bench);
    assert_stopped(&bench, GUARD_REASON_INPUT_RANGE, 1u);
}

/* Joint 2 turns slowly: its gravity torque changes, but the reading does not. */
static void test_a_torque_that_repeats_bit_for_bit_while_the_arm_moves_is_frozen(void) {
    guard_config_t config = make_config();
    for (uint32_t i = 0; i < JOINTS; ++i) { /* so that the missing torque is not detected first */
        config.task[TASK_NONE].detector.threshold_nm[0][i] = config.robot.joint[i].torque_max_nm / 3;
    }
    seal_config(&config);
    start_with(&bench, &config);
    run_until_permitted(&bench);
    for (uint32_t i = 0; (i < 400u) && bench.out.permitted; ++i) {
        bench.velocity[1] = 400; /* 0.1 rad/s */
        bench.position[1] = (int16_t)(bench.position[1] + ((i % 5u) == 0u ? 4 : 0));
        cycle(&bench);
    }
    TEST_ASSERT_FALSE(bench.out.permitted);
    TEST_ASSERT_EQUAL(GUARD_REASON_FROZEN, bench.out.reason);
}

/* --- two copies of the permission --------------------------------------------------------------------------------- */

static void test_the_inverted_copy_comes_by_another_path(void) {
    run_until_permitted(&bench);
    bench.guard.acknowledged = false; /* a fault that the state does not show */
    cycle(&bench);
    TEST_ASSERT_TRUE(bench.out.permitted);
    TEST_ASSERT_TRUE(bench.out.withheld);
    TEST_ASSERT_EQUAL_HEX8(0xF1, bench.out.frame[0].data[2]); /* Move and Stop: a pair that does not permit */
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_cycle_number_that_jumps_ends_the_permission_at_once);
    RUN_TEST(test_cycle_numbers_that_go_on_jumping_never_permit);
    RUN_TEST(test_an_observer_that_starts_again_needs_its_settling_time);
    RUN_TEST(test_snapshots_that_no_tick_evaluates_keep_nothing_fresh);
    RUN_TEST(test_a_contact_from_power_on_never_gets_a_permission);
    RUN_TEST(test_the_first_permission_needs_a_reset_that_names_the_number);
    RUN_TEST(test_a_latch_survives_a_restart_as_a_missing_permission);
    RUN_TEST(test_restarts_are_limited);
    RUN_TEST(test_an_edge_counts_only_if_both_frames_came_after_the_trip);
    RUN_TEST(test_a_trip_reported_before_the_first_tick_is_not_forgotten);
    RUN_TEST(test_a_saturated_result_blocks_the_first_permission);
    RUN_TEST(test_a_worse_fault_of_the_same_tick_is_the_one_that_stays);
    RUN_TEST(test_a_second_collision_raises_the_category_with_a_new_number);
    RUN_TEST(test_a_collision_that_goes_on_is_not_a_second_one);
    RUN_TEST(test_a_contact_that_grows_on_another_joint_is_a_second_one);
    RUN_TEST(test_silence_faults_and_the_board_raise_the_category_of_a_stop);
    RUN_TEST(test_readings_that_are_late_by_multiples_of_sixteen_cycles_are_late);
    RUN_TEST(test_time_and_cycles_must_agree_within_a_quarter);
    RUN_TEST(test_there_is_no_permission_before_time_and_cycles_have_agreed);
    RUN_TEST(test_a_silent_task_is_missed_by_cycles_when_the_clock_is_slow);
    RUN_TEST(test_a_clock_that_stands_is_a_fault);
    RUN_TEST(test_a_task_command_of_another_cycle_is_late);
    RUN_TEST(test_a_sender_with_many_bad_frames_is_a_stop);
    RUN_TEST(test_one_bad_frame_in_twenty_has_no_consequence);
    RUN_TEST(test_a_joint_that_loses_three_frames_in_four_is_a_stop);
    RUN_TEST(test_one_lost_frame_in_ten_has_no_consequence);
    RUN_TEST(test_a_reset_whose_counter_jumps_is_no_sender_with_losses);
    RUN_TEST(test_a_counter_twice_a_cycle_in_cycle_after_cycle_is_another_sender);
    RUN_TEST(test_a_single_repetition_is_no_other_sender);
    RUN_TEST(test_a_position_that_jumps_is_implausible);
    RUN_TEST(test_a_velocity_that_the_position_does_not_show_is_implausible);
    RUN_TEST(test_a_joint_that_moves_as_it_says_is_plausible);
    RUN_TEST(test_a_torque_at_the_end_of_its_range_is_out_of_range);
    RUN_TEST(test_a_torque_that_repeats_bit_for_bit_while_the_arm_moves_is_frozen);
    RUN_TEST(test_the_inverted_copy_comes_by_another_path);
    return UNITY_END();
}
