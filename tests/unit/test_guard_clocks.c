/* Time against cycles: the windows in which they are compared, and a clock that stands still. */
#include "permitted_fixture.h"

static void syncs(uint32_t number, uint32_t apart_us) {
    for (uint32_t i = 0; i < number; ++i) {
        ++bench.cycle;
        bench.now_us += apart_us;
        receive(&bench, sync_frame(&bench));
    }
}

/* The first Sync of a new window at this period. */
static void begin_window(uint32_t period_us) {
    bench.config.period_us = period_us;
    guard->inputs.window_started = false;
    guard->inputs.clocks_agree = false;
    guard->inputs.fault = 0;
    syncs(1u, period_us);
}

static void test_a_window_lasts_64_ms_but_16_to_64_cycles(void) {
    static const uint32_t period_us[] = {8000u, 2000u, 1000u, 250u};
    static const uint32_t whole[] = {16u, 32u, 64u, 64u};
    for (uint32_t k = 0; k < 4u; ++k) {
        begin_window(period_us[k]);
        syncs(whole[k] - 1u, period_us[k]);
        TEST_ASSERT_FALSE(guard->inputs.clocks_agree);
        syncs(1u, period_us[k]);
        TEST_ASSERT_TRUE(guard->inputs.clocks_agree);
    }
}

static void test_each_window_is_as_long_as_the_first_one(void) {
    begin_window(8000u);
    syncs(16u, 8000u);
    syncs(15u, 16000u);
    TEST_ASSERT_EQUAL(0, guard->inputs.fault);
    TEST_ASSERT_TRUE(guard->inputs.clocks_agree);
    syncs(1u, 16000u);
    TEST_ASSERT_EQUAL(GUARD_REASON_CLOCK_RATE, guard->inputs.fault);
    TEST_ASSERT_FALSE(guard->inputs.clocks_agree);
}

/* A clock that stands is a FAULT, one that is slow a stop. */
static void test_a_clock_that_stands_differs_from_a_very_slow_one(void) {
    begin_window(1000u);
    syncs(64u, 0u);
    TEST_ASSERT_EQUAL(GUARD_REASON_CLOCK_STOPPED, guard->inputs.fault);
    TEST_ASSERT_EQUAL(0, guard->inputs.fault_joint);
    begin_window(1000u);
    bench.now_us += 1u;
    syncs(64u, 0u);
    TEST_ASSERT_EQUAL(GUARD_REASON_CLOCK_RATE, guard->inputs.fault);
}

static void stand(uint32_t ticks) {
    for (uint32_t i = 0; i < ticks; ++i) {
        tick(&bench);
        TEST_ASSERT_NOT_EQUAL(GUARD_STATE_FAULT, bench.out.state);
    }
}

/* Time 0 is a time like any other: the first tick does not stand. */
static void test_the_fifth_tick_at_the_same_time_is_a_fault(void) {
    start(&bench);
    bench.now_us = 0;
    stand(4u);
    bench.now_us += 1u;
    stand(4u);
    tick(&bench);
    assert_fault(&bench, GUARD_REASON_CLOCK_STOPPED);
}

static void test_an_input_of_the_future_is_time_that_runs_backwards(void) {
    guard_input_t *const input[] = {&guard->inputs.sync, &guard->inputs.joints, &guard->inputs.task};
    const guard_t permitting = *guard;
    for (uint32_t i = 0; i < 3u; ++i) {
        *guard = permitting;
        next_cycle(&bench);
        input[i]->good_us = bench.now_us;
        tick(&bench);
        TEST_ASSERT_EQUAL(GUARD_STATE_MONITORING, bench.out.state);
        *guard = permitting;
        input[i]->good_us = bench.now_us + 1u;
        tick(&bench);
        assert_fault(&bench, GUARD_REASON_TIME_BACKWARDS);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_window_lasts_64_ms_but_16_to_64_cycles);
    RUN_TEST(test_each_window_is_as_long_as_the_first_one);
    RUN_TEST(test_a_clock_that_stands_differs_from_a_very_slow_one);
    RUN_TEST(test_the_fifth_tick_at_the_same_time_is_a_fault);
    RUN_TEST(test_an_input_of_the_future_is_time_that_runs_backwards);
    return UNITY_END();
}
