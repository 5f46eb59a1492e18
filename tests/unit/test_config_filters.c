/* Which filters a configuration block may have: their constants, the step response, and the time to react. */
#include <math.h>

#include "config_edges.h"

void setUp(void) {
    config = make_config();
}
void tearDown(void) {}

/* One constant of one gap at its bound and beyond. Only those of one cycle shape the step response. */
static void assert_constant(num_t *at, double bound, bool negative) {
    const size_t place = (size_t)((const uint8_t *)at - (const uint8_t *)&config);
    num_t *const constant = (num_t *)(void *)((uint8_t *)&config + place);
    *constant = (num_t)NUM(bound);
    TEST_ASSERT_EQUAL(GUARD_OK, judged());
    *constant = (num_t)NUM(bound * 1.001);
    TEST_ASSERT_EQUAL(GUARD_BAD_BANK, judged());
    *constant = (num_t)NUM(negative ? -bound : 0.0);
    TEST_ASSERT_EQUAL(GUARD_OK, judged());
    *constant = (num_t)NUM(negative ? (-bound * 1.001) : -0.001);
    TEST_ASSERT_EQUAL(GUARD_BAD_BANK, judged());
}

static void test_the_constants_of_a_channel_are_bounded(void) {
    channel_config_t *const channel = &config.bank.channel[0];
    assert_constant(&channel->stay[0], 1.0, true);
    for (uint32_t g = 1; g < CONFIG_MAX_GAP; ++g) {
        assert_constant(&channel->own[g], 1.0, true);
        assert_constant(&channel->cross[g], 1.0, true);
        assert_constant(&channel->back[g], 1.0, true);
        assert_constant(&channel->stay[g], 1.0, true);
        assert_constant(&channel->in[g], 16.0, true);
        assert_constant(&channel->in_back[g], 16.0, true);
        ASSERT_BOUND(bank.channel[0].high_pass[g], NUM(0.999), NUM(1), GUARD_BAD_BANK);
        ASSERT_BOUND(bank.channel[0].high_pass[g], NUM(0), NUM(-0.001), GUARD_BAD_BANK);
    }
}

static void make_gain(double gain) {
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) {
        config.bank.channel[0].in[g] = (num_t)NUM(gain);
    }
}

/* The channel is static: it ends at the step's size within 3 %. */
static void test_a_step_ends_at_its_size(void) {
    static const double good[] = {0.972, 1.028}, bad[] = {0.968, 1.032};
    for (uint32_t i = 0; i < 2u; ++i) {
        make_gain(good[i]);
        TEST_ASSERT_EQUAL(GUARD_OK, judged());
        make_gain(bad[i]);
        TEST_ASSERT_EQUAL(GUARD_BAD_BANK, judged());
    }
}

/* A second-order low-pass at 60 rad/s. Its step overshoots by exp(-pi damping / sqrt(1 - damping^2)). */
static void make_swinging(double damping) {
    channel_config_t *const c = &config.bank.channel[0];
    const double root = sqrt(1.0 - damping * damping), corner = 60.0;
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) {
        const double span = (g + 1.0) * 0.001;
        const double turn = corner * root * span, fade = exp(-damping * corner * span);
        const double own = fade * (cos(turn) + damping / root * sin(turn)), cross = fade * sin(turn) / root;
        const double gain = 1.0 - exp(-50.0 * span);
        c->own[g] = (num_t)NUM(own);
        c->cross[g] = (num_t)NUM(cross);
        c->back[g] = (num_t)NUM(-cross);
        c->stay[g] = (num_t)NUM(fade * (cos(turn) - damping / root * sin(turn)));
        c->in[g] = (num_t)NUM((1.0 - own) / gain);
        c->in_back[g] = (num_t)NUM(cross / gain);
    }
}

static void test_a_step_overshoots_by_at_most_three_tenths(void) {
    make_swinging(0.37); /* 1.286 */
    TEST_ASSERT_EQUAL(GUARD_OK, judged());
    make_swinging(0.34); /* 1.321 */
    TEST_ASSERT_EQUAL(GUARD_BAD_BANK, judged());
}

static void test_every_channel_of_the_bank_is_checked(void) {
    for (uint32_t bad = 0; bad < 3u; ++bad) {
        config.bank.channels = 3u;
        config.bank.channel[1] = config.bank.channel[0];
        config.bank.channel[2] = config.bank.channel[0];
        config.bank.channel[bad].in[0] = NUM(2);
        TEST_ASSERT_EQUAL(GUARD_BAD_BANK, judged());
    }
}

static void test_a_channel_of_the_unexplained_part_reaches_half_of_a_step(void) {
    config.bank.channels = 2u;
    config.bank.channel[1] = config.bank.channel[0];
    config.bank.channel[1].high_pass[0] = NUM(0.01);
    TEST_ASSERT_EQUAL(GUARD_OK, judged());
    config.bank.channels = 2u;
    config.bank.channel[1] = config.bank.channel[0];
    config.bank.channel[1].high_pass[0] = NUM(0.5);
    TEST_ASSERT_EQUAL(GUARD_BAD_BANK, judged());
}

