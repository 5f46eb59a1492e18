/* The times of a configuration block, its observer and its reaction: each bound from both sides. */
#include "config_edges.h"

void setUp(void) {
    config = make_config();
}
void tearDown(void) {}

/* --- timing ------------------------------------------------------------------------------------------------------- */

static void assert_period(uint32_t period_us, bool accepted) {
    make_timing(period_us);
    if (accepted) {
        TEST_ASSERT_EQUAL(GUARD_BAD_OBSERVER, judged()); /* the next check: its constants are of another period */
    } else {
        TEST_ASSERT_EQUAL(GUARD_BAD_TIMING, judged());
    }
}

static void test_a_period_is_from_250_us_to_50_ms(void) {
    assert_period(249u, false);
    assert_period(250u, true);
    assert_period(50000u, true);
    assert_period(50001u, false);
}

static void test_each_deadline_is_at_least_one_period(void) {
    ASSERT_BOUND(sync_deadline_us, 1000u, 999u, GUARD_BAD_TIMING);
    ASSERT_BOUND(joint_deadline_us, 1000u, 999u, GUARD_BAD_TIMING);
    ASSERT_BOUND(task_deadline_us, 1000u, 999u, GUARD_BAD_TIMING);
    ASSERT_BOUND(tick_deadline_us, 1000u, 999u, GUARD_BAD_TIMING);
    ASSERT_BOUND(tick_budget_us, 1u, 0u, GUARD_BAD_TIMING);
}

static void test_each_deadline_has_most_cycles(void) {
    ASSERT_BOUND(sync_deadline_us, 15000u, 15001u, GUARD_BAD_TIMING);
    ASSERT_BOUND(joint_deadline_us, 4000u, 4001u, GUARD_BAD_TIMING);
    ASSERT_BOUND(task_deadline_us, 15000u, 15001u, GUARD_BAD_TIMING);
    ASSERT_BOUND(tick_deadline_us, 8000u, 8001u, GUARD_BAD_TIMING);
    ASSERT_BOUND(tick_budget_us, 1000u, 1001u, GUARD_BAD_TIMING);
}

#define ASSERT_SLOW_BOUND(place, inside, outside)                                                                      \
    do {                                                                                                               \
        make_timing(50000u);                                                                                           \
        config.place = (inside);                                                                                       \
        TEST_ASSERT_EQUAL(GUARD_BAD_OBSERVER, judged());                                                               \
        make_timing(50000u);                                                                                           \
        config.place = (outside);                                                                                      \
        TEST_ASSERT_EQUAL(GUARD_BAD_TIMING, judged());                                                                 \
    } while (false)

static void test_at_a_long_period_each_deadline_has_a_longest_time(void) {
    ASSERT_SLOW_BOUND(sync_deadline_us, 500000u, 500001u);
    ASSERT_SLOW_BOUND(task_deadline_us, 500000u, 500001u);
    ASSERT_SLOW_BOUND(joint_deadline_us, 200000u, 200001u);
    ASSERT_SLOW_BOUND(tick_deadline_us, 200000u, 200001u);
}

static void test_a_task_stays_for_200_to_300_ms(void) {
    ASSERT_BOUND(task_dwell_cycles, 200u, 199u, GUARD_BAD_TIMING);
    ASSERT_BOUND(task_dwell_cycles, 300u, 301u, GUARD_BAD_TIMING);
    make_timing(250u);
    config.task_dwell_cycles = 1200u;
    TEST_ASSERT_EQUAL(GUARD_BAD_OBSERVER, judged());
    make_timing(6383u);
    config.task_dwell_cycles = 47u; /* 300,001 us */
    TEST_ASSERT_EQUAL(GUARD_BAD_TIMING, judged());
    config.task_dwell_cycles = 4295217u; /* of 1 ms: 249,704 us modulo 2^32 */
    TEST_ASSERT_EQUAL(GUARD_BAD_TIMING, judged());
}

static void test_settling_lasts_a_period_to_half_a_second(void) {
    ASSERT_BOUND(settling_us, 1000u, 999u, GUARD_BAD_TIMING);
    config.reset_healthy_us = 500000u;
    config.settling_us = 500000u;
    TEST_ASSERT_EQUAL(GUARD_OK, judged());
    config.reset_healthy_us = 500001u;
    config.settling_us = 500001u;
    TEST_ASSERT_EQUAL(GUARD_BAD_TIMING, judged());
}

static void test_health_lasts_the_settling_time_to_a_minute(void) {
    ASSERT_LIMIT(reset_healthy_us, 100000u, 99999u, GUARD_BAD_TIMING);
    ASSERT_LIMIT(reset_healthy_us, 60000000u, 60000001u, GUARD_BAD_TIMING);
}

/* --- observer ----------------------------------------------------------------------------------------------------- */

