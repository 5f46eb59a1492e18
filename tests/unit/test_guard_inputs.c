/* The guard's reaction to each kind of bad frame: the counter that moves, and the effect on the permission. */
#include "guard_fixture.h"

static bench_t bench;

void setUp(void) {
    start(&bench);
    run_until_permitted(&bench);
}
void tearDown(void) {}

/* A cycle in which the frame of joint 3 (slot 2) is replaced by `frame`. */
static void cycle_with(can_frame_t frame) {
    receive(&bench, sync_frame(&bench));
    receive(&bench, task_frame(&bench));
    for (uint32_t i = 0; i < JOINTS; ++i) {
        receive(&bench, (i == 2u) ? frame : joint_frame(&bench, i));
    }
    tick(&bench);
}

static guard_counters_t counters(void) {
    return bench.guard.counters;
}

static void assert_only(guard_counters_t before, guard_counters_t expected_change) {
    const guard_counters_t after = counters();
    const uint16_t *const a = (const uint16_t *)&before;
    const uint16_t *const b = (const uint16_t *)&after;
    const uint16_t *const change = (const uint16_t *)&expected_change;
    for (size_t i = 0; i < sizeof(before) / sizeof(uint16_t); ++i) {
        TEST_ASSERT_EQUAL_UINT16(a[i] + change[i], b[i]);
    }
}

static void test_any_flipped_bit_of_a_frame_is_dropped_and_counted_once(void) {
    for (uint32_t bit = 0; bit < 64u; ++bit) {
        next_cycle(&bench);
        can_frame_t frame = joint_frame(&bench, 2u);
        frame.data[bit / 8u] ^= (uint8_t)(1u << (bit % 8u));
        const guard_counters_t before = counters();
        cycle_with(frame);
        assert_only(before, (guard_counters_t){.crc_errors = 1});
        TEST_ASSERT_TRUE(bench.out.permitted); /* one cycle is bridged */
        TEST_ASSERT_FALSE(bench.out.fresh);
        const guard_counters_t after = counters();
        cycle(&bench);
        assert_only(after, (guard_counters_t){.lost_frames = 1});
        TEST_ASSERT_TRUE(bench.out.permitted);
        cycles(&bench, 12u); /* rarely, because one bad frame in two would cause ErrorRate */
    }
}

static void test_a_joint_whose_frames_are_all_corrupt_ends_the_permission_at_its_deadline(void) {
    uint32_t taken = 0;
    while (bench.out.permitted && (taken < 100u)) {
        next_cycle(&bench);
        can_frame_t frame = joint_frame(&bench, 2u);
        frame.data[7] ^= 1u;
        cycle_with(frame);
        ++taken;
    }
    TEST_ASSERT_EQUAL(DEADLINE_CYCLES + 1u, taken);
    assert_stopped(&bench, GUARD_REASON_JOINT_TIMEOUT, 3u);
    TEST_ASSERT_EQUAL(DEADLINE_CYCLES + 1u, bench.guard.counters.crc_errors);
}

static void test_a_repeated_frame_is_dropped_and_counted(void) {
    next_cycle(&bench);
    const guard_counters_t before = counters();
    const can_frame_t frame = joint_frame(&bench, 2u);
    receive(&bench, sync_frame(&bench));
    receive(&bench, frame);
    receive(&bench, frame);
    assert_only(before, (guard_counters_t){.sequence_errors = 1});
}

static void test_a_repeated_sync_does_not_start_a_cycle_again(void) {
    next_cycle(&bench);
    const can_frame_t sync = sync_frame(&bench);
    receive(&bench, sync);
    for (uint32_t i = 0; i < JOINTS - 1u; ++i) {
        receive(&bench, joint_frame(&bench, i));
    }
    receive(&bench, sync);
    receive(&bench, joint_frame(&bench, JOINTS - 1u));
    TEST_ASSERT_TRUE(guard_cycle_complete(&bench.guard));
    TEST_ASSERT_EQUAL(1, bench.guard.counters.sequence_errors);
}

static void test_a_frame_of_the_previous_cycle_is_late_and_not_used(void) {
    next_cycle(&bench);
    const can_frame_t stale = joint_frame(&bench, 2u);
    cycle_with((can_frame_t){.id = 0x7FFu, .length = 8u}); /* joint 3 is silent in its own cycle */
    next_cycle(&bench);
    const guard_counters_t before = counters();
    cycle_with(stale);
    assert_only(before, (guard_counters_t){.late_frames = 1});
    TEST_ASSERT_FALSE(bench.out.fresh);
    cycle(&bench);
    TEST_ASSERT_TRUE(bench.out.fresh);
    TEST_ASSERT_TRUE(bench.out.permitted);
}

