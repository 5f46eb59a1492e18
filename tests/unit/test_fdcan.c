/* The STM32G4's CAN driver with a model of its controller's registers. */
#include "fdcan_model.h"

#include "messages.h"

static const uint32_t JOINT1 = 0x101u;
static const uint32_t JOINT2 = 0x102u;
static const uint32_t SYNC = TAUPERP_SYNC_FRAME_ID;
static const uint32_t STOP = TAUPERP_STOP_COMMAND_FRAME_ID;
static const uint32_t STATUS = TAUPERP_GUARD_STATUS_FRAME_ID;

static can_frame_t frame_of(uint32_t id, uint8_t length, uint32_t flags) {
    can_frame_t frame = {.id = id, .length = length, .flags = (uint8_t)flags};
    for (uint32_t i = 0; i < length && i < CAN_FRAME_DATA_LENGTH; ++i) {
        frame.data[i] = (uint8_t)(0xA0u + i);
    }
    return frame;
}

static void deliver(uint32_t id, uint8_t length, uint32_t flags) {
    const can_frame_t frame = frame_of(id, length, flags);
    bus_receive(&frame, length);
}

void setUp(void) {
    memset(&model, 0, sizeof(model));
    memset(model.ram, 0xEE, sizeof(model.ram));
    model.control = CCCR_INIT; /* as after reset */
    can_init(FORMAT_FD);
}

void tearDown(void) {}

void test_the_bit_rates_are_those_of_the_wire(void) {
    const uint32_t clock = 85000000u;
    const uint32_t arbitration = 1u + (((model.nbtp >> 8) & 0xFFu) + 1u) + ((model.nbtp & 0x7Fu) + 1u);
    const uint32_t data = 1u + (((model.dbtp >> 8) & 0x1Fu) + 1u) + (((model.dbtp >> 4) & 0xFu) + 1u);
    TEST_ASSERT_EQUAL(0, (model.nbtp >> 16) & 0x1FFu);
    TEST_ASSERT_EQUAL(0, (model.dbtp >> 16) & 0x1Fu);
    TEST_ASSERT_EQUAL(1000000u, clock / arbitration);
    TEST_ASSERT_EQUAL(5000000u, clock / data);
    TEST_ASSERT_TRUE((model.nbtp >> 25) <= (model.nbtp & 0x7Fu)); /* jump width within the second phase */
    TEST_ASSERT_TRUE((model.dbtp & 0xFu) <= ((model.dbtp >> 4) & 0xFu));
    TEST_ASSERT_BITS_HIGH(1u << 23, model.dbtp);
}

void test_can_fd_and_its_bit_rate_switch_are_on_only_where_the_wire_has_them(void) {
    TEST_ASSERT_EQUAL(CCCR_FDOE | CCCR_BRSE, model.control);
    can_init(FORMAT_CLASSIC);
    TEST_ASSERT_EQUAL(0, model.control);
}

void test_every_frame_for_the_guard_is_received(void) {
    for (uint32_t slot = 0; slot < PROTOCOL_RECEIVE_COUNT; ++slot) {
        can_frame_t frame;
        deliver(protocol_receive[slot].id, protocol_receive[slot].length, CAN_FRAME_FD | CAN_FRAME_BRS);
        TEST_ASSERT_TRUE(can_receive(&frame));
        TEST_ASSERT_EQUAL_HEX32(protocol_receive[slot].id, frame.id);
        TEST_ASSERT_EQUAL(protocol_receive[slot].length, frame.length);
        TEST_ASSERT_EQUAL(CAN_FRAME_FD | CAN_FRAME_BRS, frame.flags);
        TEST_ASSERT_FALSE(can_receive(&frame));
    }
}

void test_no_other_frame_is_received(void) {
    for (uint32_t id = 0; id <= 0x7FFu; ++id) {
        can_frame_t frame;
        deliver(id, 8u, 0u);
        const bool heard = (protocol_slot(id) < PROTOCOL_RECEIVE_COUNT) || (id == STOP); /* of another guard */
        TEST_ASSERT_EQUAL(heard, can_receive(&frame));
    }
    can_frame_t frame;
    deliver(SYNC, 4u, CAN_FRAME_EXTENDED);
    TEST_ASSERT_FALSE(can_receive(&frame));
}

