/* The links on which an index detects a force, and the effect of a blind link on the permission. */
#include "sight.h"

#include "core_fixture.h"
#include "robots.h"
#include "vec3.h"

#define N 7u

static const robot_t *robot;
static motion_t motion;
static observer_t observer;
static acceleration_t measured;
static regressor_t regressor;
static index_t index_state;
static sight_t sight;
static sight_config_t config;
static lever_config_t shape;
static bank_config_t bank;
static detector_config_t detector;
static subspace_config_t subspace;
static index_config_t task;
static num_t pose[ROBOT_MAX_JOINTS];

void setUp(void) {
    const double q[N] = {0.3, 0.8, -0.4, -1.3, 0.6, 0.9, 0.2};
    robot = &robot_ku_dex;
    motion_init(&motion);
    observer_init(&observer);
    acceleration_init(&measured);
    regressor_init(&regressor);
    index_init(&index_state);
    sight_init(&sight, N);
    observer.gap = 1u;
    config = (sight_config_t){.force_n = NUM(100)};
    shape = (lever_config_t){0};
    bank = (bank_config_t){.channels = 1u};
    detector = (detector_config_t){.debounce_ticks = 1u, .channels = 1u};
    subspace = (subspace_config_t){.order = (uint32_t)ORDER_PROJECT_FIRST,
                                   .projector = (uint32_t)PROJECTOR_SOFT,
                                   .tolerance = NUM(0.005),
                                   .lever_m = NUM(0.1),
                                   .softness = NUM(0.05)};
    task = (index_config_t){.kind = (uint32_t)INDEX_RESIDUAL};
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        pose[i] = (i < N) ? num_of(q[i]) : NUM(0);
        detector.threshold_nm[0][i] = NUM(2);
        for (uint32_t a = 0; a < 3u; ++a) {
            shape.middle[i][a] = (a == 2u) ? NUM(0.1) : NUM(0.05);
        }
    }
}
void tearDown(void) {}

static void steps(uint32_t count) {
    const num_t still[ROBOT_MAX_JOINTS] = {NUM(0)};
    for (uint32_t i = 0; i < count; ++i) {
        motion_step(&motion, robot, pose, still);
        index_step(&index_state, &subspace, &task, robot, &motion, &observer, &measured, &regressor);
        sight_step(&sight, &config, &shape, N, &motion, &index_state, &bank, &detector, 1u);
    }
}

/* The torque of a unit force on a link's middle by finite differences of the middle's position. */
static void test_a_lever_is_the_derivative_of_the_middles_height(void) {
    const num_t still[ROBOT_MAX_JOINTS] = {NUM(0)};
    const vec3_t none = {NUM(0), NUM(0), NUM(0)};
    const vec3_t up = {NUM(0), NUM(0), NUM(1)};
    for (uint32_t link = 0; link < N; ++link) {
        num_t torque[ROBOT_MAX_JOINTS];
        uint32_t held = 0;
        motion.watched = link;
        motion_step(&motion, robot, pose, still);
        lever_torque(&motion, lever_arm(&motion, &shape, &held), up, none, torque, &held);
        for (uint32_t i = 0; i < N; ++i) {
            double height[2];
            for (uint32_t side = 0; side < 2u; ++side) {
                num_t moved[ROBOT_MAX_JOINTS];
                memcpy(moved, pose, sizeof(moved));
                moved[i] = num_of(value_of(pose[i]) + ((side == 0u) ? 0.01 : -0.01));
                motion_step(&motion, robot, moved, still);
                height[side] = value_of(vec3_add(motion.tip, lever_arm(&motion, &shape, &held), &held).z);
            }
            ASSERT_CLOSE((height[0] - height[1]) / 0.02, value_of(torque[i]), 2e-3);
        }
    }
}

static void test_every_link_is_blind_until_it_was_evaluated(void) {
    TEST_ASSERT_EQUAL_HEX32(0x7Fu, sight.blind);
    steps(3u * N);
    TEST_ASSERT_EQUAL_HEX32(
        0x00u, sight.blind & ~1u); /* r detects a force on all but the first link, whose middle is near its axis */
}

static void test_d_e_is_blind_to_the_last_link_and_r_is_not(void) {
    task = (index_config_t){.kind = (uint32_t)INDEX_CONTACT, .components = INDEX_ALL_COMPONENTS};
    steps(3u * N);
    TEST_ASSERT_TRUE((sight.blind & 0x40u) != 0u);
    task = (index_config_t){.kind = (uint32_t)INDEX_RESIDUAL};
    steps(3u * N);
    TEST_ASSERT_TRUE((sight.blind & 0x40u) == 0u);
}