static void test_frames_that_overtake_each_other_are_refused(void) {
    next_cycle(&bench);
    const can_frame_t older = joint_frame(&bench, 2u);
    next_cycle(&bench);
    const can_frame_t newer = joint_frame(&bench, 2u);
    receive(&bench, sync_frame(&bench));
    receive(&bench, newer);
    const guard_counters_t before = counters();
    receive(&bench, older);
    assert_only(before, (guard_counters_t){.sequence_errors = 1});
}

static void test_a_lost_sync_loses_only_its_cycle(void) {
    next_cycle(&bench);
    receive(&bench, task_frame(&bench));
    const guard_counters_t before = counters();
    for (uint32_t i = 0; i < JOINTS; ++i) {
        receive(&bench, joint_frame(&bench, i));
    }
    assert_only(before, (guard_counters_t){.late_frames = JOINTS});
    tick(&bench);
    TEST_ASSERT_FALSE(bench.out.fresh);
    cycle(&bench);
    TEST_ASSERT_TRUE(bench.out.fresh);
    TEST_ASSERT_TRUE(bench.out.permitted);
}

static void test_a_wrong_length_is_refused(void) {
    for (uint8_t length = 0; length <= 64u; ++length) {
        if (length != 8u) {
            next_cycle(&bench);
            can_frame_t frame = joint_frame(&bench, 2u);
            frame.length = length;
            const guard_counters_t before = counters();
            receive(&bench, sync_frame(&bench));
            receive(&bench, frame);
            assert_only(before, (guard_counters_t){.format_errors = 1});
            cycle(&bench);
        }
    }
}

#define STOP_COMMAND 0x010u

static void test_an_unknown_id_is_refused_without_further_effect(void) {
    for (uint32_t id = 0; id < 0x900u; ++id) {
        if ((protocol_slot(id) == (uint32_t)PROTOCOL_RECEIVE_COUNT) && (id != STOP_COMMAND)) {
            const guard_counters_t before = counters();
            receive(&bench, (can_frame_t){.id = id, .length = 8u});
            assert_only(before, (guard_counters_t){.format_errors = 1});
        }
    }
    cycle(&bench);
    TEST_ASSERT_TRUE(bench.out.permitted);
}

static void test_a_stop_command_of_another_guard_ends_the_permission_at_once(void) {
    for (uint8_t length = 0; length <= 8u; length += 8u) {
        start(&bench);
        run_until_permitted(&bench);
        const guard_counters_t before = counters();
        receive(&bench, (can_frame_t){.id = STOP_COMMAND, .length = length});
        assert_only(before, (guard_counters_t){.format_errors = 1});
        cycle(&bench);
        assert_stopped(&bench, GUARD_REASON_ANOTHER_GUARD, 0u);
        TEST_ASSERT_EQUAL(bench.config.stop_input, bench.out.stop_category);
        cycles(&bench, 2u * SETTLING_CYCLES);
        assert_stopped(&bench, GUARD_REASON_ANOTHER_GUARD, 0u);
        ask_reset(&bench, bench.out.trip_number);
        TEST_ASSERT_TRUE(bench.out.permitted);
    }
}

static void test_two_guards_permit_nothing_from_the_start_and_no_reset_helps(void) {
    start(&bench);
    for (uint32_t i = 0; i < 100u; ++i) {
        cycle(&bench);
        TEST_ASSERT_FALSE(bench.out.permitted);
        receive(&bench, (can_frame_t){.id = STOP_COMMAND, .length = 8u});
        if ((i % 4u) == 3u) {
            ask_reset(&bench, bench.out.trip_number);
            TEST_ASSERT_FALSE(bench.out.permitted);
        }
    }
    assert_stopped(&bench, GUARD_REASON_ANOTHER_GUARD, 0u);
    TEST_ASSERT_EQUAL(1, bench.out.trip_number);
}

static void test_an_extended_id_is_not_the_one_of_a_stop_command(void) {
    receive(&bench, (can_frame_t){.id = STOP_COMMAND, .length = 8u, .flags = CAN_FRAME_EXTENDED});
    cycle(&bench);
    TEST_ASSERT_TRUE(bench.out.permitted);
}

static void test_a_joint_that_the_robot_does_not_have_is_refused(void) {
    next_cycle(&bench);
    const guard_counters_t before = counters();
    receive(&bench, joint_frame(&bench, 7u));
    assert_only(before, (guard_counters_t){.format_errors = 1});
}