void test_bytes_keep_their_order_and_the_rest_is_zero(void) {
    can_frame_t frame;
    deliver(JOINT1, 8u, 0u);
    TEST_ASSERT_TRUE(can_receive(&frame));
    const can_frame_t expected = frame_of(JOINT1, 8u, 0u);
    TEST_ASSERT_EQUAL_MEMORY(&expected, &frame, sizeof(frame));
    deliver(JOINT1, 3u, 0u);
    TEST_ASSERT_TRUE(can_receive(&frame));
    const can_frame_t shorter = frame_of(JOINT1, 3u, 0u);
    TEST_ASSERT_EQUAL_MEMORY(&shorter, &frame, sizeof(frame));
}

void test_a_length_above_8_is_reported_as_on_the_wire(void) {
    can_frame_t frame;
    const can_frame_t long_one = frame_of(JOINT1, 8u, CAN_FRAME_FD);
    bus_receive(&long_one, 13u);
    TEST_ASSERT_TRUE(can_receive(&frame));
    TEST_ASSERT_EQUAL(32, frame.length);
    const can_frame_t classic = frame_of(JOINT1, 8u, 0u);
    bus_receive(&classic, 13u);
    TEST_ASSERT_TRUE(can_receive(&frame));
    TEST_ASSERT_EQUAL(8, frame.length);
}

void test_a_remote_request_is_reported_as_such(void) {
    can_frame_t frame;
    deliver(JOINT1, 8u, CAN_FRAME_REMOTE);
    TEST_ASSERT_TRUE(can_receive(&frame));
    TEST_ASSERT_BITS_HIGH(CAN_FRAME_REMOTE, frame.flags);
}

void test_a_sync_is_read_before_the_readings_of_its_cycle(void) {
    can_frame_t frame;
    deliver(SYNC, 4u, 0u);
    deliver(JOINT1, 8u, 0u);
    deliver(JOINT2, 8u, 0u);
    TEST_ASSERT_TRUE(can_receive(&frame));
    TEST_ASSERT_EQUAL_HEX32(SYNC, frame.id);
    TEST_ASSERT_TRUE(can_receive(&frame));
    TEST_ASSERT_EQUAL_HEX32(JOINT1, frame.id);
    TEST_ASSERT_TRUE(can_receive(&frame));
    TEST_ASSERT_EQUAL_HEX32(JOINT2, frame.id);
}

void test_a_fifo_wraps_around(void) {
    can_frame_t frame;
    for (uint32_t i = 0; i < 7u; ++i) {
        deliver(JOINT1, (uint8_t)i, CAN_FRAME_FD);
        TEST_ASSERT_TRUE(can_receive(&frame));
        TEST_ASSERT_EQUAL(i, frame.length);
    }
}

void test_a_lost_frame_is_an_overflow_once(void) {
    for (uint32_t i = 0; i < 3u; ++i) {
        deliver(JOINT1, 8u, 0u);
    }
    TEST_ASSERT_EQUAL(0, can_faults());
    deliver(JOINT1, 8u, 0u);
    TEST_ASSERT_EQUAL(CAN_FAULT_OVERFLOW, can_faults());
    TEST_ASSERT_EQUAL(0, can_faults());
    for (uint32_t i = 0; i < 4u; ++i) {
        deliver(SYNC, 4u, 0u);
    }
    TEST_ASSERT_EQUAL(CAN_FAULT_OVERFLOW, can_faults());
}

void test_an_answer_is_sent_with_the_stop_command_first(void) {
    const uint32_t flags = CAN_FRAME_FD | CAN_FRAME_BRS;
    const can_frame_t frames[2] = {frame_of(STATUS, 8u, flags), frame_of(STOP, 8u, flags)};
    TEST_ASSERT_TRUE(can_answer(frames, 2u));
    bus_transmit();
    TEST_ASSERT_EQUAL(2, model.sent_count);
    TEST_ASSERT_EQUAL_MEMORY(&frames[1], &model.sent[0], sizeof(can_frame_t));
    TEST_ASSERT_EQUAL_MEMORY(&frames[0], &model.sent[1], sizeof(can_frame_t));
    TEST_ASSERT_EQUAL(0, can_faults());
}