/* The observer filters, and the channel passes its residual on: 14 ticks until half. */
static void make_filter_first(void) {
    config.subspace.order = ORDER_FILTER_FIRST;
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) {
        config.bank.channel[0].own[g] = NUM(0);
        config.bank.channel[0].in[g] = NUM(1);
    }
}

static void test_a_residual_that_is_filtered_first_is_as_slow_as_its_observer(void) {
    const uint32_t usual_us = config_reaction_us(&config);
    make_filter_first();
    TEST_ASSERT_EQUAL(usual_us, config_reaction_us(&config));
    TEST_ASSERT_EQUAL(GUARD_OK, judged());
    make_filter_first();
    config.subspace.order = ORDER_PROJECT_FIRST; /* the increment alone is a twentieth of the step */
    TEST_ASSERT_EQUAL(GUARD_BAD_BANK, judged());
}

static void test_a_regressor_is_projected_first(void) {
    make_filter_first();
    config.task[TASK_PAYLOAD].index.kind = INDEX_REGRESSOR;
    config.regressor.used = 1u;
    config.regressor.low_pass = make_config().bank.channel[0];
    TEST_ASSERT_EQUAL(GUARD_BAD_BANK, judged());
}

/* With a decay of 0.5 the first tick has exactly half. */
static void test_half_of_a_step_is_enough(void) {
    static const double decay[CONFIG_MAX_GAP] = {0.5, 0.25, 0.125, 0.0625};
    make_observer(decay);
    TEST_ASSERT_EQUAL((1u + 1u + 2u + DEADLINE_CYCLES + 5u) * PERIOD_US, config_reaction_us(&config));
}

/* A channel of `sudden` does not see a constant force. */
static void test_a_fast_channel_of_sudden_makes_no_faster_reaction(void) {
    const uint32_t alone_us = config_reaction_us(&config);
    config.bank.channels = 2u;
    config.bank.channel[1] = config.bank.channel[0];
    config.bank.channel[1].of = CHANNEL_SUDDEN;
    config.bank.channel[1].own[0] = NUM(0.5);
    config.bank.channel[1].in[0] = NUM(10);
    for (uint32_t t = TASK_NONE; t < (uint32_t)TASK_COUNT; ++t) {
        config.task[t].detector.channels = 3u;
    }
    TEST_ASSERT_EQUAL(alone_us, config_reaction_us(&config));
}

/* The channel that answers first counts: own 0.9 takes 7 ticks, own 0.8 takes 4, and a channel that the task does not
 * watch counts for nothing. */
static void test_a_task_reacts_by_its_fastest_channel(void) {
    static const double own[] = {0.9, 0.8, 0.5};
    config.bank.channels = 3u;
    for (uint32_t c = 0; c < 3u; ++c) {
        config.bank.channel[c] = config.bank.channel[0];
        config.bank.channel[c].own[0] = (num_t)NUM(own[c]);
        config.bank.channel[c].in[0] = (num_t)NUM((1.0 - own[c]) / 0.048770575499286);
    }
    for (uint32_t t = TASK_NONE; t < (uint32_t)TASK_COUNT; ++t) {
        config.task[t].detector.channels = 3u;
    }
    const uint32_t beside = (1u + 2u + DEADLINE_CYCLES + 5u) * PERIOD_US;
    TEST_ASSERT_EQUAL(beside + 4u * PERIOD_US, config_reaction_us(&config));
    config.task[TASK_CONTACT].detector.channels = 1u;
    TEST_ASSERT_EQUAL(beside + 7u * PERIOD_US, config_reaction_us(&config));
    const channel_config_t slow = config.bank.channel[0];
    config.bank.channel[0] = config.bank.channel[1];
    config.bank.channel[1] = slow;
    config.task[TASK_CONTACT].detector.channels = 3u;
    TEST_ASSERT_EQUAL(beside + 4u * PERIOD_US, config_reaction_us(&config));
    config.task[TASK_CONTACT].detector.channels = 8u; /* none: it never reacts */
    TEST_ASSERT_EQUAL(UINT32_MAX, config_reaction_us(&config));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_constants_of_a_channel_are_bounded);
    RUN_TEST(test_a_step_ends_at_its_size);
    RUN_TEST(test_a_step_overshoots_by_at_most_three_tenths);
    RUN_TEST(test_every_channel_of_the_bank_is_checked);
    RUN_TEST(test_a_channel_of_the_unexplained_part_reaches_half_of_a_step);
    RUN_TEST(test_a_residual_that_is_filtered_first_is_as_slow_as_its_observer);
    RUN_TEST(test_a_regressor_is_projected_first);
    RUN_TEST(test_half_of_a_step_is_enough);
    RUN_TEST(test_a_fast_channel_of_sudden_makes_no_faster_reaction);
    RUN_TEST(test_a_task_reacts_by_its_fastest_channel);
    return UNITY_END();
}