static void test_another_frame_format_is_refused(void) {
    static const uint8_t wrong[] = {CAN_FRAME_FD, CAN_FRAME_FD | CAN_FRAME_BRS, CAN_FRAME_EXTENDED, CAN_FRAME_REMOTE};
    for (size_t i = 0; i < sizeof(wrong); ++i) {
        next_cycle(&bench);
        can_frame_t frame = joint_frame(&bench, 2u);
        frame.flags = wrong[i];
        const guard_counters_t before = counters();
        receive(&bench, sync_frame(&bench));
        receive(&bench, frame);
        assert_only(before, (guard_counters_t){.format_errors = 1});
        cycle(&bench);
    }
}

static void test_a_frame_sealed_for_another_message_is_refused(void) {
    next_cycle(&bench);
    can_frame_t frame = joint_frame(&bench, 3u);
    frame.id = protocol_receive[2].id;
    const guard_counters_t before = counters();
    cycle_with(frame);
    assert_only(before, (guard_counters_t){.crc_errors = 1});
}

/* --- good frames with bad values ---------------------------------------------------------------------------------- */

static void assert_range_trip(uint32_t joint) {
    const guard_counters_t before = counters();
    cycle(&bench);
    assert_stopped(&bench, GUARD_REASON_INPUT_RANGE, joint + 1u);
    assert_only(before, (guard_counters_t){.range_errors = 1, .trips = 1});
    start(&bench);
    run_until_permitted(&bench);
}

static void test_a_value_that_is_not_available_ends_the_permission_at_once(void) {
    bench.position[1] = INT16_MIN;
    assert_range_trip(1u);
    bench.velocity[6] = INT16_MIN;
    assert_range_trip(6u);
    bench.torque[0] = INT16_MIN;
    assert_range_trip(0u);
}

static void test_not_available_is_refused_where_the_robot_would_allow_the_value(void) {
    guard_config_t config = make_config();
    for (uint32_t i = 0; i < JOINTS; ++i) {
        config.robot.joint[i].torque_max_nm = NUM(400);
    }
    seal_config(&config);
    start_with(&bench, &config);
    run_until_permitted(&bench);
    bench.torque[0] = INT16_MIN;
    cycle(&bench);
    assert_stopped(&bench, GUARD_REASON_INPUT_RANGE, 1u);
}

static void test_the_first_of_two_faults_in_one_tick_is_reported(void) {
    bench.sensor_status[2] = 1u;
    bench.torque[4] = INT16_MIN;
    cycle(&bench);
    assert_stopped(&bench, GUARD_REASON_SENSOR_STATUS, 3u);
}

static void test_a_value_beyond_the_robots_limits_ends_the_permission_at_once(void) {
    bench.position[3] = 32000; /* 4 rad */
    assert_range_trip(3u);
    bench.velocity[4] = -32000; /* 8 rad/s */
    assert_range_trip(4u);
    bench.torque[5] = 32000; /* 320 Nm */
    assert_range_trip(5u);
}

static void test_any_sensor_status_except_ok_ends_the_permission_at_once(void) {
    for (uint8_t status = 1; status < 4u; ++status) {
        bench.sensor_status[6] = status;
        cycle(&bench);
        assert_stopped(&bench, GUARD_REASON_SENSOR_STATUS, 7u);
        start(&bench);
        run_until_permitted(&bench);
    }
}

static void test_every_task_number_except_the_configured_ones_is_invalid(void) {
    for (uint8_t task = 0; task < 16u; ++task) {
        bench.task = task;
        cycle(&bench);
        if ((task >= TASK_NONE) && (task <= TASK_CONTACT)) {
            TEST_ASSERT_TRUE(bench.out.permitted);
        } else {
            assert_stopped(&bench, GUARD_REASON_TASK_INVALID, 0u);
            start(&bench);
            run_until_permitted(&bench);
        }
    }
}

static void test_an_acceleration_that_is_not_available_ends_the_permission_at_once(void) {
    for (uint32_t axis = 0; axis < 3u; ++axis) {
        next_cycle(&bench);
        uint8_t data[8] = {0};
        put16(data + 2u + (2u * axis), INT16_MIN);
        receive(&bench, sync_frame(&bench));
        receive(&bench, sealed(PROTOCOL_RECEIVE_TASK_COMMAND, data, TASK_PAYLOAD, (uint8_t)(bench.cycle & 0x0Fu)));
        tick(&bench);
        assert_stopped(&bench, GUARD_REASON_INPUT_RANGE, 0u);
        start(&bench);
        run_until_permitted(&bench);
    }
}

