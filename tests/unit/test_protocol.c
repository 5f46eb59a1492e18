#include "messages.h"
#include "protocol.h"
#include "scale.h"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

static void test_every_id_of_the_table_has_its_own_slot(void) {
    for (uint32_t slot = 0; slot < PROTOCOL_RECEIVE_COUNT; ++slot) {
        TEST_ASSERT_EQUAL_UINT(slot, protocol_slot(protocol_receive[slot].id));
    }
}

static void test_no_other_id_has_a_slot(void) {
    uint32_t heard = 0;
    for (uint32_t id = 0; id < 0x1000u; ++id) {
        const uint32_t slot = protocol_slot(id);
        if (slot != PROTOCOL_RECEIVE_COUNT) {
            TEST_ASSERT_EQUAL_UINT(id, protocol_receive[slot].id);
            ++heard;
        }
    }
    TEST_ASSERT_EQUAL_UINT(PROTOCOL_RECEIVE_COUNT, heard);
    TEST_ASSERT_EQUAL_UINT(PROTOCOL_RECEIVE_COUNT, protocol_slot(0x1FFFFFFFu));
    TEST_ASSERT_EQUAL_UINT(PROTOCOL_RECEIVE_COUNT, protocol_slot(UINT32_MAX));
}

static void test_a_joints_slot_is_its_number(void) {
    for (uint32_t joint = 0; joint < 8u; ++joint) {
        const protocol_receive_t *const entry = &protocol_receive[PROTOCOL_RECEIVE_JOINT_STATE + joint];
        TEST_ASSERT_EQUAL_UINT(joint, PROTOCOL_RECEIVE_JOINT_STATE + joint);
        TEST_ASSERT_EQUAL_UINT(PROTOCOL_KIND_JOINT_STATE, entry->kind);
        TEST_ASSERT_EQUAL_UINT(joint, entry->joint);
        TEST_ASSERT_EQUAL_HEX(0x101u + joint, entry->id);
    }
}

static void test_every_slot_is_of_its_kind_and_length(void) {
    const struct {
        uint32_t slot;
        uint32_t id;
        uint8_t kind;
        uint8_t length;
    } expected[] = {
        {PROTOCOL_RECEIVE_SYNC, 0x020, PROTOCOL_KIND_SYNC, TAUPERP_SYNC_LENGTH},
        {PROTOCOL_RECEIVE_GUARD_RESET, 0x030, PROTOCOL_KIND_GUARD_RESET, TAUPERP_GUARD_RESET_LENGTH},
        {PROTOCOL_RECEIVE_TASK_COMMAND, 0x040, PROTOCOL_KIND_TASK_COMMAND, TAUPERP_TASK_COMMAND_LENGTH},
        {PROTOCOL_RECEIVE_JOINT_STATE, 0x101, PROTOCOL_KIND_JOINT_STATE, TAUPERP_JOINT_STATE_LENGTH},
    };
    for (uint32_t i = 0; i < sizeof(expected) / sizeof(expected[0]); ++i) {
        const protocol_receive_t *const entry = &protocol_receive[expected[i].slot];
        TEST_ASSERT_EQUAL_HEX(expected[i].id, entry->id);
        TEST_ASSERT_EQUAL_UINT(expected[i].kind, entry->kind);
        TEST_ASSERT_EQUAL_UINT(expected[i].length, entry->length);
    }
    TEST_ASSERT_EQUAL_HEX(TAUPERP_STOP_COMMAND_FRAME_ID, protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND].id);
    TEST_ASSERT_EQUAL_HEX(TAUPERP_GUARD_STATUS_FRAME_ID, protocol_transmit[PROTOCOL_TRANSMIT_GUARD_STATUS].id);
    TEST_ASSERT_EQUAL_HEX(TAUPERP_GUARD_INDEX_FRAME_ID, protocol_transmit[PROTOCOL_TRANSMIT_GUARD_INDEX].id);
}

static void test_the_stop_command_outranks_every_message(void) {
    const uint16_t stop = protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND].id;
    for (uint32_t slot = 0; slot < PROTOCOL_RECEIVE_COUNT; ++slot) {
        TEST_ASSERT_LESS_THAN_UINT(protocol_receive[slot].id, stop);
    }
}

