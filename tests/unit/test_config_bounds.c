/* Every bound of a configuration block, on both of its sides where it has two. test_config.c says why they exist. */
#include "config_bounds.h"

#include "config_parts.h"
#include "guard_fixture.h"

static guard_config_t config;

void setUp(void) {
    config = make_config();
}
void tearDown(void) {}

/* The verdict on the changed block; then the good block is restored. */
static void assert_verdict(guard_status_t expected) {
    seal_config(&config);
    TEST_ASSERT_EQUAL(expected, config_check(&config));
    config = make_config();
}

static void assert_word_refused(uint32_t *word, uint32_t value, guard_status_t expected) {
    *word = value;
    assert_verdict(expected);
}

static void assert_number_refused(num_t *number, num_t value, guard_status_t expected) {
    *number = value;
    assert_verdict(expected);
}

static void test_the_reaction_is_that_of_the_fastest_watched_channel(void) {
    const uint32_t alone_us = config_reaction_us(&config);
    config.bank.channels = 2u;
    config.bank.channel[1] = config.bank.channel[0];
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) {
        config.bank.channel[1].own[g] = NUM(0.99); /* a fifth as fast */
        config.bank.channel[1].in[g] = NUM(0.205);
    }
    TEST_ASSERT_EQUAL(alone_us, config_reaction_us(&config)); /* not watched */
    for (uint32_t t = 0; t < TASK_COUNT; ++t) {
        config.task[t].detector.channels = 3u;
    }
    TEST_ASSERT_EQUAL(alone_us, config_reaction_us(&config));
    config.task[TASK_NONE].detector.channels = 2u;
    TEST_ASSERT_TRUE(config_reaction_us(&config) > alone_us);
    config.bank.channel[1].of = CHANNEL_SUDDEN; /* which a constant force does not reach */
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, config_reaction_us(&config));
}

static void test_each_constant_of_the_observer_is_bounded(void) {
    assert_number_refused(&config.observer.decay[0], NUM(0), GUARD_BAD_OBSERVER);
    assert_number_refused(&config.observer.decay[0], NUM(1), GUARD_BAD_OBSERVER);
    assert_number_refused(&config.observer.gain[0], NUM(0), GUARD_BAD_OBSERVER);
    assert_number_refused(&config.observer.gain[0], NUM(1), GUARD_BAD_OBSERVER);
    assert_number_refused(&config.observer.momentum_gain[0], NUM(0), GUARD_BAD_OBSERVER);
    assert_number_refused(&config.observer.momentum_gain[0], NUM(501), GUARD_BAD_OBSERVER);
    assert_number_refused(&config.observer.gain[0], NUM(0.05), GUARD_BAD_OBSERVER); /* with the decay not 1 */
    assert_number_refused(&config.observer.momentum_gain[3], NUM(20), GUARD_BAD_OBSERVER);
    config.observer.torque_sample = TORQUE_INSTANT;
    assert_verdict(GUARD_OK);
}

static void test_each_constant_of_the_projection_is_bounded(void) {
    assert_number_refused(&config.subspace.tolerance, NUM(0.11), GUARD_BAD_SUBSPACE);
    assert_number_refused(&config.subspace.lever_m, NUM(1.01), GUARD_BAD_SUBSPACE);
    assert_number_refused(&config.subspace.softness, NUM(0.21), GUARD_BAD_SUBSPACE);
    assert_number_refused(&config.subspace.softness, NUM(0.004), GUARD_BAD_SUBSPACE);
    assert_word_refused(&config.subspace.order, 0u, GUARD_BAD_SUBSPACE);
}

static void test_each_correction_of_a_sensor_is_bounded_for_every_joint(void) {
    for (uint32_t i = 0; i < JOINTS; ++i) {
        const num_t beyond = (config.robot.joint[i].torque_max_nm / (int32_t)CONFIG_SENSOR_SHARE) + NUM(0.01);
        assert_number_refused(&config.sensor.offset_nm[i], beyond, GUARD_BAD_SENSOR);
        assert_number_refused(&config.sensor.offset_nm[i], -beyond, GUARD_BAD_SENSOR);
        assert_number_refused(&config.sensor.friction_nm[i], beyond, GUARD_BAD_SENSOR);
        assert_number_refused(&config.sensor.friction_nm[i], NUM(-0.01), GUARD_BAD_SENSOR);
    }
    assert_number_refused(&config.sensor.friction_nm[0], NUM(65), GUARD_BAD_SENSOR);
#ifndef TAUPERP_FIXED
    assert_number_refused(&config.sensor.offset_nm[0], 0.0f / 0.0f, GUARD_BAD_SENSOR);
    assert_number_refused(&config.sensor.friction_nm[0], 0.0f / 0.0f, GUARD_BAD_SENSOR);
#endif
}

