/* The times of ticks, in real time and in lockstep: firmware/schedule/schedule.h. Bus time: test_lockstep.c. */
#include "schedule.h"

#include "messages.h"
#include "protocol.h"
#include "unity.h"

#define PERIOD_US 1000u
#define BEGIN_US  5000000u

static guard_config_t config;
static schedule_t schedule;

void setUp(void) {
    config = (guard_config_t){.period_us = PERIOD_US, .tick_deadline_us = 5u * PERIOD_US};
    schedule_init(&schedule, &config, false, BEGIN_US);
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

static void test_the_first_tick_is_due_at_once(void) {
    TEST_ASSERT_TRUE(schedule_is_due(&schedule, BEGIN_US));
}

static void test_without_a_cycle_a_tick_is_due_after_a_period(void) {
    schedule_ticked(&schedule, BEGIN_US, false);
    TEST_ASSERT_FALSE(schedule_is_due(&schedule, BEGIN_US + PERIOD_US - 1u));
    TEST_ASSERT_TRUE(schedule_is_due(&schedule, BEGIN_US + PERIOD_US));
}

static void test_a_cycle_after_a_fresh_tick_may_be_late_by_half_a_period_at_most(void) {
    schedule_ticked(&schedule, BEGIN_US, true);
    TEST_ASSERT_FALSE(schedule_is_due(&schedule, BEGIN_US + PERIOD_US + PERIOD_US / 2u - 1u));
    TEST_ASSERT_TRUE(schedule_is_due(&schedule, BEGIN_US + PERIOD_US + PERIOD_US / 2u));
}

static void test_a_tight_tick_deadline_leaves_half_of_the_remaining_time(void) {
    config.tick_deadline_us = PERIOD_US + 100u;
    schedule_init(&schedule, &config, false, BEGIN_US);
    schedule_ticked(&schedule, BEGIN_US, true);
    TEST_ASSERT_TRUE(schedule_is_due(&schedule, BEGIN_US + PERIOD_US + 50u));
}

static void test_a_deadline_shorter_than_the_period_leaves_no_time(void) {
    config.tick_deadline_us = 1u;
    schedule_init(&schedule, &config, false, BEGIN_US);
    schedule_ticked(&schedule, BEGIN_US, true);
    TEST_ASSERT_TRUE(schedule_is_due(&schedule, BEGIN_US + PERIOD_US));
}

static void test_a_complete_cycle_has_one_tick_even_without_an_evaluation(void) {
    TEST_ASSERT_FALSE(schedule_complete(&schedule, false));
    TEST_ASSERT_TRUE(schedule_complete(&schedule, true));
    TEST_ASSERT_FALSE(schedule_complete(&schedule, true));
    TEST_ASSERT_FALSE(schedule_complete(&schedule, false));
    TEST_ASSERT_TRUE(schedule_complete(&schedule, true));
}

static void test_in_real_time_guard_time_is_the_callers(void) {
    const can_frame_t frame = sync(7u);
    schedule_hear(&schedule, &frame, BEGIN_US);
    TEST_ASSERT_FALSE(schedule_owes_tick(&schedule));
    TEST_ASSERT_EQUAL_UINT64(BEGIN_US + 3u, schedule_time(&schedule, BEGIN_US + 3u));
}

static void test_a_refused_block_gives_no_times(void) {
    schedule_init(&schedule, 0, false, BEGIN_US);
    TEST_ASSERT_EQUAL_UINT32(SCHEDULE_REFUSED_PERIOD_US, schedule.period_us);
    TEST_ASSERT_EQUAL_UINT32(SCHEDULE_REFUSED_DEADLINE_US, schedule.tick_deadline_us);
    schedule_ticked(&schedule, BEGIN_US, false);
    TEST_ASSERT_TRUE(schedule_is_due(&schedule, BEGIN_US + SCHEDULE_REFUSED_PERIOD_US));
}

static void test_in_lockstep_guard_time_is_the_bus_and_the_clock_counts_silence_only(void) {
    schedule_init(&schedule, &config, true, BEGIN_US);
    can_frame_t frame = sync(10u);
    schedule_hear(&schedule, &frame, BEGIN_US);
    TEST_ASSERT_EQUAL_UINT64(10u * (uint64_t)PERIOD_US, schedule_time(&schedule, BEGIN_US));
    frame = sync(11u);
    schedule_hear(&schedule, &frame, BEGIN_US + 50000u);
    TEST_ASSERT_TRUE(schedule_owes_tick(&schedule)); /* of cycle 10, which was never complete */
    schedule_ticked(&schedule, BEGIN_US + 50000u, false);
    TEST_ASSERT_FALSE(schedule_owes_tick(&schedule));
    TEST_ASSERT_FALSE(schedule_is_due(&schedule, BEGIN_US + 50000u + LOCKSTEP_SILENCE_US - 1u));
    TEST_ASSERT_TRUE(schedule_is_due(&schedule, BEGIN_US + 50000u + LOCKSTEP_SILENCE_US));
    TEST_ASSERT_FALSE(schedule_is_due(&schedule, BEGIN_US + 10000000u)); /* a silent bus has no time */
}

static void test_the_time_left_by_the_tick_deadline_is_divided_in_halves(void) {
    config.tick_deadline_us = PERIOD_US + 100u;
    schedule_init(&schedule, &config, false, BEGIN_US);
    schedule_ticked(&schedule, BEGIN_US, true);
    TEST_ASSERT_FALSE(schedule_is_due(&schedule, BEGIN_US + PERIOD_US + 49u));
}

static void test_in_real_time_a_frame_does_not_move_the_due_time(void) {
    const can_frame_t frame = sync(7u);
    schedule_hear(&schedule, &frame, BEGIN_US + 1u);
    TEST_ASSERT_EQUAL_UINT64(BEGIN_US, schedule.due_us);
    TEST_ASSERT_FALSE(schedule.lockstep.begun);
}

static void test_in_lockstep_the_silence_counts_from_the_start_and_from_each_time_that_it_was_due(void) {
    schedule_init(&schedule, &config, true, BEGIN_US);
    TEST_ASSERT_EQUAL_UINT64(BEGIN_US + LOCKSTEP_SILENCE_US, schedule.due_us);
    (void)schedule_is_due(&schedule, BEGIN_US + LOCKSTEP_SILENCE_US);
    TEST_ASSERT_EQUAL_UINT64(BEGIN_US + 2u * LOCKSTEP_SILENCE_US, schedule.due_us);
}

static void test_in_lockstep_a_complete_cycle_has_its_tick_only_after_its_sync(void) {
    schedule_init(&schedule, &config, true, BEGIN_US);
    TEST_ASSERT_FALSE(schedule_complete(&schedule, true));
    (void)schedule_complete(&schedule, false);
    const can_frame_t frame = sync(10u);
    schedule_hear(&schedule, &frame, BEGIN_US);
    TEST_ASSERT_TRUE(schedule_complete(&schedule, true));
    (void)schedule_complete(&schedule, false);
    TEST_ASSERT_FALSE(schedule_complete(&schedule, true));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_first_tick_is_due_at_once);
    RUN_TEST(test_without_a_cycle_a_tick_is_due_after_a_period);
    RUN_TEST(test_a_cycle_after_a_fresh_tick_may_be_late_by_half_a_period_at_most);
    RUN_TEST(test_a_tight_tick_deadline_leaves_half_of_the_remaining_time);
    RUN_TEST(test_a_deadline_shorter_than_the_period_leaves_no_time);
    RUN_TEST(test_a_complete_cycle_has_one_tick_even_without_an_evaluation);
    RUN_TEST(test_in_real_time_guard_time_is_the_callers);
    RUN_TEST(test_a_refused_block_gives_no_times);
    RUN_TEST(test_in_lockstep_guard_time_is_the_bus_and_the_clock_counts_silence_only);
    RUN_TEST(test_the_time_left_by_the_tick_deadline_is_divided_in_halves);
    RUN_TEST(test_in_real_time_a_frame_does_not_move_the_due_time);
    RUN_TEST(test_in_lockstep_the_silence_counts_from_the_start_and_from_each_time_that_it_was_due);
    RUN_TEST(test_in_lockstep_a_complete_cycle_has_its_tick_only_after_its_sync);
    return UNITY_END();
}