static void test_a_sampled_and_a_mean_torque_are_known_and_nothing_else(void) {
    ASSERT_LIMIT(observer.torque_sample, TORQUE_INSTANT, TORQUE_INSTANT + 1u, GUARD_BAD_OBSERVER);
    ASSERT_LIMIT(observer.torque_sample, TORQUE_INTERVAL, TORQUE_INTERVAL - 1u, GUARD_BAD_OBSERVER);
}

/* Five time constants leave 0.0067. K = 50 1/s: exp(-4.9) = 0.00745 and exp(-4.85) = 0.00783. */
static void test_settling_contains_nearly_five_time_constants(void) {
    ASSERT_BOUND(settling_us, 98000u, 97999u, GUARD_BAD_OBSERVER);
    ASSERT_BOUND(settling_us, 100000u, 97000u, GUARD_BAD_OBSERVER);
}

static void test_decay_and_gain_add_up_to_one(void) {
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) {
        const num_t gain = config.observer.gain[g];
        ASSERT_BOUND(observer.gain[g], gain + NUM(0.5e-5), gain + NUM(2e-5), GUARD_BAD_OBSERVER);
        ASSERT_BOUND(observer.gain[g], gain - NUM(0.5e-5), gain - NUM(2e-5), GUARD_BAD_OBSERVER);
    }
}

static void bend(uint32_t g, double by) {
    config.observer.decay[g] = config.observer.decay[g] + (num_t)NUM(by);
    config.observer.gain[g] = config.observer.gain[g] - (num_t)NUM(by);
}

static void test_the_decay_of_a_gap_is_a_power_of_that_of_a_cycle(void) {
    for (uint32_t g = 1; g < CONFIG_MAX_GAP; ++g) {
        for (int sign = -1; sign <= 1; sign += 2) {
            bend(g, sign * 0.8e-4);
            TEST_ASSERT_EQUAL(GUARD_OK, judged());
            bend(g, sign * 1.3e-4);
            TEST_ASSERT_EQUAL(GUARD_BAD_OBSERVER, judged());
        }
    }
}

static void test_the_momentum_gain_is_that_of_the_period_within_a_hundredth(void) {
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) {
        const double gain = (g == 0u)   ? 48.770575499286
                            : (g == 1u) ? 47.581290982020
                            : (g == 2u) ? 46.430674524981
                                        : 45.317311730504;
        ASSERT_LIMIT(observer.momentum_gain[g], (num_t)NUM(gain * 1.0096), (num_t)NUM(gain * 1.0104),
                     GUARD_BAD_OBSERVER);
        ASSERT_LIMIT(observer.momentum_gain[g], (num_t)NUM(gain * 0.9904), (num_t)NUM(gain * 0.9896),
                     GUARD_BAD_OBSERVER);
    }
}

/* 250 us and 50 ms, so that no digit of the period is lost. K T = 0.05 as before. */
static void test_the_momentum_gain_follows_the_period(void) {
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) {
        config.observer.momentum_gain[g] = config.observer.momentum_gain[g] * 2;
    }
    make_timing(500u);
    config.settling_us = 50000u;
    config.reset_healthy_us = 50000u;
    TEST_ASSERT_EQUAL(GUARD_OK, judged());
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) { /* 1.024 times as long: one digit of the microseconds matters */
        config.observer.momentum_gain[g] = (config.observer.momentum_gain[g] / 128) * 125;
    }
    make_timing(1024u);
    config.settling_us = 102400u;
    config.reset_healthy_us = 102400u;
    TEST_ASSERT_EQUAL(GUARD_OK, judged());
}

/* At 500 Hz, where 500 1/s is the gain of an observer without memory. */
static void make_memoryless(double decay, double gain) {
    make_timing(2000u);
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) {
        config.observer.decay[g] = (g == 0u) ? (num_t)NUM(decay) : NUM(0.5e-4);
        config.observer.gain[g] = (g == 0u) ? (num_t)NUM(gain) : (NUM(1) - NUM(0.5e-4));
        config.observer.momentum_gain[g] = (num_t)NUM(gain * 500.0 / (g + 1.0));
        config.bank.channel[0].own[g] = NUM(0);
        config.bank.channel[0].in[g] = NUM(1);
    }
}

static void test_an_observer_has_a_memory_and_a_gain_below_one(void) {
    make_memoryless(0.5e-5, 0.999995);
    TEST_ASSERT_EQUAL(GUARD_OK, judged());
    make_memoryless(0.0, 0.999995);
    TEST_ASSERT_EQUAL(GUARD_BAD_OBSERVER, judged());
    make_memoryless(0.5e-5, 1.0);
    TEST_ASSERT_EQUAL(GUARD_BAD_OBSERVER, judged());
}

