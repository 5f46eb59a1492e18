/* The channels against their closed forms. */
#include "bank.h"

#include "core_fixture.h"

#define JOINTS 7u
#define GAIN   50.0
#define PERIOD 1e-3

static bank_t bank;
static bank_config_t config;

void setUp(void) {
    bank_init(&bank);
    memset(&config, 0, sizeof(config));
    config.channels = 1u;
}
void tearDown(void) {
    TEST_ASSERT_EQUAL(0, bank.saturations);
}

static double observer_gain(uint32_t gap) {
    return 1.0 - exp(-GAIN * PERIOD * gap);
}

/* Second order, exact for an input that is constant over the step. */
static void second_order(uint32_t channel, double corner, double damping, double high_pass_hz) {
    for (uint32_t g = 0; g < OBSERVER_MAX_GAP; ++g) {
        const double span = PERIOD * (g + 1.0);
        const double root = sqrt(1.0 - damping * damping);
        const double turn = corner * root * span;
        const double fade = exp(-damping * corner * span);
        const double own = fade * (cos(turn) + damping / root * sin(turn));
        const double cross = fade * sin(turn) / root;
        channel_config_t *const c = &config.channel[channel];
        c->own[g] = num_of(own);
        c->cross[g] = num_of(cross);
        c->back[g] = num_of(-cross);
        c->stay[g] = num_of(fade * (cos(turn) - damping / root * sin(turn)));
        c->in[g] = num_of((1.0 - own) / observer_gain(g + 1u));
        c->in_back[g] = num_of(cross / observer_gain(g + 1u));
        c->high_pass[g] = num_of((high_pass_hz > 0.0) ? (1.0 - exp(-6.283185307 * high_pass_hz * span)) : 0.0);
    }
}

static void push(double torque, uint32_t gap) {
    num_t input[ROBOT_MAX_JOINTS] = {NUM(0)};
    for (uint32_t i = 0; i < JOINTS; ++i) {
        input[i] = num_of(observer_gain((gap >= 1u) ? gap : 1u) * torque * (1.0 + i));
    }
    num_t other[ROBOT_MAX_JOINTS] = {NUM(0)};
    for (uint32_t i = 0; i < JOINTS; ++i) {
        other[i] = -input[i];
    }
    bank_step(&bank, &config, JOINTS, gap, input, other, 1u);
}

/* 1 - exp(-z w t) (cos(w' t) + z w / w' sin(w' t)) */
static double step_response(double corner, double damping, double t) {
    const double root = sqrt(1.0 - damping * damping);
    return 1.0 - exp(-damping * corner * t) * (cos(corner * root * t) + damping / root * sin(corner * root * t));
}

static void test_a_second_order_channel_agrees_with_the_closed_form(void) {
    const double corners[] = {30.0, 60.0, 120.0};
    for (uint32_t c = 0; c < 3u; ++c) {
        setUp();
        second_order(0u, corners[c], 0.7, 0.0);
        for (uint32_t k = 1; k <= 1000u; ++k) {
            push(3.0, 1u);
            for (uint32_t i = 0; i < JOINTS; ++i) {
                const double expected = 3.0 * (1.0 + i) * step_response(corners[c], 0.7, k * PERIOD);
                ASSERT_CLOSE(expected, value_of(bank.channel[0].output[i]), 2e-3 + 6e-4 * (1.0 + i));
            }
        }
    }
}

static void test_any_pattern_of_gaps_gives_the_result_of_single_cycles(void) {
    random_start(71);
    second_order(0u, 60.0, 0.7, 0.0);
    uint32_t cycles = 0;
    while (cycles < 600u) {
        const uint32_t gap = 1u + (uint32_t)(2.0 * (random_one() + 1.0)) % OBSERVER_MAX_GAP;
        push(2.0, gap);
        cycles += gap;
        ASSERT_CLOSE(2.0 * step_response(60.0, 0.7, cycles * PERIOD), value_of(bank.channel[0].output[0]), 4e-3);
    }
}