static void test_each_number_of_a_links_shape_is_bounded(void) {
    assert_word_refused(&config.sight.reaction, (uint32_t)SIGHT_REACTIONS, GUARD_BAD_SIGHT);
    assert_number_refused(&config.sight.force_n, NUM(0), GUARD_BAD_SIGHT);
    assert_number_refused(&config.sight.force_n, NUM(501), GUARD_BAD_SIGHT);
    for (uint32_t i = 0; i < JOINTS; ++i) {
        assert_number_refused(&config.shape.half_m[i], NUM(-0.01), GUARD_BAD_SIGHT);
        assert_number_refused(&config.shape.half_m[i], NUM(4.01), GUARD_BAD_SIGHT);
        for (uint32_t a = 0; a < 3u; ++a) {
            assert_number_refused(&config.shape.middle[i][a], NUM(-4.01), GUARD_BAD_SIGHT);
        }
    }
    for (uint32_t t = 0; t < TASK_COUNT; ++t) {
        config.task[t].needed_links = 1u << (JOINTS - 1u);
        assert_verdict(GUARD_OK);
        config.task[t].needed_links = 1u << JOINTS; /* of a link that the arm has not */
        assert_verdict(GUARD_BAD_SIGHT);
    }
}

static void test_each_number_of_the_base_is_bounded(void) {
    for (uint32_t row = 0; row < 3u; ++row) {
        for (uint32_t column = 0; column < 3u; ++column) {
            assert_number_refused(&config.robot.base[row][column], NUM(500), GUARD_BAD_ROBOT);
        }
    }
}

static void test_each_constant_of_a_channel_is_bounded_for_every_gap(void) {
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) {
        channel_config_t *const channel = &config.bank.channel[0];
        num_t *const up_to_one[] = {&channel->own[g], &channel->cross[g], &channel->back[g], &channel->stay[g]};
        for (size_t i = 0; i < sizeof(up_to_one) / sizeof(up_to_one[0]); ++i) {
            assert_number_refused(up_to_one[i], NUM(1.01), GUARD_BAD_BANK);
            assert_number_refused(up_to_one[i], NUM(-1.01), GUARD_BAD_BANK);
        }
        assert_number_refused(&channel->in[g], NUM(16.1), GUARD_BAD_BANK);
        assert_number_refused(&channel->in_back[g], NUM(-16.1), GUARD_BAD_BANK);
        assert_number_refused(&channel->high_pass[g], NUM(-0.01), GUARD_BAD_BANK);
        assert_number_refused(&channel->high_pass[g], NUM(1), GUARD_BAD_BANK);
    }
}

static void set_gain(num_t gain) {
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) {
        config.bank.channel[0].in[g] = gain;
    }
}

static void test_a_channel_has_gain_one(void) {
    set_gain(NUM(1.02));
    assert_verdict(GUARD_OK);
    set_gain(NUM(0.9));
    assert_verdict(GUARD_BAD_BANK);
    set_gain(NUM(1.2));
    assert_verdict(GUARD_BAD_BANK);
    set_gain(NUM(1.4));
    assert_verdict(GUARD_BAD_BANK);
}

static void ask_for_regressor(void) {
    config = make_config();
    config.task[TASK_PAYLOAD].index.kind = INDEX_REGRESSOR;
    config.regressor.used = 1u;
    config.regressor.low_pass = config.bank.channel[0];
    TEST_ASSERT_TRUE(regressor_is_valid(&config));
}

static void test_each_condition_of_the_regressor_is_checked(void) {
    ask_for_regressor();
    config.task[TASK_PAYLOAD].index.kind = INDEX_PAYLOAD;
    TEST_ASSERT_FALSE(regressor_is_valid(&config));
    ask_for_regressor();
    config.subspace.order = ORDER_FILTER_FIRST;
    TEST_ASSERT_FALSE(regressor_is_valid(&config));
    ask_for_regressor();
    config.subspace.projector = PROJECTOR_HARD;
    TEST_ASSERT_FALSE(regressor_is_valid(&config));
    ask_for_regressor();
    config.regressor.low_pass.of = CHANNEL_SUDDEN;
    TEST_ASSERT_FALSE(regressor_is_valid(&config));
    config = make_config();
    TEST_ASSERT_TRUE(regressor_is_valid(&config));
}

static void test_each_limit_on_what_is_explained_is_bounded(void) {
    explained_config_t *const payload = &config.task[TASK_PAYLOAD].limits;
    explained_config_t *const contact = &config.task[TASK_CONTACT].limits;
    num_t *const positive[] = {&payload->mass_max_kg,
                               &payload->force_slack_n,
                               &payload->moment_slack_nm,
                               &contact->force_max_n,
                               &contact->moment_max_nm,
                               &config.acceleration.error_max,
                               &config.acceleration.force_floor_n};
    for (size_t i = 0; i < sizeof(positive) / sizeof(positive[0]); ++i) {
        assert_number_refused(positive[i], NUM(0), GUARD_BAD_LIMITS);
        assert_number_refused(positive[i], NUM(402), GUARD_BAD_LIMITS);
    }
    assert_number_refused(&payload->arm_max_m, NUM(-0.01), GUARD_BAD_LIMITS);
    assert_number_refused(&payload->arm_max_m, NUM(1.01), GUARD_BAD_LIMITS);
    for (uint32_t t = TASK_NONE; t <= (uint32_t)TASK_CONTACT; ++t) {
        assert_number_refused(&config.task[t].limits.residual_max_nm[0], NUM(0), GUARD_BAD_LIMITS);
        assert_number_refused(&config.task[t].limits.residual_max_nm[0], NUM(500), GUARD_BAD_LIMITS);
    }
}

