/* Which configuration blocks the guard accepts, and the reason for each that it refuses. */
#include "config_bounds.h"
#include "guard_fixture.h"

static guard_config_t config;

void setUp(void) {
    config = make_config();
}
void tearDown(void) {}

static void assert_status(guard_status_t expected) {
    guard_t guard;
    seal_config(&config);
    TEST_ASSERT_EQUAL(expected, config_check(&config));
    TEST_ASSERT_EQUAL(expected, guard_init(&guard, &config));
    TEST_ASSERT_EQUAL((expected == GUARD_OK) ? GUARD_STATE_SELF_TEST : GUARD_STATE_UNINITIALISED, guard.state);
    config = make_config();
}

static void test_a_good_block_is_accepted(void) {
    assert_status(GUARD_OK);
}

static void test_a_foreign_block_is_refused_by_what_is_foreign(void) {
    config.magic ^= 1u;
    assert_status(GUARD_BAD_MAGIC);
    config.schema += 1u;
    assert_status(GUARD_BAD_SCHEMA);
    config.size -= 4u;
    assert_status(GUARD_BAD_SIZE);
    config.numeric = 3u - NUM_NUMERIC;
    assert_status(GUARD_BAD_NUMERIC);
    config.wire ^= 1u;
    assert_status(GUARD_BAD_WIRE);
}

static void test_any_flipped_bit_is_refused(void) {
    for (uint32_t bit = 0; bit < 8u * sizeof(config); ++bit) {
        ((uint8_t *)&config)[bit / 8u] ^= (uint8_t)(1u << (bit % 8u));
        TEST_ASSERT_NOT_EQUAL(GUARD_OK, config_check(&config));
        ((uint8_t *)&config)[bit / 8u] ^= (uint8_t)(1u << (bit % 8u));
    }
    TEST_ASSERT_EQUAL(GUARD_OK, config_check(&config));
}

static void test_timing_that_cannot_hold_is_refused(void) {
    uint32_t *const positive[] = {&config.period_us,        &config.sync_deadline_us, &config.joint_deadline_us,
                                  &config.task_deadline_us, &config.tick_deadline_us, &config.tick_budget_us,
                                  &config.reset_healthy_us, &config.format,           &config.settling_us,
                                  &config.task_dwell_cycles};
    for (size_t i = 0; i < sizeof(positive) / sizeof(positive[0]); ++i) {
        *positive[i] = 0u;
        assert_status(GUARD_BAD_TIMING);
    }
    config.sync_deadline_us = PERIOD_US - 1u;
    assert_status(GUARD_BAD_TIMING);
    config.joint_deadline_us = (CONFIG_MAX_GAP + 1u) * PERIOD_US; /* more than one observer step can bridge */
    assert_status(GUARD_BAD_TIMING);
    config.format = FORMAT_FD + 1u;
    assert_status(GUARD_BAD_TIMING);
}

/* No deadline, period or waiting time may be so long that the guard detects a person too late. */
static void test_times_that_make_the_guard_blind_are_refused(void) {
    uint32_t *const times[] = {&config.period_us,        &config.sync_deadline_us, &config.joint_deadline_us,
                               &config.task_deadline_us, &config.tick_deadline_us, &config.tick_budget_us,
                               &config.settling_us,      &config.task_dwell_cycles};
    for (size_t i = 0; i < sizeof(times) / sizeof(times[0]); ++i) {
        *times[i] = UINT32_MAX; /* 71 minutes */
        assert_status(GUARD_BAD_TIMING);
        *times[i] = 10u * 1000u * PERIOD_US;
        assert_status(GUARD_BAD_TIMING);
    }
    config.task_deadline_us = 16u * PERIOD_US; /* the counter cannot distinguish 16 cycles from none */
    assert_status(GUARD_BAD_TIMING);
    config.reset_healthy_us = config.settling_us - 1u;
    assert_status(GUARD_BAD_TIMING);
}

static void test_a_task_that_cannot_detect_is_refused(void) {
    config.task[TASK_PAYLOAD].detector.threshold_nm[0][6] = NUM(0);
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_PAYLOAD].detector.threshold_nm[0][0] = NUM(-1);
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_PAYLOAD].detector.threshold_nm[0][0] =
        config.robot.joint[0].torque_max_nm / 2; /* no person survives that */
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_PAYLOAD].detector.debounce_ticks = 101u; /* more than a tenth of a second at 1 kHz */
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_PAYLOAD].detector.channels = 0u;
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_PAYLOAD].detector.channels = 2u; /* there is one channel */
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_NONE].detector.debounce_ticks = 0u;
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_NONE].index.kind = INDEX_REGRESSOR + 1u;
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_CONTACT].index.components = 0u;
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_INVALID].index.kind = INDEX_RESIDUAL;
    assert_status(GUARD_BAD_TASK);
    for (uint32_t t = 0; t < TASK_COUNT; ++t) {
        config.task[t].index = (index_config_t){0};
    }
    assert_status(GUARD_BAD_TASK);
}

