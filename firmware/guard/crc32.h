/* crc32: IEEE 802.3, reflected, as zlib's crc32(), over memory in slices of any size.
 *
 * Start with CRC32_START, update with each slice, and end with crc32_finish. Cost: about 12 instructions per byte and a
 * table of 64 bytes.
 */
#ifndef TAUPERP_CRC32_H
#define TAUPERP_CRC32_H

#include <stdint.h>

#define CRC32_START 0xFFFFFFFFu

uint32_t crc32_fold(uint32_t state, const uint8_t *data, uint32_t length);

static inline uint32_t crc32_finish(uint32_t state) {
    return state ^ 0xFFFFFFFFu;
}

#endif
