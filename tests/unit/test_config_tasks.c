/* The guard accepts no task and no bank of filters that would make it blind. */
#include "config_fixture.h"

void setUp(void) {
    config = make_config();
}
void tearDown(void) {}

static void test_a_task_that_cannot_detect_is_refused(void) {
    config.task[TASK_PAYLOAD].detector.threshold_nm[0][6] = NUM(0);
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_PAYLOAD].detector.threshold_nm[0][0] = NUM(-1);
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_PAYLOAD].detector.threshold_nm[0][0] =
        config.robot.joint[0].torque_max_nm / 2; /* far above any harmless torque */
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_PAYLOAD].detector.debounce_ticks = 101u; /* more than a tenth of a second at 1 kHz */
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_PAYLOAD].detector.channels = 0u;
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_PAYLOAD].detector.channels = 2u; /* there is one channel */
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_NONE].detector.debounce_ticks = 0u;
    assert_status(GUARD_BAD_TASK);
    config.task[TASK_NONE].index.kind = INDEX_KIND_COUNT;
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

static void test_an_index_that_would_detect_nothing_is_refused_with_its_reason(void) {
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

static void test_fast_components_and_a_channel_of_sudden_need_each_other(void) {
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
    config.bank.channel[1].high_pass[0] = NUM(0.9); /* a step would vanish */
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

static void test_the_regressor_needs_a_task_and_a_plain_low_pass(void) {
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

static void test_a_user_defined_row_has_the_bounds_of_the_others(void) {
    config.task[6] = config.task[TASK_CONTACT];
    assert_status(GUARD_OK);
    config.task[6] = config.task[TASK_CONTACT];
    config.task[6].detector.threshold_nm[0][0] = NUM(0);
    assert_status(GUARD_BAD_TASK);
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

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_contact_has_axes_at_right_angles_and_a_point_within_a_metre);
    RUN_TEST(test_fast_components_and_a_channel_of_sudden_need_each_other);
    RUN_TEST(test_the_regressor_needs_a_task_and_a_plain_low_pass);
    RUN_TEST(test_a_contact_of_few_components_serves_an_arm_of_few_joints);
    RUN_TEST(test_a_user_defined_row_has_the_bounds_of_the_others);
    RUN_TEST(test_limits_on_what_is_explained_are_bounded);
    RUN_TEST(test_a_channel_that_passes_nothing_or_too_much_is_refused);
    RUN_TEST(test_a_task_that_cannot_detect_is_refused);
    RUN_TEST(test_an_index_that_would_detect_nothing_is_refused_with_its_reason);
    return UNITY_END();
}