/* e2e.h: the counter cannot distinguish more than 15 lost frames, so the deadline must. */
static void test_every_periodic_input_times_out_before_its_counter_repeats(void) {
    for (uint32_t slot = 0; slot < PROTOCOL_RECEIVE_COUNT; ++slot) {
        const protocol_receive_t *const entry = &protocol_receive[slot];
        TEST_ASSERT_LESS_THAN_UINT(16, entry->timeout_cycles);
        TEST_ASSERT_TRUE((entry->max_delta >= 1u) && (entry->max_delta <= E2E_MAX_DELTA));
        TEST_ASSERT_EQUAL(entry->kind == PROTOCOL_KIND_GUARD_RESET, entry->timeout_cycles == 0u);
    }
}

static void test_a_joint_frame_unpacks_where_its_signals_are(void) {
    const uint8_t frame[8] = {0xC4, 0x2D, 0x01, 0x80, 0xFF, 0x7F, 0xFE, 0xFF};
    struct tauperp_joint_state_t joint;
    tauperp_joint_state_unpack(&joint, frame);
    TEST_ASSERT_EQUAL_UINT(0xC4, joint.crc);
    TEST_ASSERT_EQUAL_UINT(13, joint.counter);
    TEST_ASSERT_EQUAL_UINT(2, joint.sensor_status);
    TEST_ASSERT_EQUAL_INT(-32767, joint.position);
    TEST_ASSERT_EQUAL_INT(32767, joint.velocity);
    TEST_ASSERT_EQUAL_INT(-2, joint.torque);
}

static void test_the_raw_value_for_not_available_is_out_of_range(void) {
    TEST_ASSERT_EQUAL_INT(-INT16_MAX, PROTOCOL_JOINT_STATE_POSITION_RAW_MIN);
    TEST_ASSERT_EQUAL_INT(-INT16_MAX, PROTOCOL_JOINT_STATE_VELOCITY_RAW_MIN);
    TEST_ASSERT_EQUAL_INT(-INT16_MAX, PROTOCOL_JOINT_STATE_TORQUE_RAW_MIN);
}

static void test_a_stop_command_packs_where_its_signals_are(void) {
    const struct tauperp_stop_command_t stop = {.joint = 7,
                                                .permission = 1,
                                                .permission_inverted = 14,
                                                .stop_category = 2,
                                                .channel = 3,
                                                .cycle = 0xA,
                                                .reason = 6,
                                                .full_speed = 1,
                                                .trip_number = 0xC3,
                                                .index_value = -300};
    const uint8_t expected[8] = {0x00, 0x70, 0xE1, 0xAE, 0x86, 0xC3, 0xD4, 0xFE};
    uint8_t frame[8];
    tauperp_stop_command_pack(frame, &stop);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, frame, sizeof(frame));
}

static void test_a_guard_index_packs_any_joint_by_one_layout(void) {
    for (uint8_t joint = 0; joint < 8u; ++joint) {
        const struct tauperp_guard_index_t index = {
            .joint = joint, .residual = -2, .index = 258, .threshold = 0x3EDC, .channel = 2};
        const uint8_t expected[8] = {0x00, (uint8_t)(joint << 4), 0xFE, 0xFF, 0x02, 0x01, 0xDC, 0xBE};
        uint8_t frame[8];
        tauperp_guard_index_pack(frame, &index);
        TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, frame, sizeof(frame));
    }
}

/* Every raw value to physical and back, compared with the exact value in double; num_t has steps of `step` there. */
static void assert_scale(scale_t scale, double factor, int32_t min, int32_t max) {
    for (int32_t raw = min; raw <= max; ++raw) {
        const num_t value = scale_to_num(raw, scale);
        const double exact = raw * factor;
#ifdef TAUPERP_FIXED
        const double error = (double)value / 4194304.0 - exact;
        const double allowed = 1.0 / 4194304.0;
#else
        const double error = (double)value - exact;
        const double allowed = ((exact < 0) ? -exact : exact) / 8388608.0; /* two roundings to 24 bits */
#endif
        TEST_ASSERT_TRUE((error <= allowed) && (-error <= allowed));
        TEST_ASSERT_EQUAL_INT(raw, scale_to_raw(value, scale, min, max));
    }
}

