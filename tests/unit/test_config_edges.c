/* Projection, stops, sensors and tasks of a configuration block: each bound from both sides. */
#include "config_edges.h"

void setUp(void) {
    config = make_config();
}
void tearDown(void) {}

/* --- projection, stops, sensors ----------------------------------------------------------------------------------- */

static void test_the_projection_has_its_bounds(void) {
    config.subspace.softness = NUM(0.2);
    config.subspace.tolerance = NUM(0.1);
    TEST_ASSERT_EQUAL(GUARD_OK, judged());
    config.subspace.softness = NUM(0.2);
    config.subspace.tolerance = STEP_UP(NUM(0.1));
    TEST_ASSERT_EQUAL(GUARD_BAD_SUBSPACE, judged());
    ASSERT_LIMIT(subspace.softness, NUM(0.2), STEP_UP(NUM(0.2)), GUARD_BAD_SUBSPACE);
    ASSERT_LIMIT(subspace.softness, config.subspace.tolerance, STEP_DOWN(config.subspace.tolerance),
                 GUARD_BAD_SUBSPACE);
    ASSERT_LIMIT(subspace.lever_m, NUM(1), STEP_UP(NUM(1)), GUARD_BAD_SUBSPACE);
    ASSERT_LIMIT(subspace.tolerance, NUM(0.004), STEP_DOWN(NUM(0.004)), GUARD_BAD_SUBSPACE);
    ASSERT_BOUND(subspace.order, ORDER_FILTER_FIRST, ORDER_FILTER_FIRST - 1u, GUARD_BAD_SUBSPACE);
}

static void test_only_a_collision_may_stop_with_the_power_on(void) {
    for (uint32_t category = 0; category <= 3u; ++category) {
        config.stop_collision = category;
        TEST_ASSERT_EQUAL((category <= 2u) ? GUARD_OK : GUARD_BAD_STOP, judged());
        config.stop_input = category;
        TEST_ASSERT_EQUAL((category <= 1u) ? GUARD_OK : GUARD_BAD_STOP, judged());
        config.stop_fault = category;
        TEST_ASSERT_EQUAL((category <= 1u) ? GUARD_OK : GUARD_BAD_STOP, judged());
    }
}

/* Limits of the arm: 200, 200, 120, 120, 60, 40, 40 Nm. */
static void test_a_sensor_is_off_by_at_most_a_quarter_of_its_range(void) {
    ASSERT_LIMIT(sensor.offset_nm[0], NUM(50), STEP_UP(NUM(50)), GUARD_BAD_SENSOR);
    ASSERT_LIMIT(sensor.offset_nm[6], NUM(-10), STEP_UP(NUM(-10)) - NUM(1e-5), GUARD_BAD_SENSOR);
    ASSERT_LIMIT(sensor.friction_nm[2], NUM(30), STEP_UP(NUM(30)), GUARD_BAD_SENSOR);
    ASSERT_LIMIT(sensor.friction_nm[6], NUM(10), STEP_UP(NUM(10)), GUARD_BAD_SENSOR);
}

static void test_a_sensor_that_the_arm_does_not_have_has_no_range(void) {
    config.sensor.offset_nm[JOINTS] = NUM(1);
    TEST_ASSERT_EQUAL(GUARD_OK, judged());
}

/* --- sight -------------------------------------------------------------------------------------------------------- */

static void test_a_blind_link_has_a_known_reaction_and_a_force(void) {
    ASSERT_LIMIT(sight.reaction, 2u, 3u, GUARD_BAD_SIGHT);
    ASSERT_LIMIT(sight.force_n, NUM(500), STEP_UP(NUM(500)), GUARD_BAD_SIGHT);
    ASSERT_LIMIT(sight.force_n, NUM(0.1), NUM(0), GUARD_BAD_SIGHT);
}

