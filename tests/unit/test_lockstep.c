/* Guard time as bus time: firmware/schedule/lockstep.h. */
#include "lockstep.h"
#include "messages.h"
#include "protocol.h"
#include "unity.h"

#define PERIOD_US 1000u

static lockstep_t lockstep;

void setUp(void) {
    lockstep = (lockstep_t){.period_us = PERIOD_US};
}
void tearDown(void) {}

static can_frame_t sync(uint16_t cycle) {
    const protocol_receive_t *const entry = &protocol_receive[PROTOCOL_RECEIVE_SYNC];
    can_frame_t frame = {.id = entry->id, .length = entry->length};
    frame.data[2] = (uint8_t)(cycle & 0xFFu);
    frame.data[3] = (uint8_t)(cycle >> 8u);
    e2e_seal(frame.data, frame.length, entry->data_ids, (uint8_t)(cycle & E2E_COUNTER_MASK));
    return frame;
}

/* Ticks that the frame causes. */
static uint32_t deliver(can_frame_t frame) {
    uint32_t ticks = 0;
    lockstep_hear(&lockstep, &frame);
    while (lockstep_owes_tick(&lockstep)) {
        ticks++;
    }
    return ticks;
}

static uint32_t deliver_sync(uint16_t cycle) {
    return deliver(sync(cycle));
}

static void deliver_joint(void) {
    (void)deliver((can_frame_t){.id = 0x101u, .length = 8u});
}

static void test_nothing_is_due_before_the_first_sync(void) {
    deliver_joint();
    TEST_ASSERT_FALSE(lockstep_complete(&lockstep));
    TEST_ASSERT_FALSE(lockstep_silence(&lockstep));
}

static void test_every_sync_is_a_period_later_and_every_cycle_has_one_tick(void) {
    for (uint16_t cycle = 0; cycle < 100u; cycle++) {
        TEST_ASSERT_EQUAL_UINT32(0u, deliver_sync(cycle));
        TEST_ASSERT_EQUAL_UINT64((uint64_t)cycle * PERIOD_US, lockstep.now_us);
        TEST_ASSERT_TRUE(lockstep_complete(&lockstep));
        TEST_ASSERT_FALSE(lockstep_complete(&lockstep));
    }
}

static void test_time_continues_when_the_cycle_number_wraps(void) {
    (void)deliver_sync(65535u);
    (void)deliver_sync(0u);
    TEST_ASSERT_EQUAL_UINT64(65536u * (uint64_t)PERIOD_US, lockstep.now_us);
}

static void test_a_cycle_that_was_not_completed_has_its_tick_before_the_next_sync(void) {
    (void)deliver_sync(0u);
    TEST_ASSERT_EQUAL_UINT32(1u, deliver_sync(1u));
}

static void test_cycles_without_sync_have_their_ticks_at_their_times(void) {
    (void)deliver_sync(10u);
    (void)lockstep_complete(&lockstep);
    const can_frame_t frame = sync(13u);
    lockstep_hear(&lockstep, &frame);
    TEST_ASSERT_TRUE(lockstep_owes_tick(&lockstep));
    TEST_ASSERT_EQUAL_UINT64(11u * (uint64_t)PERIOD_US, lockstep.now_us);
    TEST_ASSERT_TRUE(lockstep_owes_tick(&lockstep));
    TEST_ASSERT_EQUAL_UINT64(12u * (uint64_t)PERIOD_US, lockstep.now_us);
    TEST_ASSERT_FALSE(lockstep_owes_tick(&lockstep));
    TEST_ASSERT_EQUAL_UINT64(13u * (uint64_t)PERIOD_US, lockstep.now_us);
}

static void test_a_jump_is_limited_to_more_than_any_deadline(void) {
    (void)deliver_sync(0u);
    TEST_ASSERT_EQUAL_UINT32(LOCKSTEP_MAX_STEP, deliver_sync(5000u));
    TEST_ASSERT_EQUAL_UINT64(LOCKSTEP_MAX_STEP * (uint64_t)PERIOD_US, lockstep.now_us);
}

