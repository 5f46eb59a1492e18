/* The cause of the RPU's start, and whether its clock matches the image. */
#include "../../firmware/boards/versal_r5/clock_check.c"
#include "../../firmware/boards/versal_r5/reset_cause.c"

#include "unity.h"

#define HZ 99999900u

void setUp(void) {}
void tearDown(void) {}

static void test_without_a_record_the_platforms_reason_counts(void) {
    TEST_ASSERT_EQUAL(GUARD_START_POWER_ON, reset_cause(RESET_EXTERNAL_POR, false, false));
    TEST_ASSERT_EQUAL(GUARD_START_POWER_ON, reset_cause(0, false, false));
    TEST_ASSERT_EQUAL(GUARD_START_COMMANDED, reset_cause(RESET_SW_SRST, false, false));
    TEST_ASSERT_EQUAL(GUARD_START_COMMANDED, reset_cause(RESET_SW_POR, false, false));
    TEST_ASSERT_EQUAL(GUARD_START_COMMANDED, reset_cause(RESET_DAP_SRST, false, false));
    TEST_ASSERT_EQUAL(GUARD_START_WATCHDOG, reset_cause(RESET_ERR_SRST, false, false));
    TEST_ASSERT_EQUAL(GUARD_START_WATCHDOG, reset_cause(RESET_ERR_POR, false, false));
}

static void test_an_error_is_not_hidden_by_another_reason(void) {
    TEST_ASSERT_EQUAL(GUARD_START_WATCHDOG, reset_cause(RESET_ERR_SRST | RESET_SW_SRST, false, false));
}

/* The platform's reason then belongs to an earlier start. */
static void test_memory_that_a_reset_kept_means_an_unexpected_restart(void) {
    TEST_ASSERT_EQUAL(GUARD_START_WATCHDOG, reset_cause(0, true, false));
    TEST_ASSERT_EQUAL(GUARD_START_WATCHDOG, reset_cause(RESET_EXTERNAL_POR, true, false));
    TEST_ASSERT_EQUAL(GUARD_START_WATCHDOG, reset_cause(RESET_SW_SRST, true, false));
}

static void test_a_recorded_exception_is_the_reason(void) {
    TEST_ASSERT_EQUAL(GUARD_START_EXCEPTION, reset_cause(0, true, true));
    TEST_ASSERT_EQUAL(GUARD_START_EXCEPTION, reset_cause(RESET_ERR_SRST, false, true));
}

static void test_the_clock_of_the_image_agrees_within_five_percent(void) {
    const uint32_t cycles = PMU_CYCLES_PER_US * 1000u; /* a millisecond */
    TEST_ASSERT_TRUE(clock_agrees(cycles, 100000u, HZ));
    TEST_ASSERT_TRUE(clock_agrees(cycles, 104000u, HZ));
    TEST_ASSERT_TRUE(clock_agrees(cycles, 96000u, HZ));
    TEST_ASSERT_FALSE(clock_agrees(cycles, 107000u, HZ));
    TEST_ASSERT_FALSE(clock_agrees(cycles, 94000u, HZ));
}

/* An image for the device on QEMU's clock of 1 GHz. */
static void test_a_clock_1_67_times_too_fast_or_slow_is_detected(void) {
    TEST_ASSERT_FALSE(clock_agrees(PMU_CYCLES_PER_US * 1000u, 60000u, HZ));
    TEST_ASSERT_FALSE(clock_agrees(PMU_CYCLES_PER_US * 1000u, 166700u, HZ));
}

static void test_a_stopped_reference_or_one_without_a_frequency_does_not_agree(void) {
    TEST_ASSERT_FALSE(clock_agrees(600000u, 0u, HZ));
    TEST_ASSERT_FALSE(clock_agrees(600000u, 100000u, 0u));
    TEST_ASSERT_FALSE(clock_agrees(0u, 100000u, HZ)); /* the core's counter is stopped */
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_without_a_record_the_platforms_reason_counts);
    RUN_TEST(test_an_error_is_not_hidden_by_another_reason);
    RUN_TEST(test_memory_that_a_reset_kept_means_an_unexpected_restart);
    RUN_TEST(test_a_recorded_exception_is_the_reason);
    RUN_TEST(test_the_clock_of_the_image_agrees_within_five_percent);
    RUN_TEST(test_a_clock_1_67_times_too_fast_or_slow_is_detected);
    RUN_TEST(test_a_stopped_reference_or_one_without_a_frequency_does_not_agree);
    return UNITY_END();
}
