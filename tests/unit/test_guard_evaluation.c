/* A permission depends on what was evaluated: cycle numbers, snapshots, time. */
#include "guard_fixture.h"

static bench_t bench;

void setUp(void) {
    start(&bench);
}
void tearDown(void) {}

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

static void test_cycle_numbers_that_keep_jumping_never_permit(void) {
    for (uint32_t i = 0; i < 600u; ++i) {
        jump(17u);
        receive(&bench, reset_frame(&bench, bench.out.trip_number, (i % 2u) != 0u));
        TEST_ASSERT_FALSE(bench.out.permitted);
    }
    TEST_ASSERT_TRUE(bench.guard.counters.sequence_errors > 500u);
}

static void test_a_restarted_observer_needs_its_settling_time(void) {
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

static void test_snapshots_without_an_evaluation_do_not_keep_the_permission(void) {
    run_until_permitted(&bench);
    uint32_t taken = 0;
    while (bench.out.permitted && (taken < 100u)) {
        next_cycle(&bench);
        receive(&bench, sync_frame(&bench));
        receive(&bench, task_frame(&bench));
        for (uint32_t i = 0; i < JOINTS; ++i) {
            receive(&bench, joint_frame(&bench, i));
        }
        bench.guard.inputs.snapshot.taken = true; /* a fault: the complete snapshot is never evaluated */
        bench.guard.inputs.snapshot.taken_cycle = bench.cycle;
        tick(&bench);
        ++taken;
    }
    TEST_ASSERT_TRUE(taken <= DEADLINE_CYCLES + 1u);
    assert_stopped(&bench, GUARD_REASON_JOINT_TIMEOUT, 0u);
}

static void test_a_contact_from_power_on_never_gets_a_permission(void) {
    push(&bench, 2u, 4000); /* 40 Nm, from the first sample */
    for (uint32_t i = 0; i < 1000u; ++i) {
        cycle(&bench);
        receive(&bench, reset_frame(&bench, bench.out.trip_number, (i % 2u) != 0u));
        TEST_ASSERT_FALSE(bench.out.permitted);
    }
}

static void test_readings_late_by_multiples_of_sixteen_cycles_count_as_late(void) {
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
    for (uint32_t i = 0; i < 20u; ++i) { /* all other conditions have been met for a long time */
        bench.guard.settled_cycles = UINT16_MAX;
        cycle(&bench);
        TEST_ASSERT_FALSE(bench.guard.healthy);
    }
    cycles(&bench, 300u);
    ask_reset(&bench, number);
    TEST_ASSERT_TRUE(bench.out.permitted);
}

static void test_a_silent_task_is_detected_by_cycles_when_the_clock_is_slow(void) {
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

static void test_a_stopped_clock_is_a_fault(void) {
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
        const can_frame_t stale = task_frame(&bench); /* of the previous cycle */
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

/* --- two copies of the permission --------------------------------------------------------------------------------- */

static void test_the_inverted_copy_is_computed_on_another_path(void) {
    run_until_permitted(&bench);
    bench.guard.acknowledged = (uint8_t)GUARD_CLEAR; /* a fault that the state does not show */
    cycle(&bench);
    TEST_ASSERT_TRUE(bench.out.permitted);
    TEST_ASSERT_TRUE(bench.out.withheld);
    TEST_ASSERT_EQUAL_HEX8(0xF1, bench.out.frame[0].data[2]); /* Move and Stop: a pair that does not permit */
}

/* The limit itself is a good reading of position and velocity. */
static void test_a_reading_at_the_robots_limit_is_good(void) {
    static const int32_t raw = 5000;
    for (uint32_t i = 0; i < 3u; ++i) {
        guard_config_t config = make_config();
        robot_joint_t *const limits = &config.robot.joint[2];
        limits->position_min_rad = (i == 0u) ? scale_to_num(raw, PROTOCOL_JOINT_STATE_POSITION_SCALE) : NUM(-2);
        limits->position_max_rad = (i == 1u) ? scale_to_num(raw, PROTOCOL_JOINT_STATE_POSITION_SCALE) : NUM(2);
        limits->velocity_max_rad_s = (i == 2u) ? scale_to_num(raw, PROTOCOL_JOINT_STATE_VELOCITY_SCALE) : NUM(4);
        seal_config(&config);
        start_with(&bench, &config);
        bench.position[2] = (int16_t)raw;
        bench.velocity[2] = (i == 2u) ? (int16_t)-raw : 0;
        cycles(&bench, 3u);
        TEST_ASSERT_EQUAL(0, bench.guard.counters.range_errors);
        bench.position[2] = (int16_t)(raw + ((i == 0u) ? -1 : 1));
        bench.velocity[2] = (i == 2u) ? (int16_t)(-raw - 1) : 0;
        cycle(&bench);
        TEST_ASSERT_EQUAL(1, bench.guard.counters.range_errors);
    }
}

/* A Sync that was refused moves the counter of its receiver, but not the cycle. */
static void test_a_sync_may_be_four_cycles_after_the_last_good_one(void) {
    for (uint32_t advance = 4u; advance <= 5u; ++advance) {
        setUp();
        run_until_permitted(&bench);
        uint8_t refused[8] = {0};
        put16(refused + 2, bench.cycle + 3);
        receive(&bench, sealed(PROTOCOL_RECEIVE_SYNC, refused, 0u, (uint8_t)((bench.cycle + 2u) & 0x0Fu)));
        bench.cycle = (uint16_t)(bench.cycle + advance);
        bench.now_us += advance * PERIOD_US;
        receive(&bench, sync_frame(&bench));
        TEST_ASSERT_EQUAL(bench.cycle, bench.guard.inputs.snapshot.cycle);
        TEST_ASSERT_EQUAL(advance == 4u, bench.guard.inputs.clocks_agree);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_cycle_number_that_jumps_ends_the_permission_at_once);
    RUN_TEST(test_cycle_numbers_that_keep_jumping_never_permit);
    RUN_TEST(test_a_restarted_observer_needs_its_settling_time);
    RUN_TEST(test_snapshots_without_an_evaluation_do_not_keep_the_permission);
    RUN_TEST(test_a_contact_from_power_on_never_gets_a_permission);
    RUN_TEST(test_readings_late_by_multiples_of_sixteen_cycles_count_as_late);
    RUN_TEST(test_time_and_cycles_must_agree_within_a_quarter);
    RUN_TEST(test_there_is_no_permission_before_time_and_cycles_have_agreed);
    RUN_TEST(test_a_silent_task_is_detected_by_cycles_when_the_clock_is_slow);
    RUN_TEST(test_a_stopped_clock_is_a_fault);
    RUN_TEST(test_a_task_command_of_another_cycle_is_late);
    RUN_TEST(test_the_inverted_copy_is_computed_on_another_path);
    RUN_TEST(test_a_reading_at_the_robots_limit_is_good);
    RUN_TEST(test_a_sync_may_be_four_cycles_after_the_last_good_one);
    return UNITY_END();
}