static void test_a_repeated_or_older_sync_moves_nothing(void) {
    (void)deliver_sync(20u);
    (void)lockstep_complete(&lockstep);
    TEST_ASSERT_EQUAL_UINT32(0u, deliver_sync(20u));
    TEST_ASSERT_EQUAL_UINT32(0u, deliver_sync(19u));
    TEST_ASSERT_EQUAL_UINT64(20u * (uint64_t)PERIOD_US, lockstep.now_us);
    (void)deliver_sync(21u);
    TEST_ASSERT_EQUAL_UINT64(21u * (uint64_t)PERIOD_US, lockstep.now_us);
}

static void test_a_restarted_robot_is_followed(void) {
    (void)deliver_sync(200u);
    (void)lockstep_complete(&lockstep);
    (void)deliver_sync(0u);
    TEST_ASSERT_EQUAL_UINT64(200u * (uint64_t)PERIOD_US, lockstep.now_us);
    for (uint16_t cycle = 1; cycle < 5u; cycle++) {
        (void)deliver_sync(cycle);
        TEST_ASSERT_EQUAL_UINT64((200u + (uint64_t)cycle) * PERIOD_US, lockstep.now_us);
    }
}

static void test_a_corrupted_sync_moves_nothing(void) {
    (void)deliver_sync(0u);
    can_frame_t frame = sync(1u);
    frame.data[2] ^= 4u;
    TEST_ASSERT_EQUAL_UINT32(0u, deliver(frame));
    TEST_ASSERT_EQUAL_UINT64(0u, lockstep.now_us);
}

static void test_silence_ends_a_cycle_once(void) {
    (void)deliver_sync(7u);
    deliver_joint();
    TEST_ASSERT_TRUE(lockstep_silence(&lockstep));
    TEST_ASSERT_FALSE(lockstep_silence(&lockstep));
    TEST_ASSERT_EQUAL_UINT32(0u, deliver_sync(8u));
    TEST_ASSERT_EQUAL_UINT64(8u * (uint64_t)PERIOD_US, lockstep.now_us);
}

static void test_readings_without_sync_count_as_a_cycle(void) {
    (void)deliver_sync(7u);
    (void)lockstep_complete(&lockstep);
    deliver_joint();
    TEST_ASSERT_TRUE(lockstep_silence(&lockstep));
    TEST_ASSERT_EQUAL_UINT64(8u * (uint64_t)PERIOD_US, lockstep.now_us);
    TEST_ASSERT_EQUAL_UINT32(0u, deliver_sync(9u));
    TEST_ASSERT_EQUAL_UINT64(9u * (uint64_t)PERIOD_US, lockstep.now_us);
}

static void test_a_cycle_counted_as_lost_may_still_begin(void) {
    (void)deliver_sync(7u);
    (void)lockstep_complete(&lockstep);
    deliver_joint();
    (void)lockstep_silence(&lockstep);
    TEST_ASSERT_EQUAL_UINT32(0u, deliver_sync(8u));
    TEST_ASSERT_EQUAL_UINT64(8u * (uint64_t)PERIOD_US, lockstep.now_us);
    TEST_ASSERT_TRUE(lockstep_complete(&lockstep));
}

static void test_a_pause_after_the_answer_is_not_a_cycle(void) {
    (void)deliver_sync(7u);
    (void)lockstep_complete(&lockstep);
    (void)deliver((can_frame_t){.id = 0x030u, .length = 4u}); /* a reset request between two cycles */
    TEST_ASSERT_FALSE(lockstep_silence(&lockstep));
    TEST_ASSERT_EQUAL_UINT64(7u * (uint64_t)PERIOD_US, lockstep.now_us);
}

static void test_only_a_data_frame_of_the_id_and_length_of_sync_is_one(void) {
    (void)deliver_sync(5u);
    (void)lockstep_complete(&lockstep);
    const uint8_t flags[] = {CAN_FRAME_EXTENDED, CAN_FRAME_REMOTE};
    for (uint32_t i = 0; i < 2u; ++i) {
        can_frame_t frame = sync(6u);
        frame.flags = flags[i];
        TEST_ASSERT_EQUAL_UINT32(0u, deliver(frame));
    }
    (void)deliver((can_frame_t){.id = 0x7FFu, .length = 8u});
    can_frame_t frame = sync(6u);
    frame.id ^= 1u;
    (void)deliver(frame);
    frame = sync(6u);
    ++frame.length;
    e2e_seal(frame.data, frame.length, protocol_receive[PROTOCOL_RECEIVE_SYNC].data_ids, 6u);
    (void)deliver(frame);
    TEST_ASSERT_EQUAL_UINT64(5u * (uint64_t)PERIOD_US, lockstep.now_us);
}

