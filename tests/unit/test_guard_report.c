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

static void test_every_page_and_every_joint_is_sent_within_22_ticks(void) {
    uint32_t pages = 0;
    uint32_t joints = 0;
    for (uint32_t i = 0; i < 22u; ++i) {
        cycle(&bench);
        const can_frame_t *const frame = &bench.out.frame[1];
        const uint32_t multiplexor = 1u << (frame->data[1] >> 4);
        if (frame->id == protocol_transmit[PROTOCOL_TRANSMIT_GUARD_STATUS].id) {
            pages |= multiplexor;
        } else {
            joints |= multiplexor;
        }
    }
    TEST_ASSERT_EQUAL_HEX32(0x7FFu, pages);
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
    TEST_FAIL_MESSAGE("the page was never sent");
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

static void test_tick_time_and_deadline_margin_are_reported(void) {
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

static void test_a_joints_residual_is_sent_in_hundredths(void) {
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

static void test_a_trip_keeps_its_channel_joint_value_and_threshold(void) {
    bench.torque[3] = (int16_t)(bench.torque[3] + 1000);
    cycles(&bench, 20u);
    assert_stopped(&bench, GUARD_REASON_COLLISION, 4u);
    TEST_ASSERT_EQUAL(0, bench.out.value_channel);
    const int16_t value = (int16_t)get16(bench.out.frame[0].data + 6);
    TEST_ASSERT_TRUE((value > 200) || (value < -200));
    cycles(&bench, 300u);
    const can_frame_t *frame = page(8u);
    TEST_ASSERT_EQUAL_HEX8(0x40, frame->data[2]); /* joint 4, channel 0 */
    TEST_ASSERT_EQUAL(GUARD_REASON_COLLISION, frame->data[3]);
    TEST_ASSERT_EQUAL_INT16(value, (int16_t)get16(frame->data + 4));
    TEST_ASSERT_EQUAL(200, get16(frame->data + 6));
}

/* Held where it is, 10 Nm on joint 4: link and class come after the search, and after 0.75 s it is clamping. */
static void test_a_contact_that_stays_is_clamping(void) {
    bench.torque[3] = (int16_t)(bench.torque[3] + 1000);
    run_until(&bench, GUARD_REASON_COLLISION);
    TEST_ASSERT_EQUAL(CONTACT_CLASS_UNKNOWN, bench.out.contact_class);
    cycles(&bench, LOCATE_PASSES * JOINTS);
    TEST_ASSERT_EQUAL(CONTACT_CLASS_COLLISION, bench.out.contact_class);
    cycles(&bench, 750u);
    TEST_ASSERT_EQUAL(CONTACT_CLASS_CLAMPING, bench.out.contact_class);
    TEST_ASSERT_EQUAL_HEX8(CONTACT_CLASS_CLAMPING, page(9u)->data[2] >> 4);
}

static void test_a_slow_contact_that_ends_is_a_touch(void) {
    const int16_t before = bench.torque[3];
    for (uint32_t i = 0; (i < 1000u) && bench.out.permitted; ++i) { /* 4 Nm a second */
        bench.torque[3] = (int16_t)(before + (int16_t)((2u * i) / 5u));
        cycle(&bench);
    }
    assert_stopped(&bench, GUARD_REASON_COLLISION, 4u);
    bench.torque[3] = before;
    cycles(&bench, 700u);
    TEST_ASSERT_EQUAL(CONTACT_CLASS_TOUCH, bench.out.contact_class);
}

/* Link 1 is needed. Its middle is on its axis: no force there is detected. */
static void start_with_a_blind_link(sight_reaction_t reaction) {
    guard_config_t config = make_config();
    config.sight.reaction = (uint32_t)reaction;
    config.task[TASK_NONE].needed_links = 1u;
    seal_config(&config);
    start_with(&bench, &config);
}

static void test_a_blind_link_is_reported(void) {
    start_with_a_blind_link(SIGHT_REPORT);
    run_until_permitted(&bench);
    TEST_ASSERT_EQUAL_HEX8(1u, bench.out.blind_links & 1u);
    const can_frame_t *frame = page(10u);
    TEST_ASSERT_EQUAL_HEX8(bench.out.blind_links, frame->data[2]);
    TEST_ASSERT_EQUAL_HEX8(1u, frame->data[3]);
    TEST_ASSERT_EQUAL_HEX8(0x81u, bench.out.frame[0].data[4]); /* full speed, no reason */
}

/* Both tasks need the last link. d_e never detects a force on it. */
static void start_needing_the_last_link(sight_reaction_t reaction) {
    guard_config_t config = make_config();
    config.sight.reaction = (uint32_t)reaction;
    config.task[TASK_NONE].needed_links = 0x40u;
    config.task[TASK_CONTACT].needed_links = 0x40u;
    for (uint32_t i = 0; i < JOINTS; ++i) {
        config.shape.middle[i][0] = NUM(0.1);
    }
    seal_config(&config);
    start_with(&bench, &config);
    run_until_permitted(&bench);
}

static void test_the_speed_is_lowered_while_a_needed_link_is_blind(void) {
    start_needing_the_last_link(SIGHT_SLOW);
    TEST_ASSERT_TRUE(bench.out.full_speed);
    TEST_ASSERT_EQUAL_HEX8(0x81u, bench.out.frame[0].data[4]);
    bench.task = TASK_CONTACT;
    cycles(&bench, 250u + 4u * JOINTS);
    TEST_ASSERT_TRUE(bench.out.permitted);
    TEST_ASSERT_FALSE(bench.out.full_speed);
    TEST_ASSERT_EQUAL_HEX8(0x01u, bench.out.frame[0].data[4]);
    bench.task = TASK_NONE;
    cycles(&bench, 250u + 4u * JOINTS);
    TEST_ASSERT_TRUE(bench.out.full_speed);
}

static void test_a_blind_link_withdraws_the_permission(void) {
    start_with_a_blind_link(SIGHT_WITHDRAW);
    cycles(&bench, START_LIMIT);
    TEST_ASSERT_EQUAL(GUARD_STATE_WAITING, bench.out.state);
    TEST_ASSERT_EQUAL(GUARD_REASON_BLIND, bench.out.reason);
    TEST_ASSERT_FALSE(bench.out.permitted);
}

static void test_a_link_that_becomes_blind_is_a_stop(void) {
    start_needing_the_last_link(SIGHT_WITHDRAW);
    bench.task = TASK_CONTACT;
    cycles(&bench, 250u + 4u * JOINTS);
    assert_stopped(&bench, GUARD_REASON_BLIND, 0u);
    TEST_ASSERT_EQUAL(bench.config.stop_input, bench.out.stop_category);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_every_frame_is_sealed_and_counts_by_one);
    RUN_TEST(test_every_page_and_every_joint_is_sent_within_22_ticks);
    RUN_TEST(test_counters_are_on_their_pages);
    RUN_TEST(test_the_configuration_in_force_is_named);
    RUN_TEST(test_tick_time_and_deadline_margin_are_reported);
    RUN_TEST(test_a_joints_residual_is_sent_in_hundredths);
    RUN_TEST(test_a_trip_keeps_its_channel_joint_value_and_threshold);
    RUN_TEST(test_a_contact_that_stays_is_clamping);
    RUN_TEST(test_a_slow_contact_that_ends_is_a_touch);
    RUN_TEST(test_a_blind_link_is_reported);
    RUN_TEST(test_the_speed_is_lowered_while_a_needed_link_is_blind);
    RUN_TEST(test_a_blind_link_withdraws_the_permission);
    RUN_TEST(test_a_link_that_becomes_blind_is_a_stop);
    return UNITY_END();
}
