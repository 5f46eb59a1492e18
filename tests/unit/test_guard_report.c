/* The guard's frames: protected, one StopCommand per tick, every page and joint in sequence. */
#include "guard_fixture.h"

static bench_t bench;

void setUp(void) {
    start(&bench);
    run_until_permitted(&bench);
}
void tearDown(void) {}

static uint32_t get16(const uint8_t *at) {
    return (uint32_t)at[0] | ((uint32_t)at[1] << 8);
}

static void test_every_frame_is_sealed_and_counts_by_one(void) {
    e2e_receiver_t receiver[PROTOCOL_TRANSMIT_COUNT] = {0};
    for (uint32_t i = 0; i < 200u; ++i) {
        cycle(&bench);
        TEST_ASSERT_EQUAL(2, bench.out.frame_count);
        for (uint32_t f = 0; f < bench.out.frame_count; ++f) {
            const can_frame_t *const frame = &bench.out.frame[f];
            for (uint32_t slot = 0; slot < PROTOCOL_TRANSMIT_COUNT; ++slot) {
                if (protocol_transmit[slot].id == frame->id) {
                    const bool first = !receiver[slot].referenced;
                    const e2e_status_t status =
                        e2e_check(&receiver[slot], frame->data, frame->length, protocol_transmit[slot].data_ids, 1u);
                    TEST_ASSERT_EQUAL(first ? E2E_INITIAL : E2E_OK, status);
                }
            }
        }
        TEST_ASSERT_EQUAL(protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND].id, bench.out.frame[0].id);
    }
}

static void test_every_page_and_every_joint_comes_round_in_sixteen_ticks(void) {
    uint32_t pages = 0;
    uint32_t joints = 0;
    for (uint32_t i = 0; i < 16u; ++i) {
        cycle(&bench);
        const can_frame_t *const frame = &bench.out.frame[1];
        const uint32_t multiplexor = 1u << (frame->data[1] >> 4);
        if (frame->id == protocol_transmit[PROTOCOL_TRANSMIT_GUARD_STATUS].id) {
            pages |= multiplexor;
        } else {
            joints |= multiplexor;
        }
    }
    TEST_ASSERT_EQUAL_HEX32(0xFFu, pages);
    TEST_ASSERT_EQUAL_HEX32(0x7Fu, joints);
}

static const can_frame_t *page(uint8_t number) {
    for (uint32_t i = 0; i < 100u; ++i) {
        cycle(&bench);
        const can_frame_t *const frame = &bench.out.frame[1];
        if ((frame->id == protocol_transmit[PROTOCOL_TRANSMIT_GUARD_STATUS].id) && ((frame->data[1] >> 4) == number)) {
            return frame;
        }
    }
    TEST_FAIL_MESSAGE("the page never came");
    return NULL;
}

static void test_counters_are_on_their_pages(void) {
    bench.guard.counters = (guard_counters_t){.crc_errors = 1,
                                              .sequence_errors = 2,
                                              .lost_frames = 3,
                                              .range_errors = 4,
                                              .format_errors = 5,
                                              .late_frames = 6,
                                              .resets_refused = 7,
                                              .trips = 8};
    const can_frame_t *frame = page(1u);
    TEST_ASSERT_EQUAL(1, get16(frame->data + 2));
    TEST_ASSERT_EQUAL(2, get16(frame->data + 4));
    TEST_ASSERT_EQUAL(3, get16(frame->data + 6));
    frame = page(2u);
    TEST_ASSERT_EQUAL(4, get16(frame->data + 2));
    TEST_ASSERT_EQUAL(5, get16(frame->data + 4));
    TEST_ASSERT_EQUAL(6, get16(frame->data + 6));
    frame = page(3u);
    TEST_ASSERT_EQUAL(7, get16(frame->data + 2));
    TEST_ASSERT_EQUAL(8, get16(frame->data + 4));
}

static void test_the_configuration_in_force_is_named(void) {
    const can_frame_t *frame = page(5u);
    TEST_ASSERT_EQUAL_HEX32(bench.config.crc, get16(frame->data + 2) | (get16(frame->data + 4) << 16));
    frame = page(6u);
    TEST_ASSERT_EQUAL(JOINTS, frame->data[2] & 0x0F);
}

static void test_tick_time_and_deadline_margin_are_told(void) {
    guard_note_tick_time(&bench.guard, 123u);
    TEST_ASSERT_EQUAL(123, get16(page(0u)->data + 6));
    guard_note_tick_time(&bench.guard, 77u);
    const can_frame_t *frame = page(6u);
    TEST_ASSERT_EQUAL(123, get16(frame->data + 4)); /* the worst value */
    TEST_ASSERT_EQUAL(DEADLINE_CYCLES * PERIOD_US, get16(frame->data + 6));
    silent_cycles(&bench, 2u);
    TEST_ASSERT_EQUAL((DEADLINE_CYCLES - 2u) * PERIOD_US, get16(page(6u)->data + 6));
    TEST_ASSERT_EQUAL(DEADLINE_CYCLES * PERIOD_US, get16(page(6u)->data + 6)); /* since the last page */
}

static void test_a_joints_residual_is_told_in_hundredths(void) {
    bench.torque[0] = 15000; /* 150 Nm where the gravity torque is zero */
    bench.task = TASK_NONE;
    cycles(&bench, 200u);
    int16_t residual = 0;
    for (uint32_t i = 0; i < 16u; ++i) {
        cycle(&bench);
        const can_frame_t *const frame = &bench.out.frame[1];
        if ((frame->id == protocol_transmit[PROTOCOL_TRANSMIT_GUARD_INDEX].id) && ((frame->data[1] >> 4) == 0u)) {
            residual = (int16_t)get16(frame->data + 2);
        }
    }
    TEST_ASSERT_INT_WITHIN(2, 15000, residual);
    TEST_ASSERT_EQUAL_HEX8(0xF0, bench.out.frame[0].data[2]);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_every_frame_is_sealed_and_counts_by_one);
    RUN_TEST(test_every_page_and_every_joint_comes_round_in_sixteen_ticks);
    RUN_TEST(test_counters_are_on_their_pages);
    RUN_TEST(test_the_configuration_in_force_is_named);
    RUN_TEST(test_tick_time_and_deadline_margin_are_told);
    RUN_TEST(test_a_joints_residual_is_told_in_hundredths);
    return UNITY_END();
}
