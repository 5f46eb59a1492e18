/* The guard's checks of senders and readings: error rates, a second sender, implausible values. */
#include "guard_fixture.h"

static bench_t bench;

void setUp(void) {
    start(&bench);
}
void tearDown(void) {}

/* --- senders ------------------------------------------------------------------------------------------------------ */

static void test_a_sender_with_many_bad_frames_causes_a_stop(void) {
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

static void test_one_bad_frame_in_nine_has_no_consequence(void) {
    run_until_permitted(&bench);
    for (uint32_t i = 0; i < 2000u; ++i) {
        if ((i % 8u) == 0u) {
            can_frame_t bad = joint_frame(&bench, 3u);
            bad.data[5] ^= 0x10u;
            receive(&bench, bad);
        }
        cycle(&bench);
        TEST_ASSERT_TRUE(bench.out.permitted);
    }
}

/* Each gap is short enough to be bridged, but the gaps do not end. */
static void test_a_joint_that_loses_three_frames_in_four_causes_a_stop(void) {
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
static void test_a_counter_jump_of_guard_reset_does_not_count_as_losses(void) {
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

static void test_a_counter_received_twice_in_every_cycle_means_another_sender(void) {
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

static void test_a_single_repetition_does_not_mean_another_sender(void) {
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

static void test_a_velocity_without_a_change_of_position_is_implausible(void) {
    run_until_permitted(&bench);
    bench.velocity[6] = 1200; /* 0.3 rad/s, but the position stays */
    cycles(&bench, 40u);
    assert_stopped(&bench, GUARD_REASON_IMPLAUSIBLE, 7u);
}

static void test_a_joint_whose_position_follows_its_velocity_is_plausible(void) {
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

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_sender_with_many_bad_frames_causes_a_stop);
    RUN_TEST(test_one_bad_frame_in_nine_has_no_consequence);
    RUN_TEST(test_a_joint_that_loses_three_frames_in_four_causes_a_stop);
    RUN_TEST(test_one_lost_frame_in_ten_has_no_consequence);
    RUN_TEST(test_a_counter_jump_of_guard_reset_does_not_count_as_losses);
    RUN_TEST(test_a_counter_received_twice_in_every_cycle_means_another_sender);
    RUN_TEST(test_a_single_repetition_does_not_mean_another_sender);
    RUN_TEST(test_a_position_that_jumps_is_implausible);
    RUN_TEST(test_a_velocity_without_a_change_of_position_is_implausible);
    RUN_TEST(test_a_joint_whose_position_follows_its_velocity_is_plausible);
    RUN_TEST(test_a_torque_at_the_end_of_its_range_is_out_of_range);
    RUN_TEST(test_a_torque_that_repeats_bit_for_bit_while_the_arm_moves_is_frozen);
    return UNITY_END();
}
