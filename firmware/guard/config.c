#include "config.h"

#include <stddef.h>

#include "config_bounds.h"
#include "crc32.h"
#include "protocol.h"

/* First byte that the CRC covers. */
#define COVERED offsetof(guard_config_t, numeric)

static bool crc_matches(const guard_config_t *config) {
    const uint8_t *const bytes = (const uint8_t *)config;
    const uint32_t length = (uint32_t)(sizeof(*config) - COVERED);
    return crc32_finish(crc32_fold(CRC32_START, &bytes[COVERED], length)) == config->crc;
}

static guard_status_t check_identity(const guard_config_t *config) {
    if (config->magic != CONFIG_MAGIC) {
        return GUARD_BAD_MAGIC;
    }
    if (config->schema != CONFIG_SCHEMA) {
        return GUARD_BAD_SCHEMA;
    }
    if (config->size != (uint32_t)sizeof(*config)) {
        return GUARD_BAD_SIZE;
    }
    if (!crc_matches(config)) {
        return GUARD_BAD_CRC;
    }
    if (config->numeric != NUM_NUMERIC) {
        return GUARD_BAD_NUMERIC;
    }
    return (config->wire == PROTOCOL_WIRE_CRC) ? GUARD_OK : GUARD_BAD_WIRE;
}

guard_status_t config_check(const guard_config_t *config) {
    const guard_status_t status = check_identity(config);
    return (status == GUARD_OK) ? config_bounds_check(config) : status;
}

enum { WORD_BYTES = 4, UNROLLED = 8, ROUND_BYTES = UNROLLED * WORD_BYTES };
_Static_assert((sizeof(guard_config_t) % (size_t)WORD_BYTES) == 0u, "the sum takes whole words");

/* Compilers make one load of the four. memcpy would be a call in an image that is compiled freestanding. */
static inline __attribute__((always_inline)) uint32_t with_word(uint32_t sum, const uint8_t *at) {
    const uint32_t word = (uint32_t)at[0] | ((uint32_t)at[1] << 8) | ((uint32_t)at[2] << 16) | ((uint32_t)at[3] << 24);
    return ((sum << 1) | (sum >> 31)) + word;
}

/* Unrolled here, because controllers compile this file for size. */
static uint32_t sum_of(const guard_config_t *config) {
    const uint8_t *const bytes = (const uint8_t *)config;
    const size_t rounds_end = sizeof(*config) - (sizeof(*config) % (size_t)ROUND_BYTES);
    uint32_t sum = 0;
    for (size_t i = 0; i < rounds_end; i += (size_t)ROUND_BYTES) {
        sum = with_word(sum, &bytes[i]);
        sum = with_word(sum, &bytes[i + 4u]);
        sum = with_word(sum, &bytes[i + 8u]);
        sum = with_word(sum, &bytes[i + 12u]);
        sum = with_word(sum, &bytes[i + 16u]);
        sum = with_word(sum, &bytes[i + 20u]);
        sum = with_word(sum, &bytes[i + 24u]);
        sum = with_word(sum, &bytes[i + 28u]);
    }
    for (size_t i = rounds_end; i < sizeof(*config); i += (size_t)WORD_BYTES) {
        sum = with_word(sum, &bytes[i]);
    }
    return sum;
}

void config_watch_start(config_watch_t *self, const guard_config_t *config) {
    self->sum = sum_of(config);
}

bool config_watch_step(const config_watch_t *self, const guard_config_t *config) {
    return sum_of(config) == self->sum;
}