static void test_a_link_lies_within_4_m_of_its_frame(void) {
    for (uint32_t i = 0; i < JOINTS; i += JOINTS - 1u) {
        ASSERT_LIMIT(shape.half_m[i], NUM(4), STEP_UP(NUM(4)), GUARD_BAD_SIGHT);
        ASSERT_LIMIT(shape.half_m[i], NUM(0), NUM(-0.001), GUARD_BAD_SIGHT);
        for (uint32_t a = 0; a < 3u; ++a) {
            ASSERT_LIMIT(shape.middle[i][a], NUM(4), STEP_UP(NUM(4)), GUARD_BAD_SIGHT);
            ASSERT_LIMIT(shape.middle[i][a], NUM(-4), NUM(-4.001), GUARD_BAD_SIGHT);
        }
    }
    config.shape.half_m[JOINTS] = NUM(5); /* of a link that the arm does not have */
    TEST_ASSERT_EQUAL(GUARD_OK, judged());
}

static void test_a_task_needs_links_that_the_arm_has(void) {
    for (uint32_t t = 0; t < (uint32_t)TASK_COUNT; ++t) {
        ASSERT_LIMIT(task[t].needed_links, 0x7Fu, 0x80u, GUARD_BAD_SIGHT);
    }
}

/* --- tasks -------------------------------------------------------------------------------------------------------- */

static void test_a_threshold_is_positive_and_at_most_a_third_of_the_range(void) {
    for (uint32_t t = TASK_NONE; t <= (uint32_t)TASK_CONTACT; ++t) {
        ASSERT_LIMIT(task[t].detector.threshold_nm[0][2], NUM(40), STEP_UP(NUM(40)), GUARD_BAD_TASK);
        ASSERT_LIMIT(task[t].detector.threshold_nm[0][4], NUM(1e-3), NUM(0), GUARD_BAD_TASK);
    }
}

static void test_a_debounce_is_one_tick_to_a_tenth_of_a_second(void) {
    ASSERT_LIMIT(task[TASK_NONE].detector.debounce_ticks, 1u, 0u, GUARD_BAD_TASK);
    ASSERT_LIMIT(task[TASK_NONE].detector.debounce_ticks, 100u, 101u, GUARD_BAD_TASK);
    config.task[TASK_NONE].detector.debounce_ticks = 4294968u; /* of 1 ms: 704 us modulo 2^32 */
    TEST_ASSERT_EQUAL(GUARD_BAD_TASK, judged());
}

/* 11 ticks of 9,091 us are 100,001 us. At 20 Hz the third tick is too late. */
static void test_a_debounce_counts_in_microseconds(void) {
    static const double decay[CONFIG_MAX_GAP] = {0.5, 0.25, 0.125, 0.0625};
    static const uint32_t period_us[] = {9091u, 50000u}, most[] = {10u, 2u};
    for (uint32_t i = 0; i < 2u; ++i) {
        for (uint32_t more = 0; more < 2u; ++more) {
            make_timing(period_us[i]);
            make_observer(decay);
            for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) {
                config.observer.momentum_gain[g] = (num_t)NUM((1.0 - decay[g]) * 1e6 / ((g + 1.0) * period_us[i]));
            }
            config.settling_us = 8u * period_us[i];
            config.reset_healthy_us = 8u * period_us[i];
            config.task[TASK_NONE].detector.debounce_ticks = most[i] + more;
            TEST_ASSERT_EQUAL((more == 0u) ? GUARD_OK : GUARD_BAD_TASK, judged());
        }
    }
}

