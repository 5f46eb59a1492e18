#include "e2e.h"
#include "protocol.h"
#include "unity.h"

#include <stdio.h>
#include <string.h>

#define LENGTH    8u
#define MAX_DELTA 4u

static const uint8_t ids[E2E_DATA_ID_COUNT] = {0x2A, 0x3E, 0xDA, 0x7D, 0x02, 0xA7, 0x55, 0x01,
                                               0x87, 0x52, 0x4E, 0x16, 0x18, 0x3A, 0x70, 0xED};
static e2e_receiver_t receiver;

void setUp(void) {
    memset(&receiver, 0, sizeof(receiver));
}
void tearDown(void) {}

/* One seeded stream for the whole program. */
static uint32_t random_state = 0x7A0Eu;

static uint8_t random_byte(void) {
    random_state ^= random_state << 13;
    random_state ^= random_state >> 17;
    random_state ^= random_state << 5;
    return (uint8_t)(random_state >> 8);
}

/* The definition, bit by bit: polynomial 0x2F, start and final xor 0xFF, most significant bit first. */
static uint8_t crc_by_division(const uint8_t *data, uint32_t length, const uint8_t *data_ids) {
    uint8_t crc = 0xFFu;
    for (uint32_t i = 1u; i <= length; ++i) {
        crc ^= (i < length) ? data[i] : data_ids[data[1] & 0x0Fu];
        for (int bit = 0; bit < 8; ++bit) {
            crc = (uint8_t)((crc & 0x80u) ? ((uint32_t)crc << 1) ^ 0x2Fu : (uint32_t)crc << 1);
        }
    }
    return crc ^ 0xFFu;
}

static e2e_status_t receive(uint8_t counter, uint8_t max_delta) {
    uint8_t frame[LENGTH] = {0, 0, 1, 2, 3, 4, 5, 6};
    e2e_seal(frame, LENGTH, ids, counter);
    return e2e_check(&receiver, frame, LENGTH, ids, max_delta);
}

static void test_the_crc_of_123456789_is_the_standards_check_value(void) {
    uint8_t frame[9] = {0, '1', '2', '3', '4', '5', '6', '7', '8'};
    uint8_t nine[E2E_DATA_ID_COUNT] = {0};
    nine[1] = '9'; /* '1' carries the counter 1 */
    e2e_seal(frame, sizeof(frame), nine, 1);
    TEST_ASSERT_EQUAL_HEX8('1', frame[1]);
    TEST_ASSERT_EQUAL_HEX8(0xDF, frame[0]);
}

static void test_the_table_agrees_with_division_on_random_frames_of_every_length(void) {
    printf("seed %u\n", (unsigned)random_state);
    for (uint32_t round = 0; round < 20000u; ++round) {
        uint8_t frame[64];
        uint8_t random_ids[E2E_DATA_ID_COUNT];
        const uint8_t length = (uint8_t)(2u + round % 63u);
        for (uint32_t i = 0; i < sizeof(frame); ++i) {
            frame[i] = random_byte();
        }
        for (uint32_t i = 0; i < sizeof(random_ids); ++i) {
            random_ids[i] = random_byte();
        }
        e2e_seal(frame, length, random_ids, random_byte());
        TEST_ASSERT_EQUAL_HEX8(crc_by_division(frame, length, random_ids), frame[0]);
    }
}

static void test_protect_counts_from_1_and_wraps_from_15_to_0(void) {
    e2e_transmitter_t transmitter = {0};
    for (uint32_t sent = 1; sent <= 40u; ++sent) {
        uint8_t frame[LENGTH] = {0};
        e2e_protect(&transmitter, frame, LENGTH, ids);
        TEST_ASSERT_EQUAL_UINT(sent % 16u, frame[1]);
        TEST_ASSERT_TRUE(e2e_transmitter_is_valid(&transmitter));
    }
}