static void shorten(uint32_t joints) {
    config.robot.joint_count = joints;
    memset(&config.robot.joint[joints], 0, (ROBOT_MAX_JOINTS - joints) * sizeof(robot_joint_t));
}

static void test_an_index_that_would_see_nothing_is_refused_with_its_reason(void) {
    for (uint32_t joints = 1; joints <= JOINTS; ++joints) {
        shorten(joints);
        assert_status((joints < 7u) ? ((joints < 6u) ? GUARD_PAYLOAD_NEEDS_6_JOINTS : GUARD_CONTACT_NEEDS_JOINTS)
                                    : GUARD_OK);
        shorten(joints);
        config.task[TASK_PAYLOAD].index = (index_config_t){0};
        config.task[TASK_CONTACT].index = (index_config_t){0};
        assert_status(GUARD_OK);
    }
}

static void test_a_robot_table_that_cannot_be_walked_is_refused(void) {
    config.robot.joint_count = 0u;
    assert_status(GUARD_BAD_ROBOT);
    config.robot.joint_count = ROBOT_MAX_JOINTS + 1u;
    assert_status(GUARD_BAD_ROBOT);
    config.robot.joint[7].inertia_zz = NUM(1); /* after the last joint */
    assert_status(GUARD_BAD_ROBOT);
    config.robot.joint[2].cos_twist = NUM(0.5);
    assert_status(GUARD_BAD_ROBOT);
    config.robot.base[1][1] = NUM(2);
    assert_status(GUARD_BAD_ROBOT);
    config.robot.joint[3].position_max_rad = config.robot.joint[3].position_min_rad;
    assert_status(GUARD_BAD_ROBOT);
    config.robot.joint[3].velocity_max_rad_s = NUM(0);
    assert_status(GUARD_BAD_ROBOT);
    config.robot.joint[0].torque_max_nm = NUM(0);
    assert_status(GUARD_BAD_ROBOT);
}

static void test_an_observer_that_is_no_low_pass_is_refused(void) {
    config.observer.decay[0] = NUM(1.0);
    assert_status(GUARD_BAD_OBSERVER);
    config.observer.gain[3] = NUM(-0.1);
    assert_status(GUARD_BAD_OBSERVER);
    config.observer.momentum_gain[1] = NUM(0);
    assert_status(GUARD_BAD_OBSERVER);
    config.observer.torque_sample = 0u;
    assert_status(GUARD_BAD_OBSERVER);
}

static void test_a_projection_without_tolerance_is_refused(void) {
    config.subspace.tolerance = NUM(0);
    assert_status(GUARD_BAD_SUBSPACE);
    config.subspace.lever_m = NUM(0);
    assert_status(GUARD_BAD_SUBSPACE);
    config.subspace.order = 3u;
    assert_status(GUARD_BAD_SUBSPACE);
    config.subspace.softness = config.subspace.tolerance / 2;
    assert_status(GUARD_BAD_SUBSPACE);
}

static void test_a_soft_projector_needs_a_tolerance_that_fixed_point_resolves(void) {
    config.subspace.tolerance = NUM(0.003);
    assert_status(GUARD_BAD_SUBSPACE);
    config.subspace.tolerance = NUM(0.003);
    config.subspace.projector = PROJECTOR_HARD;
    assert_status(GUARD_OK);
    config.subspace.projector = 0u;
    assert_status(GUARD_BAD_SUBSPACE);
    config.subspace.projector = PROJECTOR_SOFT + 1u;
    assert_status(GUARD_BAD_SUBSPACE);
}

static void make_framed(index_frame_t frame) {
    index_config_t *const index = &config.task[TASK_CONTACT].index;
    index->frame = (uint32_t)frame;
    for (uint32_t a = 0; a < 3u; ++a) {
        index->axis[a][a] = NUM(1);
        index->point[a] = NUM(0.5);
    }
}

