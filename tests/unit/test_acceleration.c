/* The conditions under which the commanded acceleration is explained: firmware/core/acceleration.h. */
#include "acceleration.h"

#include "core_fixture.h"
#include "robots.h"
#include "token.h"

#define EXACT 2e-6 /* a few steps of Q9.22 */

static acceleration_t self;
static acceleration_config_t config;
static observer_config_t gains;
static observer_t observer;
static motion_t motion;
static num_t velocity[ROBOT_MAX_JOINTS];

/* Joint i moves the tip along axis i; joint 6 along x too; what the arm does not have would move it far. */
void setUp(void) {
    acceleration_init(&self);
    config = (acceleration_config_t){.force_floor_n = NUM(1), .error_max = NUM(2)};
    memset(&gains, 0, sizeof gains);
    for (uint32_t g = 0; g < OBSERVER_MAX_GAP; ++g) {
        gains.decay[g] = num_of(0.5 / (g + 1.0));
        gains.gain[g] = num_of(0.5 / (g + 1.0));
        gains.momentum_gain[g] = num_of(0.5 / (g + 1.0));
    }
    observer = (observer_t){.gap = 1u, .token = 77u};
    motion_init(&motion);
    for (uint32_t row = 0; row < 3u; ++row) {
        motion.jacobian[row][row] = NUM(1);
    }
    motion.jacobian[0][6] = NUM(1);
    motion.jacobian[0][7] = NUM(5);
    motion.jacobian[3][0] = NUM(7);
    memset(velocity, 0, sizeof velocity);
    velocity[7] = NUM(5);
}
void tearDown(void) {}

static void step(double x, double y, double z) {
    const vec3_t commanded = {.x = num_of(x), .y = num_of(y), .z = num_of(z)};
    acceleration_step(&self, &config, &gains, &observer, &robot_ku_dex, &motion, velocity, commanded, NUM(1));
}

static void assert_vector(double x, double y, double z, vec3_t actual) {
    ASSERT_CLOSE(x, value_of(actual.x), EXACT);
    ASSERT_CLOSE(y, value_of(actual.y), EXACT);
    ASSERT_CLOSE(z, value_of(actual.z), EXACT);
}

static void assert_not_used(double size) {
    TEST_ASSERT_TRUE(self.trust == NUM(0));
    TEST_ASSERT_TRUE(self.across == NUM(0));
    assert_vector(0.0, 0.0, 0.0, self.sideways);
    ASSERT_CLOSE(size, value_of(self.size), EXACT);
}

static void test_it_starts_at_zero(void) {
    const acceleration_t nothing = {0};
    TEST_ASSERT_EQUAL_MEMORY(&nothing, &self, sizeof nothing);
}

static void test_the_velocity_of_the_tip_sums_the_joints_of_the_arm(void) {
    velocity[0] = NUM(1);
    velocity[1] = NUM(2);
    velocity[2] = NUM(3);
    velocity[6] = NUM(0.5);
    step(0.0, 0.0, 0.0);
    assert_vector(1.5, 2.0, 3.0, self.velocity);
}

static void test_both_accelerations_pass_the_filter_of_the_gap(void) {
    velocity[0] = NUM(1);
    step(1.0, 2.0, 3.0);
    assert_vector(0.5, 0.0, 0.0, self.measured);
    assert_vector(0.5, 1.0, 1.5, self.commanded);
    observer.gap = OBSERVER_MAX_GAP;
    velocity[0] = NUM(3);
    step(1.0, 2.0, 3.0);
    assert_vector(0.3125, 0.0, 0.0, self.measured);
    assert_vector(0.1875, 0.375, 0.5625, self.commanded);
}

static void test_a_gap_too_long_to_bridge_restarts_the_filters(void) {
    const uint32_t gaps[] = {0u, OBSERVER_MAX_GAP + 1u};
    for (uint32_t k = 0; k < 2u; ++k) {
        observer.gap = 1u;
        velocity[0] = NUM(1);
        step(1.0, 2.0, 3.0);
        observer.gap = gaps[k];
        step(1.0, 2.0, 3.0);
        assert_vector(0.0, 0.0, 0.0, self.measured);
        assert_vector(0.0, 0.0, 0.0, self.commanded);
        assert_vector(1.0, 0.0, 0.0, self.velocity);
    }
}

static void test_a_command_that_agrees_and_matters_is_used(void) {
    velocity[0] = NUM(3);
    step(3.0, 0.0, 1.0);
    ASSERT_CLOSE(1.0, value_of(self.trust), EXACT); /* the largest trust */
    ASSERT_CLOSE(3.0, value_of(self.across), EXACT);
    ASSERT_CLOSE(3.16227766, value_of(self.size), 1e-5);
    assert_vector(1.0, 0.0, 0.0, self.sideways);
    TEST_ASSERT_EQUAL_HEX32(token_next(77u, TOKEN_ACCELERATION, 0u), self.token);
}

static void test_trust_rises_to_twice_the_floor_and_falls_over_the_last_quarter_of_the_error(void) {
    step(1.5, 0.0, 0.0);
    ASSERT_CLOSE(0.5, value_of(self.trust), EXACT);
    setUp();
    step(3.5, 0.0, 0.0); /* filtered 1.75 against 0 */
    ASSERT_CLOSE(0.5, value_of(self.trust), EXACT);
}

static void test_at_the_floor_it_is_used_and_below_it_is_not(void) {
    step(1.0, 0.0, 0.0);
    ASSERT_CLOSE(1.0, value_of(self.across), EXACT);
    step(0.99, 0.0, 0.0);
    assert_not_used(0.99);
    step(0.0, 0.0, 3.0); /* along gravity */
    assert_not_used(3.0);
}

static void test_a_command_that_the_arm_does_not_follow_is_not_used(void) {
    step(4.0, 0.0, 0.0); /* filtered 2: the largest error */
    ASSERT_CLOSE(4.0, value_of(self.size), EXACT);
    setUp();
    step(4.1, 0.0, 0.0);
    assert_not_used(0.0);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_it_starts_at_zero);
    RUN_TEST(test_the_velocity_of_the_tip_sums_the_joints_of_the_arm);
    RUN_TEST(test_both_accelerations_pass_the_filter_of_the_gap);
    RUN_TEST(test_a_gap_too_long_to_bridge_restarts_the_filters);
    RUN_TEST(test_a_command_that_agrees_and_matters_is_used);
    RUN_TEST(test_trust_rises_to_twice_the_floor_and_falls_over_the_last_quarter_of_the_error);
    RUN_TEST(test_at_the_floor_it_is_used_and_below_it_is_not);
    RUN_TEST(test_a_command_that_the_arm_does_not_follow_is_not_used);
    return UNITY_END();
}
