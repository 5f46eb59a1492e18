/* The time of a frame on the Linux board: firmware/hosts/linux/clock.h. */
#include "../../firmware/hosts/linux/clock.c"

#include "unity.h"

#define NOW_US  5000000u
#define REAL_NS 1700000000000000000
#define MS_NS   1000000

void setUp(void) {}
void tearDown(void) {}

static struct timespec stamp_at(int64_t ns) {
    return (struct timespec){.tv_sec = (time_t)(ns / 1000000000), .tv_nsec = (long)(ns % 1000000000)};
}

static uint64_t time_of(guard_clock_t *clock, uint64_t monotonic_us, int64_t realtime_ns, int64_t stamp_ns) {
    const struct timespec stamp = stamp_at(stamp_ns);
    return clock_of_frame(clock, (clock_pair_t){monotonic_us, realtime_ns}, &stamp);
}

static void test_the_time_of_a_frame_is_now_minus_its_age(void) {
    guard_clock_t clock = {0};
    TEST_ASSERT_EQUAL_UINT64(NOW_US - 3000u, time_of(&clock, NOW_US, REAL_NS, REAL_NS - (3 * MS_NS)));
}

static void test_a_frame_without_a_stamp_has_the_time_of_now(void) {
    guard_clock_t clock = {0};
    TEST_ASSERT_EQUAL_UINT64(NOW_US, clock_of_frame(&clock, (clock_pair_t){NOW_US, REAL_NS}, NULL));
}

static void test_a_clock_set_back_gives_no_time_after_now(void) {
    guard_clock_t clock = {0};
    TEST_ASSERT_EQUAL_UINT64(NOW_US, time_of(&clock, NOW_US, REAL_NS - (3600000 * (int64_t)MS_NS), REAL_NS));
}

static void test_a_clock_set_forward_gives_no_earlier_time(void) {
    guard_clock_t clock = {0};
    (void)clock_now(&clock, NOW_US);
    TEST_ASSERT_EQUAL_UINT64(NOW_US, time_of(&clock, NOW_US + 500u, REAL_NS + (3600000 * (int64_t)MS_NS), REAL_NS));
}

static void test_an_age_before_the_start_of_the_clock_gives_its_start(void) {
    guard_clock_t clock = {0};
    TEST_ASSERT_EQUAL_UINT64(0u, time_of(&clock, NOW_US, REAL_NS, 0));
}

static void test_no_time_is_before_an_earlier_result(void) {
    guard_clock_t clock = {0};
    const uint64_t first = time_of(&clock, NOW_US, REAL_NS, REAL_NS - MS_NS);
    const uint64_t second = time_of(&clock, NOW_US, REAL_NS, REAL_NS - (2 * MS_NS));
    TEST_ASSERT_EQUAL_UINT64(first, second);
    TEST_ASSERT_EQUAL_UINT64(first, clock_now(&clock, first - 1u));
    TEST_ASSERT_EQUAL_UINT64(NOW_US, clock_now(&clock, NOW_US));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_time_of_a_frame_is_now_minus_its_age);
    RUN_TEST(test_a_frame_without_a_stamp_has_the_time_of_now);
    RUN_TEST(test_a_clock_set_back_gives_no_time_after_now);
    RUN_TEST(test_a_clock_set_forward_gives_no_earlier_time);
    RUN_TEST(test_an_age_before_the_start_of_the_clock_gives_its_start);
    RUN_TEST(test_no_time_is_before_an_earlier_result);
    return UNITY_END();
}