static void test_a_link_is_blind_if_no_channel_passes_a_constant_force(void) {
    bank.channel[0].high_pass[0] = NUM(0.01);
    steps(3u * N);
    TEST_ASSERT_EQUAL_HEX32(0x7Fu, sight.blind);
}

/* The wrist straightens, so that sigma_min goes from 0.1 to 0, and bends again. Of d_e it decides what link 6 shows: at
 * every posture the answer is what all axes of a whole projection give. */
static void test_blindness_follows_the_posture_through_a_singularity_and_back(void) {
    uint32_t answers = 0;
    task = (index_config_t){.kind = (uint32_t)INDEX_CONTACT, .components = INDEX_ALL_COMPONENTS};
    for (uint32_t k = 0; k <= 40u; ++k) {
        const double bend = (k <= 20u) ? (0.9 * (20.0 - k) / 20.0) : (0.9 * (k - 20.0) / 20.0);
        pose[5] = num_of(bend);
        pose[3] = num_of(-1.3 * bend - 0.02);
        steps(3u * N);
        uint32_t expected = 0;
        const num_t still[ROBOT_MAX_JOINTS] = {NUM(0)};
        const vec3_t none = {NUM(0), NUM(0), NUM(0)};
        for (uint32_t link = 0; link < N; ++link) {
            double largest = 0.0;
            for (uint32_t axis = 0; axis < 3u; ++axis) {
                num_t torque[ROBOT_MAX_JOINTS];
                num_t left[ROBOT_MAX_JOINTS];
                uint32_t held = 0;
                const uint32_t before = motion.watched;
                const vec3_t unit = {(axis == 0u) ? NUM(1) : NUM(0), (axis == 1u) ? NUM(1) : NUM(0),
                                     (axis == 2u) ? NUM(1) : NUM(0)};
                motion.watched = link;
                motion_step(&motion, robot, pose, still);
                lever_torque(&motion, lever_arm(&motion, &shape, &held), unit, none, torque, &held);
                index_reject(&index_state, torque, left);
                motion.watched = before;
                for (uint32_t i = 0; i < N; ++i) {
                    largest = fmax(largest, fabs(value_of(left[i])));
                }
            }
            expected |= (largest * 100.0 < 2.0) ? (1u << link) : 0u;
        }
        TEST_ASSERT_EQUAL_HEX32(expected, sight.blind);
        answers |= sight.blind ^ ((k == 0u) ? 0u : 0x40u);
    }
    TEST_ASSERT_TRUE(answers != 0u);
}

/* An arm that feels a force along one axis alone, 1 Nm for 1 N, and 100 N that must be seen. */
static void test_a_force_along_each_axis_is_seen_at_its_threshold(void) {
    index_step(&index_state, &subspace, &task, robot, &motion, &observer, &measured, &regressor);
    for (uint32_t axis = 0; axis < 3u; ++axis) {
        for (uint32_t below = 0; below < 2u; ++below) {
            memset(&motion, 0, sizeof(motion));
            motion.jacobian[axis][0] = NUM(1);
            detector.threshold_nm[0][0] = (below == 0u) ? NUM(101) : NUM(99);
            sight_init(&sight, N);
            for (uint32_t step = 0; step < 3u; ++step) {
                TEST_ASSERT_EQUAL_HEX32(0x7Fu, sight.blind);
                sight_step(&sight, &config, &shape, N, &motion, &index_state, &bank, &detector, 1u);
            }
            TEST_ASSERT_EQUAL_HEX32((below == 0u) ? 0x7Fu : 0x7Eu, sight.blind);
            TEST_ASSERT_EQUAL(1, motion.watched);
        }
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_lever_is_the_derivative_of_the_middles_height);
    RUN_TEST(test_every_link_is_blind_until_it_was_evaluated);
    RUN_TEST(test_d_e_is_blind_to_the_last_link_and_r_is_not);
    RUN_TEST(test_a_link_is_blind_if_no_channel_passes_a_constant_force);
    RUN_TEST(test_blindness_follows_the_posture_through_a_singularity_and_back);
    RUN_TEST(test_a_force_along_each_axis_is_seen_at_its_threshold);
    return UNITY_END();
}