static void test_a_contact_has_axes_at_right_angles_and_a_point_within_a_metre(void) {
    index_config_t *const index = &config.task[TASK_CONTACT].index;
    make_framed(FRAME_TOOL);
    assert_status(GUARD_OK);
    make_framed(FRAME_BASE);
    assert_status(GUARD_OK);
    make_framed(FRAME_TIP); /* which has neither axes nor a point */
    assert_status(GUARD_BAD_TASK);
    make_framed((index_frame_t)(FRAME_TOOL + 1));
    assert_status(GUARD_BAD_TASK);
    make_framed(FRAME_TOOL);
    index->point[2] = NUM(1.01);
    assert_status(GUARD_BAD_TASK);
    make_framed(FRAME_TOOL);
    index->axis[1][1] = NUM(0.9);
    assert_status(GUARD_BAD_TASK);
    make_framed(FRAME_TOOL);
    index->axis[1][0] = NUM(0.1);
    assert_status(GUARD_BAD_TASK);
    make_framed(FRAME_TOOL);
    index->axis[2][2] = NUM(2);
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_PAYLOAD].index.point[0] = NUM(0.1);
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_PAYLOAD].index.fast = 1u;
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_CONTACT].index.components = INDEX_ALL_COMPONENTS + 1u;
    assert_status(GUARD_BAD_TASK);
}

static void make_sudden(uint32_t fast, uint32_t channels) {
    config.bank.channels = 2u;
    config.bank.channel[1] = config.bank.channel[0];
    config.bank.channel[1].of = CHANNEL_SUDDEN;
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) {
        config.bank.channel[1].high_pass[g] = NUM(0.01) * (int32_t)(g + 1u);
    }
    config.task[TASK_CONTACT].index.fast = fast;
    config.task[TASK_CONTACT].detector.channels = channels;
    for (uint32_t i = 0; i < JOINTS; ++i) {
        config.task[TASK_CONTACT].detector.threshold_nm[1][i] = NUM(1);
    }
}

static void test_fast_components_and_a_channel_of_sudden_go_together(void) {
    make_sudden(7u, 3u);
    assert_status(GUARD_OK);
    make_sudden(7u, 1u); /* no channel uses them */
    assert_status(GUARD_BAD_TASK);
    make_sudden(0u, 3u); /* the channel would have no input */
    assert_status(GUARD_BAD_TASK);
    make_sudden(7u, 2u); /* a constant force would not be detected */
    assert_status(GUARD_BAD_BANK);
    make_sudden(7u, 3u);
    config.task[TASK_CONTACT].index.components = 3u; /* the third is fast and not explained */
    assert_status(GUARD_BAD_TASK);
    make_sudden(7u, 3u);
    config.subspace.projector = PROJECTOR_HARD;
    assert_status(GUARD_BAD_TASK);
    make_sudden(7u, 3u);
    config.bank.channel[1].high_pass[0] = NUM(0.9); /* nothing is left of a step */
    assert_status(GUARD_BAD_BANK);
    make_sudden(7u, 3u);
    config.bank.channel[1].high_pass[0] = NUM(0);
    assert_status(GUARD_BAD_BANK);
    make_sudden(7u, 3u);
    config.bank.channel[1].of = CHANNEL_SUDDEN + 1u;
    assert_status(GUARD_BAD_BANK);
}

static void ask_for_regressor(void) {
    config.task[TASK_PAYLOAD].index.kind = INDEX_REGRESSOR;
    config.regressor.used = 1u;
    config.regressor.low_pass = config.bank.channel[0];
}

static void test_the_regressor_is_used_by_a_task_behind_a_plain_low_pass(void) {
    ask_for_regressor();
    assert_status(GUARD_OK);
    ask_for_regressor();
    config.regressor.used = 0u;
    assert_status(GUARD_BAD_BANK);
    ask_for_regressor();
    config.regressor.used = 2u;
    assert_status(GUARD_BAD_BANK);
    ask_for_regressor();
    config.task[TASK_PAYLOAD].index.kind = INDEX_PAYLOAD; /* unused */
    assert_status(GUARD_BAD_BANK);
    ask_for_regressor();
    config.subspace.projector = PROJECTOR_HARD;
    assert_status(GUARD_BAD_BANK);
    ask_for_regressor();
    config.subspace.order = ORDER_FILTER_FIRST;
    assert_status(GUARD_BAD_BANK);
    ask_for_regressor();
    config.regressor.low_pass.in[0] = NUM(2); /* twice the torque */
    assert_status(GUARD_BAD_BANK);
    ask_for_regressor();
    config.regressor.low_pass.high_pass[0] = NUM(0.01);
    assert_status(GUARD_BAD_BANK);
    ask_for_regressor();
    config.task[TASK_PAYLOAD].limits.mass_max_kg = NUM(51);
    assert_status(GUARD_BAD_LIMITS);
    ask_for_regressor();
    const uint32_t reaction = config_reaction_us(&config);
    config = make_config();
    TEST_ASSERT_EQUAL(14u * PERIOD_US, reaction - config_reaction_us(&config)); /* its own rise is added */
}