static void test_half_of_all_cycles_ahead_counts_as_behind(void) {
    (void)deliver_sync(0u);
    (void)deliver_sync(0x8000u);
    TEST_ASSERT_EQUAL_UINT64(0u, lockstep.now_us);
    (void)deliver_sync(0x7FFFu);
    TEST_ASSERT_EQUAL_UINT64(LOCKSTEP_MAX_STEP * (uint64_t)PERIOD_US, lockstep.now_us);
}

static void test_older_syncs_that_do_not_follow_each_other_move_nothing(void) {
    (void)deliver_sync(200u);
    (void)deliver_sync(1u); /* the first older one, without a predecessor */
    (void)deliver_sync(5u);
    (void)deliver_sync(3u);
    TEST_ASSERT_EQUAL_UINT64(200u * (uint64_t)PERIOD_US, lockstep.now_us);
    (void)deliver_sync(4u);
    TEST_ASSERT_EQUAL_UINT64(201u * (uint64_t)PERIOD_US, lockstep.now_us);
}

static void test_a_repeated_sync_gives_its_cycle_no_second_tick(void) {
    (void)deliver_sync(20u);
    TEST_ASSERT_TRUE(lockstep_complete(&lockstep));
    (void)deliver_sync(20u);
    TEST_ASSERT_FALSE(lockstep_complete(&lockstep));
}

static void assume_cycle_8(void) {
    (void)deliver_sync(7u);
    (void)lockstep_complete(&lockstep);
    deliver_joint();
    TEST_ASSERT_TRUE(lockstep_silence(&lockstep));
}

static void test_a_cycle_counted_as_lost_begins_once(void) {
    assume_cycle_8();
    (void)deliver_sync(8u);
    TEST_ASSERT_TRUE(lockstep_complete(&lockstep));
    (void)deliver_sync(8u);
    TEST_ASSERT_FALSE(lockstep_complete(&lockstep));
}

static void test_an_older_sync_does_not_prevent_the_begin_of_an_assumed_cycle(void) {
    assume_cycle_8();
    (void)deliver_sync(5u);
    (void)deliver_sync(8u);
    TEST_ASSERT_TRUE(lockstep_complete(&lockstep));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_nothing_is_due_before_the_first_sync);
    RUN_TEST(test_every_sync_is_a_period_later_and_every_cycle_has_one_tick);
    RUN_TEST(test_time_continues_when_the_cycle_number_wraps);
    RUN_TEST(test_a_cycle_that_was_not_completed_has_its_tick_before_the_next_sync);
    RUN_TEST(test_cycles_without_sync_have_their_ticks_at_their_times);
    RUN_TEST(test_a_jump_is_limited_to_more_than_any_deadline);
    RUN_TEST(test_a_repeated_or_older_sync_moves_nothing);
    RUN_TEST(test_a_restarted_robot_is_followed);
    RUN_TEST(test_a_corrupted_sync_moves_nothing);
    RUN_TEST(test_silence_ends_a_cycle_once);
    RUN_TEST(test_readings_without_sync_count_as_a_cycle);
    RUN_TEST(test_a_cycle_counted_as_lost_may_still_begin);
    RUN_TEST(test_a_pause_after_the_answer_is_not_a_cycle);
    RUN_TEST(test_only_a_data_frame_of_the_id_and_length_of_sync_is_one);
    RUN_TEST(test_half_of_all_cycles_ahead_counts_as_behind);
    RUN_TEST(test_older_syncs_that_do_not_follow_each_other_move_nothing);
    RUN_TEST(test_a_repeated_sync_gives_its_cycle_no_second_tick);
    RUN_TEST(test_a_cycle_counted_as_lost_begins_once);
    RUN_TEST(test_an_older_sync_does_not_prevent_the_begin_of_an_assumed_cycle);
    return UNITY_END();
}