void test_an_unsent_answer_is_cancelled_and_never_sent_late(void) {
    const can_frame_t old[2] = {frame_of(STOP, 8u, 0u), frame_of(STATUS, 8u, 0u)};
    can_frame_t new[2] = {frame_of(STOP, 8u, 0u), frame_of(STATUS, 8u, 0u)};
    new[0].data[2] = 0x55u;
    model.stalled = true;
    TEST_ASSERT_TRUE(can_answer(old, 2u));
    TEST_ASSERT_EQUAL(0, can_faults());
    TEST_ASSERT_TRUE(can_answer(new, 2u));
    TEST_ASSERT_EQUAL(CAN_FAULT_STUCK, can_faults());
    model.stalled = false;
    bus_transmit();
    TEST_ASSERT_EQUAL(2, model.sent_count);
    TEST_ASSERT_EQUAL_MEMORY(&new[0], &model.sent[0], sizeof(can_frame_t));
}

void test_a_frame_in_transmission_leaves_buffers_for_the_next_answer(void) {
    const can_frame_t old[2] = {frame_of(STOP, 8u, 0u), frame_of(STATUS, 8u, 0u)};
    model.stalled = true;
    TEST_ASSERT_TRUE(can_answer(old, 2u));
    model.on_the_wire = 1u;
    TEST_ASSERT_TRUE(can_answer(old, 2u));
    TEST_ASSERT_EQUAL(7u, model.pending);
}

void test_an_answer_without_a_free_buffer_is_reported(void) {
    const can_frame_t old[2] = {frame_of(STOP, 8u, 0u), frame_of(STATUS, 8u, 0u)};
    model.stalled = true;
    model.on_the_wire = 7u;
    TEST_ASSERT_TRUE(can_answer(old, 2u));
    TEST_ASSERT_FALSE(can_answer(old, 2u));
    TEST_ASSERT_EQUAL(CAN_FAULT_STUCK, can_faults());
}

void test_bus_off_is_reported_and_its_recovery_begins(void) {
    bus_goes_off();
    TEST_ASSERT_EQUAL(CAN_FAULT_OFF, can_faults());
    TEST_ASSERT_EQUAL(0, model.control & CCCR_INIT);
    TEST_ASSERT_EQUAL(CCCR_FDOE | CCCR_BRSE, model.control & (CCCR_FDOE | CCCR_BRSE));
    TEST_ASSERT_EQUAL(0, can_faults());
    can_frame_t frame;
    deliver(SYNC, 4u, 0u);
    TEST_ASSERT_TRUE(can_receive(&frame));
}

static void test_a_controller_that_does_not_answer_at_start_is_reported_as_bus_down(void) {
    model.absent = true;
    can_init(FORMAT_FD);
    can_frame_t frame;
    const can_frame_t answer[2] = {{.id = 0x10u, .length = 8u}, {.id = 0x200u, .length = 8u}};
    TEST_ASSERT_FALSE(can_receive(&frame));
    TEST_ASSERT_FALSE(can_answer(answer, 2u));
    TEST_ASSERT_EQUAL(CAN_FAULT_STUCK, can_faults());
    TEST_ASSERT_EQUAL(CAN_FAULT_STUCK, can_faults()); /* the fault stays */
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_bit_rates_are_those_of_the_wire);
    RUN_TEST(test_can_fd_and_its_bit_rate_switch_are_on_only_where_the_wire_has_them);
    RUN_TEST(test_every_frame_for_the_guard_is_received);
    RUN_TEST(test_no_other_frame_is_received);
    RUN_TEST(test_bytes_keep_their_order_and_the_rest_is_zero);
    RUN_TEST(test_a_length_above_8_is_reported_as_on_the_wire);
    RUN_TEST(test_a_remote_request_is_reported_as_such);
    RUN_TEST(test_a_sync_is_read_before_the_readings_of_its_cycle);
    RUN_TEST(test_a_fifo_wraps_around);
    RUN_TEST(test_a_lost_frame_is_an_overflow_once);
    RUN_TEST(test_an_answer_is_sent_with_the_stop_command_first);
    RUN_TEST(test_an_unsent_answer_is_cancelled_and_never_sent_late);
    RUN_TEST(test_a_frame_in_transmission_leaves_buffers_for_the_next_answer);
    RUN_TEST(test_an_answer_without_a_free_buffer_is_reported);
    RUN_TEST(test_bus_off_is_reported_and_its_recovery_begins);
    RUN_TEST(test_a_controller_that_does_not_answer_at_start_is_reported_as_bus_down);
    return UNITY_END();
}