static void test_sealing_changes_nothing_but_crc_and_counter(void) {
    uint8_t frame[LENGTH] = {0x11, 0xAB, 2, 3, 4, 5, 6, 7};
    const uint8_t rest[LENGTH - 2u] = {2, 3, 4, 5, 6, 7};
    e2e_seal(frame, LENGTH, ids, 0x35);
    TEST_ASSERT_EQUAL_HEX8(0xA5, frame[1]);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(rest, &frame[2], sizeof(rest));
}

static void test_the_first_good_frame_is_initial_and_updates_nothing(void) {
    for (uint8_t counter = 0; counter < 16u; ++counter) {
        memset(&receiver, 0, sizeof(receiver));
        TEST_ASSERT_EQUAL(E2E_INITIAL, receive(counter, MAX_DELTA));
        TEST_ASSERT_EQUAL(E2E_OK, receive((uint8_t)(counter + 1u), MAX_DELTA));
    }
    TEST_ASSERT_FALSE(e2e_accepts(E2E_INITIAL));
}

static void test_only_ok_and_some_lost_are_accepted(void) {
    for (int status = E2E_UNCHECKED; status <= E2E_OK; ++status) {
        TEST_ASSERT_EQUAL((status == E2E_OK) || (status == E2E_SOME_LOST), e2e_accepts((e2e_status_t)status));
    }
}

static void test_consecutive_frames_are_ok_through_the_wrap_from_15_to_0(void) {
    (void)receive(0, 1);
    for (uint8_t sent = 1; sent < 64u; ++sent) {
        TEST_ASSERT_EQUAL(E2E_OK, receive(sent, 1));
        TEST_ASSERT_EQUAL_UINT(0, receiver.lost);
    }
}

/* Every last counter, every step, every limit: the whole state machine after a good CRC. */
static void test_a_step_is_accepted_up_to_the_maximum_and_refused_beyond(void) {
    for (uint8_t max_delta = 1; max_delta <= E2E_MAX_DELTA; ++max_delta) {
        for (uint8_t last = 0; last < 16u; ++last) {
            for (uint8_t delta = 0; delta < 16u; ++delta) {
                memset(&receiver, 0, sizeof(receiver));
                (void)receive(last, max_delta);
                const e2e_status_t status = receive((uint8_t)(last + delta), max_delta);
                if (delta == 0u) {
                    TEST_ASSERT_EQUAL(E2E_REPEATED, status);
                } else if (delta == 1u) {
                    TEST_ASSERT_EQUAL(E2E_OK, status);
                } else if (delta <= max_delta) {
                    TEST_ASSERT_EQUAL(E2E_SOME_LOST, status);
                    TEST_ASSERT_EQUAL_UINT(delta - 1u, receiver.lost);
                } else {
                    TEST_ASSERT_EQUAL(E2E_WRONG_SEQUENCE, status);
                }
                TEST_ASSERT_TRUE(e2e_receiver_is_valid(&receiver));
            }
        }
    }
}

static void test_a_repeated_frame_is_refused_and_the_next_one_is_ok(void) {
    (void)receive(4, MAX_DELTA);
    TEST_ASSERT_EQUAL(E2E_OK, receive(5, MAX_DELTA));
    TEST_ASSERT_EQUAL(E2E_REPEATED, receive(5, MAX_DELTA));
    TEST_ASSERT_EQUAL(E2E_REPEATED, receive(5, MAX_DELTA));
    TEST_ASSERT_EQUAL(E2E_OK, receive(6, MAX_DELTA));
}

static void test_after_a_wrong_sequence_the_next_consecutive_frame_is_ok(void) {
    (void)receive(12, MAX_DELTA);
    TEST_ASSERT_EQUAL(E2E_SOME_LOST, receive(14, MAX_DELTA));
    TEST_ASSERT_EQUAL(E2E_WRONG_SEQUENCE, receive(3, MAX_DELTA)); /* a step of 5 */
    TEST_ASSERT_EQUAL_UINT(0, receiver.lost);
    TEST_ASSERT_EQUAL(E2E_OK, receive(4, MAX_DELTA));
}

