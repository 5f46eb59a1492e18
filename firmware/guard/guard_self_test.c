#include "crc32.h"
#include "guard_parts.h"

/* The CRC catalogue's check value of CRC-32/ISO-HDLC. */
static bool crc32_answers(void) {
    static const uint8_t digits[9] = {'1', '2', '3', '4', '5', '6', '7', '8', '9'};
    return crc32_finish(crc32_fold(CRC32_START, digits, sizeof(digits))) == 0xCBF43926u;
}

/* A sealed frame passes; the same frame with one bit flipped does not. */
static bool e2e_answers(void) {
    const uint8_t *const ids = protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND].data_ids;
    const uint8_t max_delta = 1;
    uint8_t frame[8] = {0, 0, 1, 2, 3, 4, 5, 6};
    e2e_transmitter_t transmitter = {0};
    e2e_receiver_t receiver = {0};
    e2e_protect(&transmitter, frame, sizeof(frame), ids);
    const bool first = e2e_check(&receiver, frame, sizeof(frame), ids, max_delta) == E2E_INITIAL;
    e2e_protect(&transmitter, frame, sizeof(frame), ids);
    frame[5] ^= 0x10u;
    const bool refused = e2e_check(&receiver, frame, sizeof(frame), ids, max_delta) == E2E_WRONG_CRC;
    frame[5] ^= 0x10u;
    return first && refused && (e2e_check(&receiver, frame, sizeof(frame), ids, max_delta) == E2E_OK);
}

static bool near(num_t a, num_t b) {
    return num_abs(a - b) < NUM(1e-4);
}

/* A = [e1 + e2, e2 - e1] / 4 and tau = (1, 2, 3): both directions explained, only e3 is left; with the tolerance above
 * both singular values (0.3536) nothing is. */
static bool projection_answers(subspace_t *subspace) {
    static const num_t column[2][ROBOT_MAX_JOINTS] = {{NUM(0.25), NUM(0.25)}, {NUM(-0.25), NUM(0.25)}};
    const num_t tau[ROBOT_MAX_JOINTS] = {NUM(1), NUM(2), NUM(3)};
    num_t left[ROBOT_MAX_JOINTS] = {NUM(0)};
    subspace_init(subspace);
    subspace_step(subspace, 3u, 2u, column, NUM(0.01));
    subspace_reject(subspace, tau, left);
    const bool explained =
        (subspace->rank == 2u) && near(left[0], NUM(0)) && near(left[1], NUM(0)) && near(left[2], NUM(3));
    subspace_step(subspace, 3u, 2u, column, NUM(0.5));
    subspace_reject(subspace, tau, left);
    const bool kept = (subspace->rank == 0u) && near(left[0], NUM(1)) && near(left[1], NUM(2)) &&
                      near(left[2], NUM(3)) && near(subspace->smallest, NUM(0.353553));
    subspace_init(subspace);
    return explained && kept;
}

bool self_test(subspace_t *scratch) {
    return crc32_answers() && e2e_answers() && projection_answers(scratch);
}
