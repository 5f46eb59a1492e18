/* firmware/wire: the E2E check, for frames of every length and content. */
#include "proof.h"

#include "e2e.c"
#include "protocol.c"

void proof_e2e_check(void) {
    uint8_t data[255];
    uint8_t ids[E2E_DATA_ID_COUNT];
    uint8_t length;
    uint8_t max_delta;
    e2e_receiver_t receiver;
    ASSUME((length >= 2u) && (max_delta >= 1u) && (max_delta <= E2E_MAX_DELTA));
    ASSUME(e2e_receiver_is_valid(&receiver));
    const e2e_receiver_t before = receiver;
    const e2e_status_t status = e2e_check(&receiver, data, length, ids, max_delta);
    HOLDS(e2e_receiver_is_valid(&receiver), "a valid receiver stays valid");
    if ((status == E2E_WRONG_CRC) || (status == E2E_REPEATED)) {
        HOLDS((receiver.counter == before.counter) && (receiver.referenced == before.referenced), "no new reference");
    }
    HOLDS(!e2e_accepts(status) || before.referenced, "the first frame is never accepted");
    HOLDS(!e2e_accepts(status) || (receiver.lost < max_delta), "an accepted step is within max_delta");
    REACHED;
}

void proof_e2e_protect(void) {
    uint8_t data[255];
    uint8_t ids[E2E_DATA_ID_COUNT];
    uint8_t length;
    e2e_transmitter_t transmitter;
    ASSUME(length >= 2u);
    e2e_protect(&transmitter, data, length, ids);
    HOLDS(e2e_transmitter_is_valid(&transmitter), "the transmitter is valid");
    REACHED;
}

/* A sealed frame passes the check of a receiver that expects its counter. */
void proof_sealed_frame_passes(void) {
    uint8_t data[8];
    uint8_t ids[E2E_DATA_ID_COUNT];
    e2e_receiver_t receiver;
    ASSUME(e2e_receiver_is_valid(&receiver) && receiver.referenced);
    e2e_transmitter_t transmitter = {.counter = receiver.counter};
    e2e_protect(&transmitter, data, sizeof(data), ids);
    HOLDS(e2e_check(&receiver, data, sizeof(data), ids, 1u) == E2E_OK, "a sealed frame passes");
    REACHED;
}

void proof_slot(void) {
    uint32_t id;
    const uint32_t slot = protocol_slot(id);
    HOLDS(slot <= (uint32_t)PROTOCOL_RECEIVE_COUNT, "an entry or the count");
    HOLDS((slot == (uint32_t)PROTOCOL_RECEIVE_COUNT) || (protocol_receive[slot].id == id), "the entry has the id");
    for (uint32_t i = 0; i < (uint32_t)PROTOCOL_RECEIVE_COUNT; ++i) {
        HOLDS((protocol_receive[i].length >= 2u) && (protocol_receive[i].length <= 8u),
              "a length that e2e_check accepts");
        HOLDS((protocol_receive[i].max_delta >= 1u) && (protocol_receive[i].max_delta <= E2E_MAX_DELTA), "a step");
    }
    REACHED;
}