/* The last two channels of four; a task watches only the channels that it names. */
static void test_a_task_watches_channels_that_exist(void) {
    config.bank.channels = BANK_MAX_CHANNELS;
    for (uint32_t c = 1; c < BANK_MAX_CHANNELS; ++c) {
        config.bank.channel[c] = config.bank.channel[0];
    }
    config.task[TASK_NONE].detector.channels = 9u;
    config.task[TASK_NONE].detector.threshold_nm[3][1] = NUM(1);
    guard_config_t four = config;
    TEST_ASSERT_EQUAL(GUARD_BAD_TASK, judged()); /* six joints have no threshold in it */
    for (uint32_t i = 0; i < JOINTS; ++i) {
        four.task[TASK_NONE].detector.threshold_nm[3][i] = NUM(1);
    }
    config = four;
    TEST_ASSERT_EQUAL(GUARD_OK, judged());
    config = four;
    config.task[TASK_NONE].detector.channels = 16u;
    TEST_ASSERT_EQUAL(GUARD_BAD_TASK, judged());
    config = four;
    config.bank.channels = BANK_MAX_CHANNELS - 1u;
    TEST_ASSERT_EQUAL(GUARD_BAD_TASK, judged());
    config = four;
    config.bank.channel[3].in[0] = NUM(2);
    TEST_ASSERT_EQUAL(GUARD_BAD_BANK, judged());
}

/* Channel 0 is the fast one: a constant force is seen in channel 1. */
static void make_sudden_first(task_t task) {
    config.bank.channels = 2u;
    config.bank.channel[1] = config.bank.channel[0];
    config.bank.channel[0].of = CHANNEL_SUDDEN;
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) {
        config.bank.channel[0].high_pass[g] = NUM(0.01) * (num_t)(g + 1u);
    }
    for (uint32_t t = TASK_NONE; t <= (uint32_t)TASK_CONTACT; ++t) {
        memcpy(config.task[t].detector.threshold_nm[1], config.task[t].detector.threshold_nm[0],
               sizeof(config.task[t].detector.threshold_nm[1]));
        config.task[t].detector.channels = 2u;
    }
    config.task[task].index.fast = 1u;
    config.task[task].detector.channels = 3u;
}

static void test_the_order_of_the_channels_does_not_matter(void) {
    make_sudden_first(TASK_CONTACT);
    TEST_ASSERT_EQUAL(GUARD_OK, judged());
    make_sudden_first(TASK_CONTACT);
    config.task[TASK_CONTACT].detector.channels = 1u;
    TEST_ASSERT_EQUAL(GUARD_BAD_BANK, judged());
    make_sudden_first(TASK_CONTACT);
    config.task[TASK_CONTACT].detector.channels = 2u;
    TEST_ASSERT_EQUAL(GUARD_BAD_TASK, judged());
}

static void test_only_a_contact_has_fast_components(void) {
    make_sudden_first(TASK_PAYLOAD);
    TEST_ASSERT_EQUAL(GUARD_BAD_TASK, judged());
}

static void test_a_payload_by_its_regressor_needs_6_joints(void) {
    config.robot.joint_count = 5u;
    memset(&config.robot.joint[5], 0, 3u * sizeof(robot_joint_t));
    config.task[TASK_CONTACT].index = (index_config_t){0};
    config.task[TASK_PAYLOAD].index.kind = INDEX_REGRESSOR;
    config.regressor.used = 1u;
    config.regressor.low_pass = config.bank.channel[0];
    TEST_ASSERT_EQUAL(GUARD_PAYLOAD_NEEDS_6_JOINTS, judged());
}

static void test_a_task_without_columns_has_no_limits_on_them(void) {
    config.task[TASK_NONE].limits.force_max_n = NUM(0);
    config.task[TASK_NONE].limits.mass_max_kg = NUM(0);
    TEST_ASSERT_EQUAL(GUARD_OK, judged());
}