static void test_a_sync_whose_cycle_does_not_match_its_counter_is_refused(void) {
    next_cycle(&bench);
    uint8_t data[8] = {0};
    put16(data + 2, bench.cycle + 1);
    receive(&bench, sealed(PROTOCOL_RECEIVE_SYNC, data, 0u, (uint8_t)(bench.cycle & 0x0Fu)));
    tick(&bench);
    assert_stopped(&bench, GUARD_REASON_INPUT_RANGE, 0u);
}

static void test_a_refused_frame_never_moves_a_reading(void) {
    bench.torque[2] = (int16_t)(bench.torque[2] + 3000);
    for (uint32_t i = 0; i < 3u; ++i) {
        next_cycle(&bench);
        can_frame_t frame = joint_frame(&bench, 2u);
        frame.data[0] ^= 0x80u;
        const num_t before = bench.guard.observer.residual[2];
        cycle_with(frame);
        TEST_ASSERT_TRUE(before == bench.guard.observer.residual[2]);
        TEST_ASSERT_TRUE(bench.out.permitted);
    }
}

static void test_counters_stop_at_their_maximum(void) {
    for (uint32_t i = 0; i < 70000u; ++i) {
        receive(&bench, (can_frame_t){.id = 0x7FFu, .length = 8u});
    }
    TEST_ASSERT_EQUAL(UINT16_MAX, bench.guard.counters.format_errors);
}

static void test_fd_frames_are_received_and_sent_when_configured(void) {
    cycle(&bench);
    TEST_ASSERT_EQUAL(0, bench.out.frame[0].flags); /* classic */
    guard_config_t config = make_config();
    config.format = FORMAT_FD;
    seal_config(&config);
    start_with(&bench, &config);
    run_until_permitted(&bench);
    cycle(&bench);
    TEST_ASSERT_TRUE(bench.out.permitted);
    TEST_ASSERT_EQUAL(CAN_FRAME_FD | CAN_FRAME_BRS, bench.out.frame[0].flags);
    for (uint32_t i = 0; i <= DEADLINE_CYCLES; ++i) { /* classic frames now */
        next_cycle(&bench);
        const can_frame_t frame = sync_frame(&bench);
        guard_receive(&bench.guard, &frame, bench.now_us);
        tick(&bench);
    }
    assert_stopped(&bench, GUARD_REASON_SYNC_TIMEOUT, 0u);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_any_flipped_bit_of_a_frame_is_dropped_and_counted_once);
    RUN_TEST(test_a_joint_whose_frames_are_all_corrupt_ends_the_permission_at_its_deadline);
    RUN_TEST(test_a_repeated_frame_is_dropped_and_counted);
    RUN_TEST(test_a_repeated_sync_does_not_start_a_cycle_again);
    RUN_TEST(test_a_frame_of_the_previous_cycle_is_late_and_not_used);
    RUN_TEST(test_frames_that_overtake_each_other_are_refused);
    RUN_TEST(test_a_lost_sync_loses_only_its_cycle);
    RUN_TEST(test_a_wrong_length_is_refused);
    RUN_TEST(test_an_unknown_id_is_refused_without_further_effect);
    RUN_TEST(test_a_stop_command_of_another_guard_ends_the_permission_at_once);
    RUN_TEST(test_two_guards_permit_nothing_from_the_start_and_no_reset_helps);
    RUN_TEST(test_an_extended_id_is_not_the_one_of_a_stop_command);
    RUN_TEST(test_a_joint_that_the_robot_does_not_have_is_refused);
    RUN_TEST(test_another_frame_format_is_refused);
    RUN_TEST(test_a_frame_sealed_for_another_message_is_refused);
    RUN_TEST(test_a_value_that_is_not_available_ends_the_permission_at_once);
    RUN_TEST(test_a_value_beyond_the_robots_limits_ends_the_permission_at_once);
    RUN_TEST(test_not_available_is_refused_where_the_robot_would_allow_the_value);
    RUN_TEST(test_the_first_of_two_faults_in_one_tick_is_reported);
    RUN_TEST(test_any_sensor_status_except_ok_ends_the_permission_at_once);
    RUN_TEST(test_every_task_number_except_the_configured_ones_is_invalid);
    RUN_TEST(test_an_acceleration_that_is_not_available_ends_the_permission_at_once);
    RUN_TEST(test_a_sync_whose_cycle_does_not_match_its_counter_is_refused);
    RUN_TEST(test_a_refused_frame_never_moves_a_reading);
    RUN_TEST(test_counters_stop_at_their_maximum);
    RUN_TEST(test_fd_frames_are_received_and_sent_when_configured);
    return UNITY_END();
}