static void test_a_debounce_is_bounded_in_ticks_and_in_time(void) {
    uint32_t *const ticks = &config.task[TASK_NONE].detector.debounce_ticks;
    assert_word_refused(ticks, 0u, GUARD_BAD_TASK);
    assert_word_refused(ticks, (CONFIG_DEBOUNCE_MAX_US / PERIOD_US) + 1u, GUARD_BAD_TASK);
    assert_word_refused(ticks, UINT32_MAX, GUARD_BAD_TASK);
    *ticks = CONFIG_DEBOUNCE_MAX_US / PERIOD_US;
    assert_verdict(GUARD_OK);
}

/* A row that has no components has no fields of components either. */
static void test_a_task_without_components_has_zeros_in_their_place(void) {
    index_config_t *const index = &config.task[TASK_NONE].index;
    assert_word_refused(&index->kind, (uint32_t)INDEX_REGRESSOR + 1u, GUARD_BAD_TASK);
    assert_word_refused(&index->components, 1u, GUARD_BAD_TASK);
    assert_word_refused(&index->fast, 1u, GUARD_BAD_TASK);
    assert_word_refused(&index->frame, FRAME_BASE, GUARD_BAD_TASK);
    for (uint32_t a = 0; a < 3u; ++a) {
        assert_number_refused(&index->point[a], NUM(0.1), GUARD_BAD_TASK);
        for (uint32_t b = 0; b < 3u; ++b) {
            assert_number_refused(&index->axis[a][b], NUM(0.1), GUARD_BAD_TASK);
        }
    }
}

static void make_framed(void) {
    index_config_t *const index = &config.task[TASK_CONTACT].index;
    index->frame = FRAME_BASE;
    for (uint32_t a = 0; a < 3u; ++a) {
        index->axis[a][a] = NUM(1);
    }
}

static void test_each_number_of_a_frame_is_bounded(void) {
    index_config_t *const index = &config.task[TASK_CONTACT].index;
    make_framed();
    assert_verdict(GUARD_OK);
    for (uint32_t a = 0; a < 3u; ++a) {
        make_framed();
        assert_number_refused(&index->point[a], NUM(-1.01), GUARD_BAD_TASK);
        for (uint32_t b = 0; b < 3u; ++b) {
            make_framed();
            assert_number_refused(&index->axis[a][b], NUM(1.01), GUARD_BAD_TASK);
        }
    }
}

static void test_a_channel_of_sudden_may_stand_before_another_channel(void) {
    config.bank.channels = 3u;
    config.bank.channel[1] = config.bank.channel[0];
    config.bank.channel[2] = config.bank.channel[0];
    config.bank.channel[1].of = CHANNEL_SUDDEN;
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) {
        config.bank.channel[1].high_pass[g] = NUM(0.01) * (int32_t)(g + 1u);
    }
    config.task[TASK_CONTACT].index.fast = 7u;
    config.task[TASK_CONTACT].detector.channels = 7u;
    for (uint32_t i = 0; i < JOINTS; ++i) {
        config.task[TASK_CONTACT].detector.threshold_nm[1][i] = NUM(1);
        config.task[TASK_CONTACT].detector.threshold_nm[2][i] = NUM(1);
    }
    assert_verdict(GUARD_OK);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_reaction_is_that_of_the_fastest_watched_channel);
    RUN_TEST(test_each_constant_of_the_observer_is_bounded);
    RUN_TEST(test_each_constant_of_the_projection_is_bounded);
    RUN_TEST(test_each_correction_of_a_sensor_is_bounded_for_every_joint);
    RUN_TEST(test_each_number_of_a_links_shape_is_bounded);
    RUN_TEST(test_each_number_of_the_base_is_bounded);
    RUN_TEST(test_each_constant_of_a_channel_is_bounded_for_every_gap);
    RUN_TEST(test_a_channel_has_gain_one);
    RUN_TEST(test_each_condition_of_the_regressor_is_checked);
    RUN_TEST(test_each_limit_on_what_is_explained_is_bounded);
    RUN_TEST(test_a_debounce_is_bounded_in_ticks_and_in_time);
    RUN_TEST(test_a_task_without_components_has_zeros_in_their_place);
    RUN_TEST(test_each_number_of_a_frame_is_bounded);
    RUN_TEST(test_a_channel_of_sudden_may_stand_before_another_channel);
    return UNITY_END();
}