/* 0.0075 is left after one cycle, and that is the whole settling time. */
static void test_settling_may_leave_exactly_its_bound(void) {
    make_memoryless(0.0075, 0.9925);
    config.bank.channel[0].in[0] = (num_t)NUM(1.0 / 0.9925);
    TEST_ASSERT_EQUAL(GUARD_OK, judged());
    make_memoryless(0.00751, 0.99249);
    TEST_ASSERT_EQUAL(GUARD_BAD_OBSERVER, judged());
}

static void test_a_momentum_gain_is_at_most_500_per_second(void) {
    static const double at[CONFIG_MAX_GAP] = {0.5, 0.25, 0.125, 0.0625};
    static const double beyond[CONFIG_MAX_GAP] = {0.4995, 0.24950025, 0.124625375, 0.062250375};
    make_observer(at);
    TEST_ASSERT_EQUAL(GUARD_OK, judged());
    make_observer(beyond);
    TEST_ASSERT_EQUAL(GUARD_BAD_OBSERVER, judged());
}

/* --- reaction ----------------------------------------------------------------------------------------------------- */

/* An observer for a period of `period_ms`, and the longest settling and health that every period permits. */
static void make_slow_observer(int32_t period_ms, const double decay[CONFIG_MAX_GAP]) {
    make_observer(decay);
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) {
        config.observer.momentum_gain[g] = config.observer.momentum_gain[g] / period_ms;
    }
    config.settling_us = 500000u;
    config.reset_healthy_us = 500000u;
}

/* A period of 25 ms: the sample's age, 8 ticks until 1 - 0.91^k is half, 3 ticks of debounce in the slowest task, and
 * the deadlines of joints (100 ms) and ticks (200 ms). */
static void make_slow(uint32_t period_us) {
    static const double decay[CONFIG_MAX_GAP] = {0.75, 0.5625, 0.421875, 0.31640625};
    make_timing(period_us);
    make_slow_observer(25, decay);
    config.joint_deadline_us = 100000u;
    config.tick_deadline_us = 200000u;
    config.bank.channel[0].own[0] = NUM(0.91);
    config.bank.channel[0].in[0] = NUM(0.36);
    config.task[TASK_PAYLOAD].detector.debounce_ticks = 3u;
}

/* 20 Hz, K = 10 1/s. */
static void test_a_block_with_the_longest_period_and_the_slowest_observer_is_accepted(void) {
    static const double decay[CONFIG_MAX_GAP] = {0.606530659712633, 0.367879441171442, 0.223130160148430,
                                                 0.135335283236613};
    make_timing(50000u);
    make_slow_observer(50, decay);
    TEST_ASSERT_EQUAL(GUARD_OK, judged());
}

static void test_the_worst_reaction_is_600_ms(void) {
    make_slow(25000u);
    TEST_ASSERT_EQUAL(600000u, config_reaction_us(&config));
    TEST_ASSERT_EQUAL(GUARD_OK, judged());
    make_slow(25001u);
    config.tick_deadline_us = 199988u;
    TEST_ASSERT_EQUAL(600000u, config_reaction_us(&config));
    TEST_ASSERT_EQUAL(GUARD_OK, judged());
    make_slow(25001u);
    config.tick_deadline_us = 199989u;
    TEST_ASSERT_EQUAL(GUARD_TOO_SLOW, judged());
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_period_is_from_250_us_to_50_ms);
    RUN_TEST(test_each_deadline_is_at_least_one_period);
    RUN_TEST(test_each_deadline_has_most_cycles);
    RUN_TEST(test_at_a_long_period_each_deadline_has_a_longest_time);
    RUN_TEST(test_a_task_stays_for_200_to_300_ms);
    RUN_TEST(test_settling_lasts_a_period_to_half_a_second);
    RUN_TEST(test_health_lasts_the_settling_time_to_a_minute);
    RUN_TEST(test_a_sampled_and_a_mean_torque_are_known_and_nothing_else);
    RUN_TEST(test_settling_contains_nearly_five_time_constants);
    RUN_TEST(test_decay_and_gain_add_up_to_one);
    RUN_TEST(test_the_decay_of_a_gap_is_a_power_of_that_of_a_cycle);
    RUN_TEST(test_the_momentum_gain_is_that_of_the_period_within_a_hundredth);
    RUN_TEST(test_the_momentum_gain_follows_the_period);
    RUN_TEST(test_an_observer_has_a_memory_and_a_gain_below_one);
    RUN_TEST(test_settling_may_leave_exactly_its_bound);
    RUN_TEST(test_a_momentum_gain_is_at_most_500_per_second);
    RUN_TEST(test_a_block_with_the_longest_period_and_the_slowest_observer_is_accepted);
    RUN_TEST(test_the_worst_reaction_is_600_ms);
    return UNITY_END();
}