static void test_the_limits_of_a_payload(void) {
    const uint32_t t = TASK_PAYLOAD;
    ASSERT_LIMIT(task[t].limits.mass_max_kg, NUM(50), STEP_UP(NUM(50)), GUARD_BAD_LIMITS);
    ASSERT_LIMIT(task[t].limits.mass_max_kg, NUM(0.1), NUM(0), GUARD_BAD_LIMITS);
    ASSERT_LIMIT(task[t].limits.arm_max_m, NUM(1), STEP_UP(NUM(1)), GUARD_BAD_LIMITS);
    ASSERT_LIMIT(task[t].limits.arm_max_m, NUM(0), NUM(-1e-3), GUARD_BAD_LIMITS);
    ASSERT_LIMIT(task[t].limits.force_slack_n, NUM(60), STEP_UP(NUM(60)), GUARD_BAD_LIMITS);
    ASSERT_LIMIT(task[t].limits.force_slack_n, NUM(0.1), NUM(0), GUARD_BAD_LIMITS);
    ASSERT_LIMIT(task[t].limits.moment_slack_nm, NUM(20), STEP_UP(NUM(20)), GUARD_BAD_LIMITS);
    ASSERT_LIMIT(task[t].limits.moment_slack_nm, NUM(0.1), NUM(0), GUARD_BAD_LIMITS);
}

/* A moment counts over the lever of 0.1 m: 401 N x 0.1 m. */
static void test_the_limits_of_a_contact(void) {
    const uint32_t t = TASK_CONTACT;
    ASSERT_LIMIT(task[t].limits.force_max_n, NUM(400), STEP_UP(NUM(400)), GUARD_BAD_LIMITS);
    ASSERT_LIMIT(task[t].limits.force_max_n, NUM(0.1), NUM(0), GUARD_BAD_LIMITS);
    ASSERT_LIMIT(task[t].limits.moment_max_nm, NUM(40.0999), NUM(40.1001), GUARD_BAD_LIMITS);
    ASSERT_LIMIT(task[t].limits.moment_max_nm, NUM(0.1), NUM(0), GUARD_BAD_LIMITS);
}

static void test_the_limits_of_every_task(void) {
    for (uint32_t t = TASK_NONE; t <= (uint32_t)TASK_CONTACT; ++t) {
        ASSERT_LIMIT(task[t].limits.residual_max_nm[5], NUM(80), NUM(80.01), GUARD_BAD_LIMITS);
        ASSERT_LIMIT(task[t].limits.residual_max_nm[6], NUM(1), NUM(0), GUARD_BAD_LIMITS);
        ASSERT_LIMIT(task[t].limits.residual_max_nm[0], NUM(1), NUM(0), GUARD_BAD_LIMITS);
    }
    ASSERT_LIMIT(acceleration.force_floor_n, NUM(20), STEP_UP(NUM(20)), GUARD_BAD_LIMITS);
    ASSERT_LIMIT(acceleration.force_floor_n, NUM(0.1), NUM(0), GUARD_BAD_LIMITS);
    ASSERT_LIMIT(acceleration.error_max, NUM(10), STEP_UP(NUM(10)), GUARD_BAD_LIMITS);
    ASSERT_LIMIT(acceleration.error_max, NUM(0.1), NUM(0), GUARD_BAD_LIMITS);
}

static void make_framed(void) {
    index_config_t *const index = &config.task[TASK_CONTACT].index;
    index->frame = FRAME_BASE;
    index->axis[0][0] = NUM(0.6); /* no axis along one of the frame */
    index->axis[0][1] = NUM(0.8);
    index->axis[1][0] = NUM(-0.8);
    index->axis[1][1] = NUM(0.6);
    index->axis[2][2] = NUM(1);
}

static void test_axes_are_unit_vectors_at_right_angles_within_1e_4(void) {
    index_config_t *const index = &config.task[TASK_CONTACT].index;
    for (uint32_t a = 0; a < 3u; ++a) {
        for (uint32_t b = 0; b < 3u; ++b) {
            make_framed();
            index->axis[a][b] += NUM(0.00004);
            TEST_ASSERT_EQUAL(GUARD_OK, judged());
            make_framed();
            index->axis[a][b] += NUM(0.0003);
            TEST_ASSERT_EQUAL(GUARD_BAD_TASK, judged());
            make_framed();
            index->axis[a][b] -= NUM(0.0003);
            TEST_ASSERT_EQUAL(GUARD_BAD_TASK, judged());
        }
        make_framed();
        index->point[a] = NUM(1);
        TEST_ASSERT_EQUAL(GUARD_OK, judged());
        make_framed();
        index->point[a] = NUM(-1);
        TEST_ASSERT_EQUAL(GUARD_OK, judged());
        make_framed();
        index->point[a] = NUM(-1.001);
        TEST_ASSERT_EQUAL(GUARD_BAD_TASK, judged());
    }
}

