/* e2e: AUTOSAR E2E profile 2. It detects corrupted, lost, repeated, reordered and misaddressed frames.
 *
 * Byte 0 of a frame is a CRC-8 (polynomial 0x2F, initial value and final XOR 0xFF). The low nibble of byte 1 is a
 * counter that wraps from 15 to 0. The CRC covers all bytes after it, then one of the message's 16 data ids. The
 * counter selects that id, so a frame of another message has a wrong CRC (AUTOSAR FO PRS E2EProtocol, chapter on
 * profile 2).
 *
 * The counter cannot distinguish a gap from the same gap plus 16 frames. The receiver must therefore set a deadline
 * below 16 cycles for every periodic message.
 *
 * Both state structs start as all zero bytes. Lengths are 2 to 255 bytes, and there are 16 ids. The functions check
 * neither: the caller takes both from the const tables of protocol.h. Cost: one table look-up per byte, about 70
 * instructions for an 8-byte frame on a Cortex-M; 256 bytes of const table.
 */
#ifndef TAUPERP_E2E_H
#define TAUPERP_E2E_H

#include <stdbool.h>
#include <stdint.h>

#define E2E_DATA_ID_COUNT 16u
#define E2E_COUNTER_MASK  0x0Fu
#define E2E_MAX_DELTA     14u /* a step of 15 means one step back */

typedef enum {
    E2E_UNCHECKED = 0,
    E2E_WRONG_CRC = 1,      /* corrupted, or another message; the reference stays */
    E2E_REPEATED = 2,       /* the same counter again; the reference stays */
    E2E_WRONG_SEQUENCE = 3, /* a step beyond the maximum, or backwards; becomes the new reference */
    E2E_INITIAL = 4,        /* the first valid CRC; becomes the reference */
    E2E_SOME_LOST = 5,      /* valid; `lost` frames before it are missing */
    E2E_OK = 6              /* valid, and the expected counter */
} e2e_status_t;

typedef struct {
    uint8_t counter; /* the reference */
    uint8_t lost;    /* frames missing directly before the last accepted one, 0 to 13 */
    bool referenced; /* false until the first valid CRC */
} e2e_receiver_t;

typedef struct {
    uint8_t counter; /* of the last protected frame; the first frame carries 1 */
} e2e_transmitter_t;

/* Checks one frame. The receiver may use the signals if and only if e2e_accepts() its status. `max_delta`: the largest
 * accepted counter step, 1 to E2E_MAX_DELTA. */
e2e_status_t e2e_check(e2e_receiver_t *self, const uint8_t *data, uint8_t length, const uint8_t *data_ids,
                       uint8_t max_delta);

bool e2e_accepts(e2e_status_t status);

/* Takes the next counter, then writes counter and CRC to `data`. All signals must already be in `data`. */
void e2e_protect(e2e_transmitter_t *self, uint8_t *data, uint8_t length, const uint8_t *data_ids);

/* Writes `counter` (its low nibble) and the CRC to `data`. For senders whose counter is the cycle's. */
void e2e_seal(uint8_t *data, uint8_t length, const uint8_t *data_ids, uint8_t counter);

/* True if the functions above can produce this state. Constant time. */
bool e2e_receiver_is_valid(const e2e_receiver_t *self);
bool e2e_transmitter_is_valid(const e2e_transmitter_t *self);

#endif
