/* fuzz: common parts of the fuzz targets: reading the input, a verdict that ends the process, and a count of frames. */
#ifndef FUZZ_H
#define FUZZ_H

#include <inttypes.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "frame.h"
#include "protocol.h"

#define REQUIRE(condition)                                                                                             \
    do {                                                                                                               \
        if (!(condition)) {                                                                                            \
            (void)fprintf(stderr, "%s:%d: not so: %s\n", __FILE__, __LINE__, #condition);                              \
            abort();                                                                                                   \
        }                                                                                                              \
    } while (false)

/* The bytes of an input, read from the front. After the end every byte is 0. */
typedef struct {
    const uint8_t *data;
    size_t size;
} bytes_t;

static inline uint8_t next8(bytes_t *bytes) {
    if (bytes->size == 0u) {
        return 0u;
    }
    --bytes->size;
    return *bytes->data++;
}

static inline uint16_t next16(bytes_t *bytes) {
    const uint16_t low = next8(bytes);
    return (uint16_t)(low | (uint16_t)(next8(bytes) << 8));
}

/* CRC-8 of E2E profile 2, bit by bit: the firmware's table is not used. */
static inline uint8_t crc8(uint8_t crc, uint8_t byte) {
    crc ^= byte;
    for (uint32_t bit = 0; bit < 8u; ++bit) {
        crc = (uint8_t)(((crc & 0x80u) != 0u) ? ((uint32_t)crc << 1) ^ 0x2Fu : ((uint32_t)crc << 1));
    }
    return crc;
}

static inline bool crc_is_good(const uint8_t *data, uint8_t length, const uint8_t *data_ids) {
    uint8_t crc = 0xFFu;
    for (uint32_t i = 1; i < length; ++i) {
        crc = crc8(crc, data[i]);
    }
    return data[0] == (uint8_t)(crc8(crc, data_ids[data[1] & 0x0Fu]) ^ 0xFFu);
}

/* Counts of a run. Printed at the end of the process, for tools/fuzz. */
extern uint64_t fuzz_frames, fuzz_ticks;
void fuzz_count_at_exit(void);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#endif
