/* The guard's frames: protected, one StopCommand per tick, every page and joint in sequence. */
#include "guard_fixture.h"
#include "guard_parts.h"
#include "version.h"

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
    cycles(&bench, 64u + JOINTS); /* the mean, then a link in each cycle */
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

static void test_the_versions_are_on_their_page(void) {
    const can_frame_t *const frame = page(4u);
    TEST_ASSERT_EQUAL_HEX32((TAUPERP_VERSION_MAJOR * 256u) + TAUPERP_VERSION_MINOR, get16(frame->data + 2));
    TEST_ASSERT_EQUAL(PROTOCOL_WIRE_VERSION, frame->data[4]);
    TEST_ASSERT_EQUAL(CONFIG_SCHEMA, frame->data[5]);
}

static void test_the_start_is_on_its_page(void) {
    guard_note_start(&bench.guard, GUARD_START_WATCHDOG, 300u, GUARD_VARIANT_PRODUCT);
    TEST_ASSERT_EQUAL(UINT8_MAX, bench.guard.restarts); /* the most that the page can carry */
    guard_note_start(&bench.guard, GUARD_START_WATCHDOG, 2u, GUARD_VARIANT_PRODUCT);
    const can_frame_t *const frame = page(7u);
    TEST_ASSERT_EQUAL_HEX8(GUARD_START_WATCHDOG | (GUARD_VARIANT_PRODUCT << 4), frame->data[2]);
    TEST_ASSERT_EQUAL(2, frame->data[3]);
    TEST_ASSERT_EQUAL_HEX8(0x10, frame->data[4]); /* one channel */
    guard_join(&bench.guard, false);
    report_tick(&bench.guard, &bench.out);
    TEST_ASSERT_EQUAL_HEX8(0x20, page(7u)->data[4]);
}

/* Contact in one link: size in fiftieths of a newton, direction in hundredths. */
static void test_the_force_of_a_contact_is_on_its_page(void) {
    bench.out.frame_count = 0;
    bench.guard.report.round_robin = 2u * PAGE_CONTACT;
    bench.out.contact_link = 5u;
    bench.out.contact_class = CONTACT_CLASS_TOUCH;
    bench.out.contact_force = (vec3_t){.x = NUM(6), .y = NUM(-12), .z = NUM(4)}; /* 14 N */
    report_tick(&bench.guard, &bench.out);
    const uint8_t *const data = bench.out.frame[1].data;
    TEST_ASSERT_EQUAL_HEX8(5 | (CONTACT_CLASS_TOUCH << 4), data[2]);
    TEST_ASSERT_EQUAL(700, get16(data + 3));
    TEST_ASSERT_EQUAL_INT8(43, (int8_t)data[5]);
    TEST_ASSERT_EQUAL_INT8(-86, (int8_t)data[6]);
    TEST_ASSERT_EQUAL_INT8(29, (int8_t)data[7]);
    bench.guard.report.round_robin = 2u * PAGE_CONTACT;
    bench.out.contact_force = (vec3_t){.x = NUM(-5), .y = NUM(0), .z = NUM(0)};
    report_tick(&bench.guard, &bench.out);
    TEST_ASSERT_EQUAL_INT8(-100, (int8_t)data[5]);
}

static void test_values_of_16_bits_end_at_their_largest(void) {
    guard_note_tick_time(&bench.guard, 65536u);
    TEST_ASSERT_EQUAL(65535, get16(page(6u)->data + 4));
    bench.guard.report.worst_tick_time_us = 65535u;
    TEST_ASSERT_EQUAL(65535, get16(page(6u)->data + 4));
    bench.guard.report.worst_tick_time_us = 65534u;
    TEST_ASSERT_EQUAL(65534, get16(page(6u)->data + 4));
}

static void test_a_joints_index_channel_and_threshold_are_sent(void) {
    bench.guard.report.round_robin = 2u * 3u + 1u;
    bench.out.residual[3] = NUM(-1.5);
    bench.out.index[3] = NUM(1.25);
    bench.out.index_channel[3] = 2u;
    bench.out.threshold[3] = NUM(3);
    report_tick(&bench.guard, &bench.out);
    const uint8_t *const data = bench.out.frame[1].data;
    TEST_ASSERT_EQUAL_HEX32(protocol_transmit[PROTOCOL_TRANSMIT_GUARD_INDEX].id, bench.out.frame[1].id);
    TEST_ASSERT_EQUAL(3, data[1] >> 4);
    TEST_ASSERT_EQUAL_INT16(-150, (int16_t)get16(data + 2));
    TEST_ASSERT_EQUAL_INT16(125, (int16_t)get16(data + 4));
    TEST_ASSERT_EQUAL_HEX32(300u | (2u << 14), get16(data + 6));
}

/* 11 pages in 22 ticks and 7 joints in 14: after 2 x 11 x 840 ticks both begin again. */
static void test_the_turn_of_pages_and_joints_has_no_gap_at_its_end(void) {
    bench.guard.report.round_robin = (2u * PAGE_COUNT * 840u) - 2u;
    report_tick(&bench.guard, &bench.out);
    TEST_ASSERT_EQUAL(PAGE_COUNT - 1u, bench.out.frame[1].data[1] >> 4);
    report_tick(&bench.guard, &bench.out);
    TEST_ASSERT_EQUAL(JOINTS - 1u, bench.out.frame[1].data[1] >> 4);
    TEST_ASSERT_EQUAL(0, bench.guard.report.round_robin);
}