static void test_a_high_pass_removes_constants_and_passes_changes(void) {
    second_order(0u, 120.0, 0.7, 3.0);
    double peak = 0.0;
    for (uint32_t k = 0; k < 2000u; ++k) {
        push(5.0, 1u);
        peak = fmax(peak, value_of(bank.channel[0].output[0]));
    }
    TEST_ASSERT_TRUE(peak > 3.5);
    ASSERT_CLOSE(0.0, value_of(bank.channel[0].output[0]), 5e-3);
}

static void test_after_a_restart_every_channel_is_at_zero(void) {
    second_order(0u, 30.0, 0.7, 1.0);
    for (uint32_t gap = 0; gap <= OBSERVER_MAX_GAP + 1u; gap += OBSERVER_MAX_GAP + 1u) {
        for (uint32_t k = 0; k < 100u; ++k) {
            push(5.0, 1u);
        }
        push(5.0, gap);
        for (uint32_t i = 0; i < JOINTS; ++i) {
            TEST_ASSERT_TRUE(bank.channel[0].output[i] == NUM(0));
            TEST_ASSERT_TRUE(bank.channel[0].level[i] == NUM(0));
        }
    }
}

static void test_channels_are_independent(void) {
    config.channels = 3u;
    second_order(0u, 30.0, 0.7, 0.0);
    second_order(1u, 60.0, 0.7, 1.0);
    second_order(2u, 120.0, 0.7, 0.0);
    for (uint32_t k = 1; k <= 40u; ++k) {
        push(4.0, 1u);
    }
    ASSERT_CLOSE(4.0 * step_response(30.0, 0.7, 0.04), value_of(bank.channel[0].output[0]), 2e-3);
    ASSERT_CLOSE(4.0 * step_response(120.0, 0.7, 0.04), value_of(bank.channel[2].output[0]), 2e-3);
    TEST_ASSERT_TRUE(bank.channel[3].output[0] == NUM(0));
}

static void test_a_channel_of_sudden_filters_only_the_sudden_part(void) {
    second_order(0u, 60.0, 0.7, 1.0);
    second_order(1u, 60.0, 0.7, 1.0);
    config.channels = 2u;
    config.channel[1].of = (uint32_t)CHANNEL_SUDDEN;
    for (uint32_t k = 0; k < 50u; ++k) {
        push(3.0, 1u);
    }
    for (uint32_t i = 0; i < JOINTS; ++i) {
        TEST_ASSERT_TRUE(value_of(bank.channel[0].output[i]) > 1.0);
        ASSERT_CLOSE(-value_of(bank.channel[0].output[i]), value_of(bank.channel[1].output[i]), 1e-5);
    }
}

static void test_unused_channels_and_joints_stay_zero(void) {
    second_order(0u, 60.0, 0.7, 0.0);
    second_order(1u, 60.0, 0.7, 0.0);
    const num_t input[ROBOT_MAX_JOINTS] = {NUM(1), NUM(1), NUM(1), NUM(1), NUM(1), NUM(1), NUM(1), NUM(1)};
    bank_step(&bank, &config, JOINTS, 1u, input, input, 1u);
    const channel_t nothing = {0};
    TEST_ASSERT_FALSE(bank.channel[0].output[JOINTS - 1u] == NUM(0));
    TEST_ASSERT_TRUE(bank.channel[0].output[JOINTS] == NUM(0));
    TEST_ASSERT_EQUAL_MEMORY(&nothing, &bank.channel[1], sizeof nothing);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_second_order_channel_agrees_with_the_closed_form);
    RUN_TEST(test_a_channel_of_sudden_filters_only_the_sudden_part);
    RUN_TEST(test_any_pattern_of_gaps_gives_the_result_of_single_cycles);
    RUN_TEST(test_a_high_pass_removes_constants_and_passes_changes);
    RUN_TEST(test_after_a_restart_every_channel_is_at_zero);
    RUN_TEST(test_channels_are_independent);
    RUN_TEST(test_unused_channels_and_joints_stay_zero);
    return UNITY_END();
}
