/* A guard whose configuration was refused. It reports, and never permits. */
#include "guard_fixture.h"

static bench_t bench;

void setUp(void) {
    start(&bench);
    bench.config.crc ^= 1u;
    TEST_ASSERT_EQUAL(GUARD_BAD_CRC, guard_init(&bench.guard, &bench.config));
    TEST_ASSERT_EQUAL(1, bench.guard.restarts); /* until guard_note_start, one unexpected restart */
    TEST_ASSERT_TRUE(guard_is_alone(&bench.guard));
}
void tearDown(void) {}

static void assert_idle(void) {
    TEST_ASSERT_EQUAL(GUARD_STATE_UNINITIALISED, bench.guard.state);
    TEST_ASSERT_FALSE(bench.out.permitted);
    TEST_ASSERT_TRUE(bench.out.withheld);
    TEST_ASSERT_EQUAL(2, bench.out.frame_count);
    TEST_ASSERT_EQUAL(0, bench.out.frame[0].flags); /* classic CAN, which every receiver understands */
    TEST_ASSERT_EQUAL(0, bench.out.frame[1].flags);
}

static void test_no_frame_makes_it_permit(void) {
    for (uint32_t i = 0; i < 30u; ++i) {
        cycle(&bench);
        assert_idle();
        TEST_ASSERT_FALSE(guard_cycle_complete(&bench.guard));
    }
    TEST_ASSERT_EQUAL(0, bench.guard.counters.format_errors);
    TEST_ASSERT_FALSE(bench.guard.inputs.sync.seen);
}

static void test_it_sends_pages_and_no_joint(void) {
    uint32_t pages = 0;
    for (uint32_t i = 0; i < 2u * PAGE_COUNT; ++i) {
        tick(&bench);
        assert_idle();
        TEST_ASSERT_EQUAL_HEX32(protocol_transmit[PROTOCOL_TRANSMIT_GUARD_STATUS].id, bench.out.frame[1].id);
        pages |= 1u << (bench.out.frame[1].data[1] >> 4);
    }
    TEST_ASSERT_EQUAL_HEX32((1u << PAGE_COUNT) - 1u, pages);
}

static void test_a_trip_and_a_long_tick_change_nothing(void) {
    guard_trip(&bench.guard, GUARD_REASON_BUS_OFF);
    guard_note_tick_time(&bench.guard, 1000000u);
    tick(&bench);
    assert_idle();
    TEST_ASSERT_EQUAL(0, bench.out.trip_number);
    TEST_ASSERT_FALSE(bench.guard.over_budget);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_no_frame_makes_it_permit);
    RUN_TEST(test_it_sends_pages_and_no_joint);
    RUN_TEST(test_a_trip_and_a_long_tick_change_nothing);
    return UNITY_END();
}