static void test_a_frame_that_is_overtaken_is_refused(void) {
    (void)receive(6, MAX_DELTA);
    TEST_ASSERT_EQUAL(E2E_SOME_LOST, receive(8, MAX_DELTA));
    TEST_ASSERT_EQUAL(E2E_WRONG_SEQUENCE, receive(7, MAX_DELTA));
    TEST_ASSERT_EQUAL(E2E_SOME_LOST, receive(9, MAX_DELTA));
}

static void test_a_wrong_crc_is_refused_and_leaves_the_reference(void) {
    uint8_t frame[LENGTH] = {0};
    (void)receive(6, MAX_DELTA);
    (void)receive(8, MAX_DELTA);
    const e2e_receiver_t before = receiver;
    e2e_seal(frame, LENGTH, ids, 9);
    frame[0] ^= 0xFFu;
    TEST_ASSERT_EQUAL(E2E_WRONG_CRC, e2e_check(&receiver, frame, LENGTH, ids, MAX_DELTA));
    TEST_ASSERT_EQUAL_MEMORY(&before, &receiver, sizeof(before));
    TEST_ASSERT_EQUAL(E2E_OK, receive(9, MAX_DELTA));
}

static void test_a_wrong_crc_does_not_start_a_receiver(void) {
    uint8_t frame[LENGTH] = {0};
    e2e_seal(frame, LENGTH, ids, 3);
    frame[5] ^= 1u;
    TEST_ASSERT_EQUAL(E2E_WRONG_CRC, e2e_check(&receiver, frame, LENGTH, ids, MAX_DELTA));
    TEST_ASSERT_EQUAL(E2E_INITIAL, receive(4, MAX_DELTA));
}

/* The data ids that a receiver of the wire could confuse: all messages of all senders. */
static const uint8_t *wire_ids(uint32_t index) {
    return (index < PROTOCOL_RECEIVE_COUNT) ? protocol_receive[index].data_ids
                                            : protocol_transmit[index - PROTOCOL_RECEIVE_COUNT].data_ids;
}

static void test_a_frame_of_any_other_message_is_a_wrong_crc_at_every_counter(void) {
    for (uint32_t sender = 0; sender < PROTOCOL_RECEIVE_COUNT + PROTOCOL_TRANSMIT_COUNT; ++sender) {
        for (uint8_t counter = 0; counter < 16u; ++counter) {
            uint8_t frame[LENGTH] = {0, 0x10, 7, 6, 5, 4, 3, 2};
            e2e_seal(frame, LENGTH, wire_ids(sender), counter);
            for (uint32_t slot = 0; slot < PROTOCOL_RECEIVE_COUNT; ++slot) {
                const e2e_status_t expected = (slot == sender) ? E2E_INITIAL : E2E_WRONG_CRC;
                memset(&receiver, 0, sizeof(receiver));
                TEST_ASSERT_EQUAL(expected, e2e_check(&receiver, frame, LENGTH, protocol_receive[slot].data_ids, 4));
            }
        }
    }
}

/* Whether an error is detected depends only on the flipped bits and the counter (the CRC is linear in everything else).
 * The loops over messages and counters are therefore a proof for this wire, not a sample. */
static void assert_flips_found(uint32_t slot, uint64_t flips) {
    const protocol_receive_t *const entry = &protocol_receive[slot];
    for (uint8_t counter = 0; counter < 16u; ++counter) {
        uint8_t frame[LENGTH] = {0, 0x30, 0x12, 0xFF, 0x00, 0x5A, 0x80, 0x01};
        e2e_seal(frame, entry->length, entry->data_ids, counter);
        for (uint32_t i = 0; i < entry->length; ++i) {
            frame[i] ^= (uint8_t)(flips >> (8u * i));
        }
        memset(&receiver, 0, sizeof(receiver));
        TEST_ASSERT_EQUAL(E2E_WRONG_CRC, e2e_check(&receiver, frame, entry->length, entry->data_ids, entry->max_delta));
    }
}

static void test_every_flipped_bit_of_every_message_is_detected(void) {
    for (uint32_t slot = 0; slot < PROTOCOL_RECEIVE_COUNT; ++slot) {
        for (uint32_t bit = 0; bit < 8u * protocol_receive[slot].length; ++bit) {
            assert_flips_found(slot, 1ull << bit);
        }
    }
}

