/* The counters of bad, late, lost and repeated frames of a sender, frame by frame. */
#include "permitted_fixture.h"

#define JOINT 3u /* joint 4 */
#define LIMIT 64u

static void begin_cycle(void) {
    next_cycle(&bench);
    receive(&bench, sync_frame(&bench));
}

static void assert_error_rate(void) {
    TEST_ASSERT_EQUAL(GUARD_REASON_ERROR_RATE, guard->inputs.fault);
    TEST_ASSERT_EQUAL(JOINT + 1u, guard->inputs.fault_joint);
}

static void test_each_good_frame_takes_one_error_away(void) {
    static const uint8_t left[] = {2u, 1u, 0u, 0u};
    guard->inputs.errors[JOINT] = 3u;
    for (size_t i = 0; i < sizeof(left); ++i) {
        cycle(&bench);
        TEST_ASSERT_EQUAL(left[i], guard->inputs.errors[JOINT]);
    }
}

static void test_the_first_frame_of_a_sender_is_no_error(void) {
    start(&bench);
    cycle(&bench);
    receive(&bench, reset_frame(&bench, 0u, false));
    for (uint32_t slot = 0; slot < (uint32_t)PROTOCOL_RECEIVE_COUNT; ++slot) {
        TEST_ASSERT_EQUAL(0, guard->inputs.errors[slot]);
    }
}

/* Each adds 4 and is a frame of the sender, which takes one error away. */
static void test_late_frames_reach_the_limit_with_the_twenty_first(void) {
    for (uint32_t i = 0; i < 21u; ++i) {
        TEST_ASSERT_EQUAL(0, guard->inputs.fault);
        begin_cycle();
        bench.cycle = (uint16_t)(bench.cycle - 16u); /* the same counter */
        const can_frame_t late = joint_frame(&bench, JOINT);
        bench.cycle = (uint16_t)(bench.cycle + 16u);
        receive(&bench, late);
        TEST_ASSERT_EQUAL(i + 1u, guard->counters.late_frames);
    }
    assert_error_rate();
}

static void test_every_second_frame_lost_reaches_the_limit_with_the_twenty_first(void) {
    for (uint32_t i = 0; i < 21u; ++i) {
        TEST_ASSERT_EQUAL(0, guard->inputs.fault);
        begin_cycle();
        begin_cycle();
        receive(&bench, joint_frame(&bench, JOINT));
        TEST_ASSERT_EQUAL(i + 1u, guard->counters.lost_frames);
    }
    assert_error_rate();
}

static void test_errors_stay_at_their_limit(void) {
    for (uint32_t i = 0; i < 40u; ++i) {
        can_frame_t wrong = joint_frame(&bench, JOINT);
        wrong.length = 7u;
        guard->inputs.fault = 0;
        receive(&bench, wrong);
        TEST_ASSERT_EQUAL((i < 8u) ? (8u * (i + 1u)) : LIMIT, guard->inputs.errors[JOINT]);
    }
    assert_error_rate();
}

/* However long two senders continue, each of their frames is a fault. */
static void test_another_sender_stays_one(void) {
    for (uint32_t i = 0; i < 300u; ++i) {
        begin_cycle();
        guard->inputs.fault = 0;
        receive(&bench, joint_frame(&bench, JOINT));
        receive(&bench, joint_frame(&bench, JOINT));
        TEST_ASSERT_EQUAL((i < 2u) ? 0u : (uint32_t)GUARD_REASON_ANOTHER_SENDER, guard->inputs.fault);
    }
}

/* Boards tick at once when a cycle is complete. */
static void test_a_cycle_is_complete_with_its_last_joint_and_until_its_tick(void) {
    TEST_ASSERT_FALSE(guard_cycle_complete(guard));
    begin_cycle();
    for (uint32_t i = 0; i < JOINTS; ++i) {
        TEST_ASSERT_FALSE(guard_cycle_complete(guard));
        receive(&bench, joint_frame(&bench, i));
    }
    TEST_ASSERT_TRUE(guard_cycle_complete(guard));
    tick(&bench);
    TEST_ASSERT_FALSE(guard_cycle_complete(guard));
    guard_refuse(guard);
    begin_cycle();
    TEST_ASSERT_FALSE(guard_cycle_complete(guard));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_each_good_frame_takes_one_error_away);
    RUN_TEST(test_the_first_frame_of_a_sender_is_no_error);
    RUN_TEST(test_late_frames_reach_the_limit_with_the_twenty_first);
    RUN_TEST(test_every_second_frame_lost_reaches_the_limit_with_the_twenty_first);
    RUN_TEST(test_errors_stay_at_their_limit);
    RUN_TEST(test_another_sender_stays_one);
    RUN_TEST(test_a_cycle_is_complete_with_its_last_joint_and_until_its_tick);
    return UNITY_END();
}
