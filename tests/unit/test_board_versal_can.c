/* The Versal's CAN driver with a model of its controller's registers. */
#include "canfd_model.h"

#include "messages.h"

static const uint32_t JOINT1 = 0x101u;
static const uint32_t STOP = TAUPERP_STOP_COMMAND_FRAME_ID;
static const uint32_t STATUS = TAUPERP_GUARD_STATUS_FRAME_ID;

static can_frame_t frame_of(uint32_t id, uint32_t flags, uint8_t first) {
    can_frame_t frame = {.id = id, .length = CAN_FRAME_DATA_LENGTH, .flags = (uint8_t)flags};
    for (uint32_t i = 0; i < CAN_FRAME_DATA_LENGTH; ++i) {
        frame.data[i] = (uint8_t)(first + i);
    }
    return frame;
}

static void deliver(uint32_t id, uint32_t flags, uint8_t first) {
    const can_frame_t frame = frame_of(id, flags, first);
    bus_receive(&frame, CAN_FRAME_DATA_LENGTH);
}

static bool answer(uint8_t first) {
    const can_frame_t frames[2] = {frame_of(STATUS, CAN_FRAME_FD | CAN_FRAME_BRS, first),
                                   frame_of(STOP, CAN_FRAME_FD | CAN_FRAME_BRS, first)};
    return can_answer(frames, 2u);
}

static void assert_same(const can_frame_t *expected, const can_frame_t *actual) {
    TEST_ASSERT_EQUAL_HEX32(expected->id, actual->id);
    TEST_ASSERT_EQUAL(expected->length, actual->length);
    TEST_ASSERT_EQUAL_HEX8(expected->flags, actual->flags);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected->data, actual->data, CAN_FRAME_DATA_LENGTH);
}

void setUp(void) {
    memset(&model, 0xEE, sizeof(model));
    model.on_bus = true;
    model.bus_off = false;
    stuck = false;
    can_init(FORMAT_FD);
}
void tearDown(void) {}

static void test_the_bit_rates_and_sample_points_are_those_of_the_wire(void) {
    const uint32_t clock = 80000000u;
    const uint32_t before = (model.btr & 0xFFu) + 1u, after = ((model.btr >> 8) & 0x7Fu) + 1u;
    const uint32_t fast_before = (model.dpbtr & 0x1Fu) + 1u, fast_after = ((model.dpbtr >> 8) & 0xFu) + 1u;
    TEST_ASSERT_EQUAL(0, model.brpr);
    TEST_ASSERT_EQUAL(0, model.dpbrpr & 0xFFu);
    TEST_ASSERT_EQUAL(1000000u, clock / (1u + before + after));
    TEST_ASSERT_EQUAL(5000000u, clock / (1u + fast_before + fast_after));
    TEST_ASSERT_EQUAL(80, 100u * (1u + before) / (1u + before + after));
    TEST_ASSERT_EQUAL(75, 100u * (1u + fast_before) / (1u + fast_before + fast_after));
    TEST_ASSERT_TRUE((model.btr >> 16) < after); /* jump width, less one, within the second phase */
    TEST_ASSERT_TRUE((model.dpbtr >> 16) < fast_after);
    TEST_ASSERT_BITS_HIGH(CAN_DPBRPR_TDC, model.dpbrpr);
    TEST_ASSERT_TRUE(model.on_bus);
}

static void test_the_filters_pass_only_the_frames_that_the_guard_receives(void) {
    for (uint32_t id = 0; id < 0x800u; ++id) {
        can_frame_t frame;
        deliver(id, CAN_FRAME_FD | CAN_FRAME_BRS, 1u);
        const bool own = id == protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND].id; /* another guard's */
        TEST_ASSERT_EQUAL(own || (protocol_slot(id) < (uint32_t)PROTOCOL_RECEIVE_COUNT), can_receive(&frame));
        deliver(id << 18, CAN_FRAME_EXTENDED, 1u);
        TEST_ASSERT_FALSE(can_receive(&frame));
    }
}

static void test_a_frame_is_received_as_it_was_sent(void) {
    static const uint32_t flags[] = {0u, CAN_FRAME_FD, CAN_FRAME_FD | CAN_FRAME_BRS, CAN_FRAME_REMOTE};
    for (uint32_t i = 0; i < sizeof(flags) / sizeof(flags[0]); ++i) {
        const can_frame_t sent = frame_of(JOINT1, flags[i], (uint8_t)(0xA0u + 16u * i));
        can_frame_t heard;
        bus_receive(&sent, sent.length);
        TEST_ASSERT_TRUE(can_receive(&heard));
        assert_same(&sent, &heard);
        TEST_ASSERT_FALSE(can_receive(&heard));
    }
}