/* At this length the polynomial has a Hamming distance of 4. A flipped counter bit also selects another data id. */
static void test_every_two_or_three_flipped_bits_outside_the_counter_are_detected(void) {
    const uint64_t counter_bits = 0x0F00u;
    for (uint32_t slot = 0; slot < PROTOCOL_RECEIVE_COUNT; slot += 8u) { /* a joint and a 4-byte message */
        const uint32_t bits = 8u * protocol_receive[slot].length;
        for (uint32_t a = 0; a < bits; ++a) {
            for (uint32_t b = a + 1u; b < bits; ++b) {
                for (uint32_t c = b; c < bits; ++c) { /* c == b: two bits only */
                    const uint64_t flips = (1ull << a) | (1ull << b) | (1ull << c);
                    if ((flips & counter_bits) == 0u) {
                        assert_flips_found(slot, flips);
                    }
                }
            }
        }
    }
}

static void test_a_stuck_bus_of_all_zeros_or_ones_is_a_wrong_crc_for_every_message(void) {
    for (uint32_t slot = 0; slot < PROTOCOL_RECEIVE_COUNT; ++slot) {
        const protocol_receive_t *const entry = &protocol_receive[slot];
        for (uint32_t level = 0; level < 2u; ++level) {
            uint8_t frame[LENGTH];
            memset(frame, (level == 0u) ? 0x00 : 0xFF, sizeof(frame));
            memset(&receiver, 0, sizeof(receiver));
            TEST_ASSERT_EQUAL(E2E_WRONG_CRC, e2e_check(&receiver, frame, entry->length, entry->data_ids, 4));
        }
    }
}

static void test_a_corrupt_receiver_state_is_not_valid(void) {
    TEST_ASSERT_TRUE(e2e_receiver_is_valid(&receiver));
    const e2e_receiver_t corrupt[] = {
        {.counter = 16, .referenced = true}, {.lost = 14, .referenced = true}, {.counter = 1}, {.lost = 1}};
    for (uint32_t i = 0; i < sizeof(corrupt) / sizeof(corrupt[0]); ++i) {
        TEST_ASSERT_FALSE(e2e_receiver_is_valid(&corrupt[i]));
    }
    const e2e_transmitter_t transmitter = {.counter = 16};
    TEST_ASSERT_FALSE(e2e_transmitter_is_valid(&transmitter));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_crc_of_123456789_is_the_standards_check_value);
    RUN_TEST(test_the_table_agrees_with_division_on_random_frames_of_every_length);
    RUN_TEST(test_protect_counts_from_1_and_wraps_from_15_to_0);
    RUN_TEST(test_sealing_changes_nothing_but_crc_and_counter);
    RUN_TEST(test_the_first_good_frame_is_initial_and_updates_nothing);
    RUN_TEST(test_only_ok_and_some_lost_are_accepted);
    RUN_TEST(test_consecutive_frames_are_ok_through_the_wrap_from_15_to_0);
    RUN_TEST(test_a_step_is_accepted_up_to_the_maximum_and_refused_beyond);
    RUN_TEST(test_a_repeated_frame_is_refused_and_the_next_one_is_ok);
    RUN_TEST(test_after_a_wrong_sequence_the_next_consecutive_frame_is_ok);
    RUN_TEST(test_a_frame_that_is_overtaken_is_refused);
    RUN_TEST(test_a_wrong_crc_is_refused_and_leaves_the_reference);
    RUN_TEST(test_a_wrong_crc_does_not_start_a_receiver);
    RUN_TEST(test_a_frame_of_any_other_message_is_a_wrong_crc_at_every_counter);
    RUN_TEST(test_every_flipped_bit_of_every_message_is_detected);
    RUN_TEST(test_every_two_or_three_flipped_bits_outside_the_counter_are_detected);
    RUN_TEST(test_a_stuck_bus_of_all_zeros_or_ones_is_a_wrong_crc_for_every_message);
    RUN_TEST(test_a_corrupt_receiver_state_is_not_valid);
    return UNITY_END();
}