/* In Q9.22 the sum of these squares is beyond 64 bits. */
static void test_axes_of_any_length_are_refused_without_overflow(void) {
    make_framed();
    for (uint32_t b = 0; b < 3u; ++b) {
        config.task[TASK_CONTACT].index.axis[0][b] = NUM(511.9999);
    }
    TEST_ASSERT_EQUAL(GUARD_BAD_TASK, judged());
}

static void test_a_contact_at_the_tip_has_neither_axes_nor_a_point(void) {
    for (uint32_t t = TASK_NONE; t <= (uint32_t)TASK_CONTACT; ++t) {
        for (uint32_t a = 0; a < 3u; ++a) {
            config.task[t].index.point[a] = NUM(0.1);
            TEST_ASSERT_EQUAL(GUARD_BAD_TASK, judged());
            for (uint32_t b = 0; b < 3u; ++b) {
                config.task[t].index.axis[a][b] = NUM(0.1);
                TEST_ASSERT_EQUAL(GUARD_BAD_TASK, judged());
            }
        }
    }
}

static void test_what_is_no_contact_has_no_parts_of_one(void) {
    index_config_t *const index = &config.task[TASK_PAYLOAD].index;
    index->components = 1u;
    TEST_ASSERT_EQUAL(GUARD_BAD_TASK, judged());
    index->fast = 1u;
    TEST_ASSERT_EQUAL(GUARD_BAD_TASK, judged());
    index->frame = FRAME_BASE;
    TEST_ASSERT_EQUAL(GUARD_BAD_TASK, judged());
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_projection_has_its_bounds);
    RUN_TEST(test_only_a_collision_may_stop_with_the_power_on);
    RUN_TEST(test_a_sensor_is_off_by_at_most_a_quarter_of_its_range);
    RUN_TEST(test_a_threshold_is_positive_and_at_most_a_third_of_the_range);
    RUN_TEST(test_a_debounce_is_one_tick_to_a_tenth_of_a_second);
    RUN_TEST(test_a_task_watches_channels_that_exist);
    RUN_TEST(test_the_limits_of_a_payload);
    RUN_TEST(test_the_limits_of_a_contact);
    RUN_TEST(test_the_limits_of_every_task);
    RUN_TEST(test_axes_are_unit_vectors_at_right_angles_within_1e_4);
    RUN_TEST(test_a_contact_at_the_tip_has_neither_axes_nor_a_point);
    RUN_TEST(test_what_is_no_contact_has_no_parts_of_one);
    RUN_TEST(test_a_sensor_that_the_arm_does_not_have_has_no_range);
    RUN_TEST(test_a_debounce_counts_in_microseconds);
    RUN_TEST(test_the_order_of_the_channels_does_not_matter);
    RUN_TEST(test_only_a_contact_has_fast_components);
    RUN_TEST(test_a_payload_by_its_regressor_needs_6_joints);
    RUN_TEST(test_a_task_without_columns_has_no_limits_on_them);
    RUN_TEST(test_axes_of_any_length_are_refused_without_overflow);
    RUN_TEST(test_a_blind_link_has_a_known_reaction_and_a_force);
    RUN_TEST(test_a_link_lies_within_4_m_of_its_frame);
    RUN_TEST(test_a_task_needs_links_that_the_arm_has);
    return UNITY_END();
}