/* Low nibble: permission, 1 to move. High nibble: the inverted copy, 14 to move. With a second channel, which
 * overwrites the copy, both opinions of this one must permit. */
static void test_the_permission_with_a_second_channel_needs_both_opinions(void) {
    static const struct {
        bool permitted;
        bool withheld;
        uint8_t alone;
        uint8_t paired;
    } cases[] = {
        {true, false, 0xE1, 0xE1}, {true, true, 0xF1, 0xF0}, {false, false, 0xE0, 0xE0}, {false, true, 0xF0, 0xF0}};
    for (uint32_t i = 0; i < 8u; ++i) {
        if (i == 4u) {
            guard_join(&bench.guard, false);
        }
        bench.out.permitted = cases[i % 4u].permitted;
        bench.out.withheld = cases[i % 4u].withheld;
        report_tick(&bench.guard, &bench.out);
        TEST_ASSERT_EQUAL_HEX8((i < 4u) ? cases[i % 4u].alone : cases[i % 4u].paired, bench.out.frame[0].data[2]);
    }
}

static const uint8_t *page_data(uint32_t number) {
    bench.guard.report.round_robin = 2u * number;
    report_tick(&bench.guard, &bench.out);
    return bench.out.frame[1].data;
}

/* Telemetry ends at the largest raw value, and at 0 where it has no sign. */
static void test_telemetry_saturates_at_the_ends_of_its_range(void) {
    bench.out.residual[0] = NUM(400);
    bench.out.index[0] = NUM(-400);
    bench.out.threshold[0] = NUM(200);
    bench.guard.report.round_robin = 1u;
    report_tick(&bench.guard, &bench.out);
    TEST_ASSERT_EQUAL_INT16(32767, (int16_t)get16(bench.out.frame[1].data + 2));
    TEST_ASSERT_EQUAL_INT16(-32767, (int16_t)get16(bench.out.frame[1].data + 4));
    TEST_ASSERT_EQUAL(16383, get16(bench.out.frame[1].data + 6) & 0x3FFFu);
    bench.out.smallest_singular = NUM(7);
    TEST_ASSERT_EQUAL(65535, get16(page_data(0u) + 4));
    bench.guard.trip.threshold_nm = NUM(500);
    TEST_ASSERT_EQUAL(50000, get16(page_data(8u) + 6));
    bench.out.contact_force.x = NUM(500);
    TEST_ASSERT_EQUAL(25000, get16(page_data(9u) + 3));
#ifndef TAUPERP_FIXED /* where such numbers exist */
    bench.guard.trip.threshold_nm = NUM(5000);
    TEST_ASSERT_EQUAL(65535, get16(page_data(8u) + 6));
    bench.out.contact_force.x = NUM(5000);
    TEST_ASSERT_EQUAL(65535, get16(page_data(9u) + 3));
#endif
    bench.out.threshold[0] = NUM(0);
    bench.out.smallest_singular = NUM(0);
    bench.guard.trip.threshold_nm = NUM(0);
    bench.out.contact_force.x = NUM(0);
    TEST_ASSERT_EQUAL(0, get16(page_data(0u) + 4));
    TEST_ASSERT_EQUAL(0, get16(page_data(8u) + 6));
    TEST_ASSERT_EQUAL(0, get16(page_data(9u) + 3));
    TEST_ASSERT_EQUAL(0, get16(page_data(9u) + 6)); /* no force has no direction */
    bench.guard.report.round_robin = 1u;
    report_tick(&bench.guard, &bench.out);
    TEST_ASSERT_EQUAL(0, get16(bench.out.frame[1].data + 6) & 0x3FFFu);
}

static void test_the_page_of_the_configuration_has_joints_numeric_type_and_format(void) {
    TEST_ASSERT_EQUAL_HEX8(JOINTS | (NUM_NUMERIC << 4), page_data(6u)[2]);
    TEST_ASSERT_EQUAL_HEX8(FORMAT_CLASSIC, page_data(6u)[3] & 0x0Fu);
    bench.config.format = FORMAT_FD;
    TEST_ASSERT_EQUAL_HEX8(FORMAT_FD, page_data(6u)[3] & 0x0Fu);
    TEST_ASSERT_EQUAL_HEX8(CAN_FRAME_FD | CAN_FRAME_BRS, bench.out.frame[0].flags);
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
    RUN_TEST(test_the_versions_are_on_their_page);
    RUN_TEST(test_the_start_is_on_its_page);
    RUN_TEST(test_the_force_of_a_contact_is_on_its_page);
    RUN_TEST(test_values_of_16_bits_end_at_their_largest);
    RUN_TEST(test_a_joints_index_channel_and_threshold_are_sent);
    RUN_TEST(test_the_turn_of_pages_and_joints_has_no_gap_at_its_end);
    RUN_TEST(test_the_permission_with_a_second_channel_needs_both_opinions);
    RUN_TEST(test_telemetry_saturates_at_the_ends_of_its_range);
    RUN_TEST(test_the_page_of_the_configuration_has_joints_numeric_type_and_format);
    return UNITY_END();
}
