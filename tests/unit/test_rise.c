/* A contact that grows after the trip is a second one: firmware/guard/guard_rise.c. */
#include "core_fixture.h"
#include "guard_parts.h"

#define JOINTS   7u
#define BEGUN_US 1000000u
#define LEARNING 500000u

static rise_t rise;
static detector_t detector;

void setUp(void) {
    rise_start(&rise, BEGUN_US);
    memset(&detector, 0, sizeof detector);
    for (uint32_t i = 0; i < JOINTS; ++i) {
        detector.threshold_nm[i] = NUM(0.5);
    }
}
void tearDown(void) {}

static bool step(uint32_t joint, num_t value, uint32_t after_us) {
    detector.value_nm[joint] = value;
    return rise_step(&rise, &detector, JOINTS, BEGUN_US + after_us);
}

/* The first contact was twice the threshold of joint 0, and then the threshold. */
static void learn(void) {
    TEST_ASSERT_FALSE(step(0, NUM(-1), 1000u));
    TEST_ASSERT_FALSE(step(0, NUM(0.5), 2000u));
}

static void test_while_the_robot_stops_no_growth_is_a_second_contact(void) {
    num_t value = NUM(0.5);
    for (uint32_t k = 0; k < 6u; ++k) {
        value *= 3;
        TEST_ASSERT_FALSE(step(0, value, LEARNING - 10u + k));
    }
}

static void test_beyond_the_bound_in_three_snapshots_it_is_a_second_contact(void) {
    learn();
    TEST_ASSERT_FALSE(step(0, NUM(2.25), LEARNING)); /* 4.5 thresholds; the bound is 1 + 1.5 * 2 */
    TEST_ASSERT_FALSE(step(0, NUM(-2.25), LEARNING + 1u));
    TEST_ASSERT_TRUE(step(0, NUM(2.25), LEARNING + 2u));
    TEST_ASSERT_EQUAL_UINT32(0u, rise.joint);
    TEST_ASSERT_TRUE(step(0, NUM(2.25), LEARNING + 3u));
    TEST_ASSERT_EQUAL_UINT32(3u, rise.snapshots); /* held */
}

static void test_at_the_bound_it_is_not_a_second_contact(void) {
    learn();
    for (uint32_t k = 0; k < 5u; ++k) {
        TEST_ASSERT_FALSE(step(0, NUM(2), LEARNING + k));
    }
}

static void test_a_snapshot_below_the_bound_starts_the_count_again(void) {
    learn();
    (void)step(0, NUM(3), LEARNING);
    (void)step(0, NUM(3), LEARNING + 1u);
    TEST_ASSERT_FALSE(step(0, NUM(1), LEARNING + 2u));
    TEST_ASSERT_FALSE(step(0, NUM(3), LEARNING + 3u));
    TEST_ASSERT_FALSE(step(0, NUM(3), LEARNING + 4u));
    TEST_ASSERT_TRUE(step(0, NUM(3), LEARNING + 5u));
}

static void test_joints_without_a_threshold_or_beyond_the_robot_are_ignored(void) {
    detector.threshold_nm[2] = NUM(0);
    detector.threshold_nm[JOINTS] = NUM(0.5);
    detector.value_nm[JOINTS] = NUM(50);
    for (uint32_t k = 0; k < 5u; ++k) {
        TEST_ASSERT_FALSE(step(2, NUM(50), LEARNING + k));
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_while_the_robot_stops_no_growth_is_a_second_contact);
    RUN_TEST(test_beyond_the_bound_in_three_snapshots_it_is_a_second_contact);
    RUN_TEST(test_at_the_bound_it_is_not_a_second_contact);
    RUN_TEST(test_a_snapshot_below_the_bound_starts_the_count_again);
    RUN_TEST(test_joints_without_a_threshold_or_beyond_the_robot_are_ignored);
    return UNITY_END();
}