static void test_a_contact_of_few_components_serves_an_arm_of_few_joints(void) {
    shorten(6u);
    config.task[TASK_CONTACT].index.components = 7u;
    assert_status(GUARD_OK);
    shorten(4u);
    config.task[TASK_PAYLOAD].index = (index_config_t){0};
    config.task[TASK_CONTACT].index.components = 7u;
    assert_status(GUARD_OK);
    shorten(3u);
    config.task[TASK_PAYLOAD].index = (index_config_t){0};
    config.task[TASK_CONTACT].index.components = 7u;
    assert_status(GUARD_CONTACT_NEEDS_JOINTS);
}

static void test_a_row_of_ones_own_is_bounded_as_the_others_are(void) {
    config.task[6] = config.task[TASK_CONTACT];
    assert_status(GUARD_OK);
    config.task[6] = config.task[TASK_CONTACT];
    config.task[6].detector.threshold_nm[0][0] = NUM(0);
    assert_status(GUARD_BAD_TASK);
}

static void test_an_observer_that_is_too_slow_or_of_another_period_is_refused(void) {
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) { /* K = 0.001 1/s */
        config.observer.gain[g] = NUM(1e-6) * (int32_t)(g + 1u);
        config.observer.decay[g] = NUM(1) - config.observer.gain[g];
        config.observer.momentum_gain[g] = NUM(0.001);
    }
    assert_status(GUARD_BAD_OBSERVER);
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) { /* of half the period */
        config.observer.momentum_gain[g] = config.observer.momentum_gain[g] * 2;
    }
    assert_status(GUARD_BAD_OBSERVER);
    config.settling_us = 20u * PERIOD_US; /* one time constant is not five */
    assert_status(GUARD_BAD_OBSERVER);
    config.observer.decay[2] = config.observer.decay[1];
    config.observer.gain[2] = config.observer.gain[1];
    assert_status(GUARD_BAD_OBSERVER);
}

static void test_limits_on_what_is_explained_are_bounded(void) {
    config.task[TASK_CONTACT].limits.force_max_n = NUM(401);
    assert_status(GUARD_BAD_LIMITS);
    config.task[TASK_CONTACT].limits.moment_max_nm = NUM(0);
    assert_status(GUARD_BAD_LIMITS);
    config.task[TASK_PAYLOAD].limits.mass_max_kg = NUM(51);
    assert_status(GUARD_BAD_LIMITS);
    config.task[TASK_PAYLOAD].limits.force_slack_n = NUM(61);
    assert_status(GUARD_BAD_LIMITS);
    config.task[TASK_NONE].limits.residual_max_nm[6] = NUM(0);
    assert_status(GUARD_BAD_LIMITS);
    config.acceleration.error_max = NUM(11);
    assert_status(GUARD_BAD_LIMITS);
}

static void test_a_channel_that_passes_nothing_or_too_much_is_refused(void) {
    config.bank.channels = 0u;
    assert_status(GUARD_BAD_BANK);
    config.bank.channels = BANK_MAX_CHANNELS + 1u;
    assert_status(GUARD_BAD_BANK);
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) {
        config.bank.channel[0].in[g] = NUM(0.5); /* half of every torque */
    }
    assert_status(GUARD_BAD_BANK);
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) {
        config.bank.channel[0].in[g] = NUM(2); /* doubled */
    }
    assert_status(GUARD_BAD_BANK);
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) {
        config.bank.channel[0].high_pass[g] = NUM(0.01); /* the only channel: a constant force is not detected */
    }
    assert_status(GUARD_BAD_BANK);
    config.bank.channel[0].own[2] = NUM(3);
    assert_status(GUARD_BAD_BANK);
}

/* 0.95^k is 0.5 at k = 14. The debounce, the sample's age, the joint deadline and the tick deadline are added. */
static void test_the_worst_case_reaction_time_is_the_sum_of_its_parts(void) {
    TEST_ASSERT_EQUAL((1u + 14u + 2u + DEADLINE_CYCLES + 5u) * PERIOD_US, config_reaction_us(&config));
    config.period_us =
        CONFIG_PERIOD_MAX_US; /* 20 Hz with constants of 1 kHz would violate other bounds, so every part is slow */
    TEST_ASSERT_TRUE(config_reaction_us(&config) > CONFIG_REACTION_MAX_US);
    config = make_config();
}

