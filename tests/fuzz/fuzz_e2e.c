/* fuzz_e2e: sequences of frames against e2e.c, judged by a second implementation of AUTOSAR E2E profile 2. */
#include <string.h>

#include "e2e.h"
#include "fuzz.h"

typedef struct {
    bool referenced;
    uint32_t counter;
} model_t;

/* The receiver's required status, from the definition: distances of counters modulo 16. */
static e2e_status_t expected(model_t *model, const can_frame_t *frame, const uint8_t *data_ids, uint32_t max_delta) {
    if (!crc_is_good(frame->data, frame->length, data_ids)) {
        return E2E_WRONG_CRC;
    }
    const uint32_t counter = frame->data[1] % 16u;
    const uint32_t step = (counter + 16u - model->counter) % 16u;
    const model_t before = *model;
    if (before.referenced && (step == 0u)) {
        return E2E_REPEATED;
    }
    *model = (model_t){.referenced = true, .counter = counter};
    if (!before.referenced) {
        return E2E_INITIAL;
    }
    if (step > max_delta) {
        return E2E_WRONG_SEQUENCE;
    }
    return (step == 1u) ? E2E_OK : E2E_SOME_LOST;
}

static can_frame_t next_frame(bytes_t *bytes, e2e_transmitter_t *sender, const protocol_receive_t *entry) {
    const uint8_t op = next8(bytes);
    can_frame_t frame = {.length = (uint8_t)(2u + (op & 7u) % 7u)};
    for (uint32_t i = 1; i < frame.length; ++i) {
        frame.data[i] = next8(bytes);
    }
    if ((op & 0x08u) != 0u) { /* a sender with its own counter */
        const uint8_t before = sender->counter;
        e2e_protect(sender, frame.data, frame.length, entry->data_ids);
        REQUIRE(sender->counter == (before + 1u) % 16u);
        REQUIRE(e2e_transmitter_is_valid(sender));
        REQUIRE(crc_is_good(frame.data, frame.length, entry->data_ids));
    } else {
        e2e_seal(frame.data, frame.length, entry->data_ids, (uint8_t)(op >> 4));
        REQUIRE((frame.data[1] & 0x0Fu) == (op >> 4));
        REQUIRE(crc_is_good(frame.data, frame.length, entry->data_ids));
    }
    if ((op & 0x80u) != 0u) {
        frame.data[next8(bytes) % frame.length] ^= next8(bytes);
    }
    return frame;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    bytes_t bytes = {.data = data, .size = size};
    const protocol_receive_t *const entry = &protocol_receive[next8(&bytes) % (uint32_t)PROTOCOL_RECEIVE_COUNT];
    const uint8_t max_delta = (uint8_t)(1u + next8(&bytes) % E2E_MAX_DELTA);
    e2e_receiver_t receiver = {0};
    e2e_transmitter_t sender = {.counter = next8(&bytes) % 16u};
    model_t model = {0};
    fuzz_count_at_exit();
    while (bytes.size > 0u) {
        const can_frame_t frame = next_frame(&bytes, &sender, entry);
        const e2e_receiver_t before = receiver;
        const e2e_status_t wanted = expected(&model, &frame, entry->data_ids, max_delta);
        const e2e_status_t status = e2e_check(&receiver, frame.data, frame.length, entry->data_ids, max_delta);
        ++fuzz_frames;
        REQUIRE(status == wanted);
        REQUIRE(e2e_accepts(status) == ((wanted == E2E_OK) || (wanted == E2E_SOME_LOST)));
        REQUIRE(e2e_receiver_is_valid(&receiver));
        REQUIRE((receiver.referenced == model.referenced) && (receiver.counter == model.counter));
        if (status == E2E_SOME_LOST) {
            REQUIRE(receiver.lost == (uint8_t)((receiver.counter + 15u - before.counter) % 16u));
        }
        if ((status == E2E_WRONG_CRC) || (status == E2E_REPEATED)) {
            REQUIRE(memcmp(&before, &receiver, sizeof before) == 0);
        }
    }
    return 0;
}