static void test_length_codes_above_eight_are_reported_and_only_eight_bytes_are_read(void) {
    can_frame_t sent = frame_of(JOINT1, CAN_FRAME_FD, 1u), heard;
    bus_receive(&sent, 15u);
    TEST_ASSERT_TRUE(can_receive(&heard));
    TEST_ASSERT_EQUAL(64, heard.length);
    sent.flags = 0;
    bus_receive(&sent, 15u);
    TEST_ASSERT_TRUE(can_receive(&heard));
    TEST_ASSERT_EQUAL(8, heard.length);
}

static void test_an_overflow_is_reported_once_and_the_frames_before_it_are_kept(void) {
    for (uint32_t i = 0; i < FIFO_DEPTH; ++i) {
        deliver(JOINT1, CAN_FRAME_FD, (uint8_t)i);
    }
    TEST_ASSERT_EQUAL(0, can_faults());
    deliver(JOINT1, CAN_FRAME_FD, 0xFFu);
    TEST_ASSERT_EQUAL(CAN_FAULT_OVERFLOW, can_faults());
    TEST_ASSERT_EQUAL(0, can_faults());
    for (uint32_t i = 0; i < FIFO_DEPTH; ++i) {
        can_frame_t frame;
        TEST_ASSERT_TRUE(can_receive(&frame));
        TEST_ASSERT_EQUAL_HEX8(i, frame.data[0]);
    }
    deliver(JOINT1, CAN_FRAME_FD, 7u); /* reception continues */
    can_frame_t frame;
    TEST_ASSERT_TRUE(can_receive(&frame));
    TEST_ASSERT_EQUAL_HEX8(7, frame.data[0]);
}

static void test_the_stop_command_of_an_answer_is_sent_first(void) {
    const can_frame_t stop = frame_of(STOP, CAN_FRAME_FD | CAN_FRAME_BRS, 0x51u);
    const can_frame_t status = frame_of(STATUS, CAN_FRAME_FD | CAN_FRAME_BRS, 0x51u);
    TEST_ASSERT_TRUE(answer(0x51u));
    bus_transmit();
    TEST_ASSERT_EQUAL(2, model.sent_count);
    assert_same(&stop, &model.sent[0]);
    assert_same(&status, &model.sent[1]);
    TEST_ASSERT_EQUAL(0, can_faults());
}

static void test_an_unsent_answer_is_cancelled_and_reported(void) {
    model.stalled = true;
    TEST_ASSERT_TRUE(answer(1u));
    TEST_ASSERT_EQUAL(0, can_faults());
    TEST_ASSERT_TRUE(answer(2u));
    TEST_ASSERT_EQUAL(CAN_FAULT_STUCK, can_faults());
    model.stalled = false;
    bus_transmit();
    TEST_ASSERT_EQUAL(2, model.sent_count);
    TEST_ASSERT_EQUAL_HEX8(2, model.sent[0].data[0]);
    TEST_ASSERT_EQUAL_HEX8(2, model.sent[1].data[0]);
}

static void test_a_frame_in_transmission_does_not_delay_the_next_answer(void) {
    model.stalled = true;
    TEST_ASSERT_TRUE(answer(1u));
    model.on_the_wire = 1u;
    TEST_ASSERT_TRUE(answer(2u));
    model.on_the_wire = 0;
    model.stalled = false;
    bus_transmit();
    TEST_ASSERT_EQUAL(3, model.sent_count);
    TEST_ASSERT_EQUAL_HEX32(STOP, model.sent[0].id);
    TEST_ASSERT_EQUAL_HEX8(2, model.sent[0].data[0]);
}

static void test_without_a_free_buffer_the_answer_is_refused(void) {
    model.pending = UINT32_MAX;
    model.on_the_wire = UINT32_MAX;
    TEST_ASSERT_FALSE(answer(1u));
    TEST_ASSERT_EQUAL(CAN_FAULT_STUCK, can_faults());
}

static void test_bus_off_is_reported_and_the_controller_recovers(void) {
    bus_goes_off();
    TEST_ASSERT_EQUAL(CAN_FAULT_OFF, can_faults());
    TEST_ASSERT_FALSE(model.bus_off);
    TEST_ASSERT_EQUAL(0, can_faults());
    TEST_ASSERT_TRUE(answer(9u));
    bus_transmit();
    TEST_ASSERT_EQUAL(2, model.sent_count);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_bit_rates_and_sample_points_are_those_of_the_wire);
    RUN_TEST(test_the_filters_pass_only_the_frames_that_the_guard_receives);
    RUN_TEST(test_a_frame_is_received_as_it_was_sent);
    RUN_TEST(test_length_codes_above_eight_are_reported_and_only_eight_bytes_are_read);
    RUN_TEST(test_an_overflow_is_reported_once_and_the_frames_before_it_are_kept);
    RUN_TEST(test_the_stop_command_of_an_answer_is_sent_first);
    RUN_TEST(test_an_unsent_answer_is_cancelled_and_reported);
    RUN_TEST(test_a_frame_in_transmission_does_not_delay_the_next_answer);
    RUN_TEST(test_without_a_free_buffer_the_answer_is_refused);
    RUN_TEST(test_bus_off_is_reported_and_the_controller_recovers);
    return UNITY_END();
}