static void test_an_unknown_stop_category_is_refused(void) {
    config.stop_collision = 3u;
    assert_status(GUARD_BAD_STOP);
    config.stop_input = 2u; /* only a collision may stop with the power on */
    assert_status(GUARD_BAD_STOP);
    config.stop_fault = 2u;
    assert_status(GUARD_BAD_STOP);
}

static void test_numbers_that_are_none_are_refused(void) {
#ifdef TAUPERP_FIXED
    const num_t nan = INT32_MIN; /* every pattern is a number there; this one has no negative */
    const num_t infinity = INT32_MIN;
#else
    const float nan = 0.0f / 0.0f;
    const float infinity = 1.0f / 0.0f;
#endif
    config.task[TASK_NONE].detector.threshold_nm[0][1] = infinity; /* would never trip */
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_NONE].detector.threshold_nm[0][1] = nan;
    assert_status(GUARD_BAD_TASK);
    config.robot.joint[1].sin_twist = nan;
    assert_status(GUARD_BAD_ROBOT);
    config.observer.momentum_gain[2] = infinity;
    assert_status(GUARD_BAD_OBSERVER);
    config.subspace.tolerance = infinity; /* nothing would count as explained */
    assert_status(GUARD_BAD_SUBSPACE);
}

static void test_the_watch_sees_a_change_within_one_round(void) {
    config_watch_t watch;
    config_watch_start(&watch);
    const uint32_t round = (uint32_t)(sizeof(config) / CONFIG_WATCH_BYTES) + 1u;
    for (uint32_t i = 0; i < 3u * round; ++i) {
        TEST_ASSERT_TRUE(config_watch_step(&watch, &config));
    }
    config.task[TASK_NONE].detector.threshold_nm[0][0] = NUM(100);
    bool intact = true;
    for (uint32_t i = 0; i < 2u * round; ++i) {
        intact = intact && config_watch_step(&watch, &config);
    }
    TEST_ASSERT_FALSE(intact);
    watch.offset = 3u;
    TEST_ASSERT_FALSE(config_watch_step(&watch, &config));
}

static void test_a_sensor_correction_beyond_its_bounds_is_refused(void) {
    config.sensor.offset_nm[2] = NUM(65);
    assert_status(GUARD_BAD_SENSOR);
    config.sensor.friction_nm[7] = NUM(-1);
    assert_status(GUARD_BAD_SENSOR);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_good_block_is_accepted);
    RUN_TEST(test_a_soft_projector_needs_a_tolerance_that_fixed_point_resolves);
    RUN_TEST(test_a_contact_has_axes_at_right_angles_and_a_point_within_a_metre);
    RUN_TEST(test_fast_components_and_a_channel_of_sudden_go_together);
    RUN_TEST(test_the_regressor_is_used_by_a_task_behind_a_plain_low_pass);
    RUN_TEST(test_a_contact_of_few_components_serves_an_arm_of_few_joints);
    RUN_TEST(test_a_row_of_ones_own_is_bounded_as_the_others_are);
    RUN_TEST(test_a_foreign_block_is_refused_by_what_is_foreign);
    RUN_TEST(test_any_flipped_bit_is_refused);
    RUN_TEST(test_timing_that_cannot_hold_is_refused);
    RUN_TEST(test_times_that_make_the_guard_blind_are_refused);
    RUN_TEST(test_an_observer_that_is_too_slow_or_of_another_period_is_refused);
    RUN_TEST(test_limits_on_what_is_explained_are_bounded);
    RUN_TEST(test_a_channel_that_passes_nothing_or_too_much_is_refused);
    RUN_TEST(test_the_worst_case_reaction_time_is_the_sum_of_its_parts);
    RUN_TEST(test_a_task_that_cannot_detect_is_refused);
    RUN_TEST(test_an_index_that_would_see_nothing_is_refused_with_its_reason);
    RUN_TEST(test_a_robot_table_that_cannot_be_walked_is_refused);
    RUN_TEST(test_an_observer_that_is_no_low_pass_is_refused);
    RUN_TEST(test_a_projection_without_tolerance_is_refused);
    RUN_TEST(test_an_unknown_stop_category_is_refused);
    RUN_TEST(test_a_sensor_correction_beyond_its_bounds_is_refused);
    RUN_TEST(test_numbers_that_are_none_are_refused);
    RUN_TEST(test_the_watch_sees_a_change_within_one_round);
    return UNITY_END();
}