static void test_every_raw_value_scales_to_num_and_back(void) {
    assert_scale(PROTOCOL_JOINT_STATE_POSITION_SCALE, 1.25e-4, -32768, 32767);
    assert_scale(PROTOCOL_JOINT_STATE_VELOCITY_SCALE, 2.5e-4, -32768, 32767);
    assert_scale(PROTOCOL_JOINT_STATE_TORQUE_SCALE, 0.01, -32768, 32767);
    assert_scale(PROTOCOL_TASK_COMMAND_ACCEL_X_SCALE, 0.001, -32768, 32767);
    assert_scale(PROTOCOL_GUARD_STATUS_SMALLEST_SINGULAR_SCALE, 1e-4, 0, 65535);
    assert_scale(PROTOCOL_GUARD_INDEX_THRESHOLD_SCALE, 0.01, 0, 51100); /* 511 Nm is what num_t holds in fixed point */
}

static void test_a_report_rounds_to_the_nearest_raw_value_halves_away_from_zero(void) {
    const scale_t scale = PROTOCOL_GUARD_INDEX_INDEX_SCALE;
    TEST_ASSERT_EQUAL_INT(0, scale_to_raw(NUM(0.0049), scale, -100, 100));
    TEST_ASSERT_EQUAL_INT(1, scale_to_raw(NUM(0.0051), scale, -100, 100));
    TEST_ASSERT_EQUAL_INT(-1, scale_to_raw(NUM(-0.0051), scale, -100, 100));
    TEST_ASSERT_EQUAL_INT(13, scale_to_raw(NUM(0.125), scale, -100, 100));
    TEST_ASSERT_EQUAL_INT(-13, scale_to_raw(NUM(-0.125), scale, -100, 100));
}

static void test_a_report_that_does_not_fit_is_limited(void) {
    const scale_t scale = PROTOCOL_GUARD_INDEX_INDEX_SCALE;
    TEST_ASSERT_EQUAL_INT(32767, scale_to_raw(NUM(400), scale, -32767, 32767));
    TEST_ASSERT_EQUAL_INT(-32767, scale_to_raw(NUM(-400), scale, -32767, 32767));
    TEST_ASSERT_EQUAL_INT(32767, scale_to_raw(NUM(327.7), scale, -32767, 32767));
    TEST_ASSERT_EQUAL_INT(0, scale_to_raw(NUM(-0.01), scale, 0, 65535));
#ifndef TAUPERP_FIXED
    const float infinity = 3.0e38f * 10.0f;
    TEST_ASSERT_EQUAL_INT(32767, scale_to_raw(infinity, scale, -32767, 32767));
    TEST_ASSERT_EQUAL_INT(-32767, scale_to_raw(-infinity, scale, -32767, 32767));
    TEST_ASSERT_EQUAL_INT(-32767, scale_to_raw(infinity - infinity, scale, -32767, 32767));
#else
    TEST_ASSERT_EQUAL_INT(32767, scale_to_raw(INT32_MAX, scale, -32767, 32767));
    TEST_ASSERT_EQUAL_INT(-32767, scale_to_raw(INT32_MIN, scale, -32767, 32767));
#endif
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_every_id_of_the_table_has_its_own_slot);
    RUN_TEST(test_no_other_id_has_a_slot);
    RUN_TEST(test_a_joints_slot_is_its_number);
    RUN_TEST(test_every_slot_is_of_its_kind_and_length);
    RUN_TEST(test_the_stop_command_outranks_every_message);
    RUN_TEST(test_every_periodic_input_times_out_before_its_counter_repeats);
    RUN_TEST(test_a_joint_frame_unpacks_where_its_signals_are);
    RUN_TEST(test_the_raw_value_for_not_available_is_out_of_range);
    RUN_TEST(test_a_stop_command_packs_where_its_signals_are);
    RUN_TEST(test_a_guard_index_packs_any_joint_by_one_layout);
    RUN_TEST(test_every_raw_value_scales_to_num_and_back);
    RUN_TEST(test_a_report_rounds_to_the_nearest_raw_value_halves_away_from_zero);
    RUN_TEST(test_a_report_that_does_not_fit_is_limited);
    return UNITY_END();
}
