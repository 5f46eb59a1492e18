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

enum { WORD_BYTES = 4, FOUR_BYTES = 4 * WORD_BYTES, ROUND_BYTES = 8 * FOUR_BYTES };
_Static_assert((sizeof(guard_config_t) % (size_t)WORD_BYTES) == 0u, "the sums take whole words");
_Static_assert((sizeof(task_config_t) % (size_t)WORD_BYTES) == 0u, "the sums take whole words");

/* What every tick reads: all before the rows of the tasks, and all after them. */
#define ROWS_BEGIN offsetof(guard_config_t, task)
#define ROWS_END   (ROWS_BEGIN + (TASK_COUNT * sizeof(task_config_t)))

/* Compilers make one load of the four. memcpy would be a call in an image that is compiled freestanding. */
static inline __attribute__((always_inline)) uint32_t with_word(uint32_t sum, const uint8_t *at) {
    const uint32_t word = (uint32_t)at[0] | ((uint32_t)at[1] << 8) | ((uint32_t)at[2] << 16) | ((uint32_t)at[3] << 24);
    return ((sum << 1) | (sum >> 31)) + word;
}

static inline __attribute__((always_inline)) uint32_t with_four(uint32_t sum, const uint8_t *at) {
    return with_word(with_word(with_word(with_word(sum, &at[0]), &at[4]), &at[8]), &at[12]);
}

static inline __attribute__((always_inline)) uint32_t with_sixteen(uint32_t sum, const uint8_t *at) {
    return with_four(with_four(with_four(with_four(sum, &at[0]), &at[16]), &at[32]), &at[48]);
}

/* Unrolled here, because controllers compile this file for size. */
static uint32_t with_words(uint32_t sum, const uint8_t *at, size_t length) {
    uint32_t with = sum;
    size_t done = 0;
    for (; (length - done) >= (size_t)ROUND_BYTES; done += (size_t)ROUND_BYTES) {
        with = with_sixteen(with_sixteen(with, &at[done]), &at[done + 64u]);
    }
    for (; (length - done) >= (size_t)FOUR_BYTES; done += (size_t)FOUR_BYTES) {
        with = with_four(with, &at[done]);
    }
    for (; done < length; done += (size_t)WORD_BYTES) {
        with = with_word(with, &at[done]);
    }
    return with;
}

static uint32_t common_sum(const guard_config_t *config) {
    const uint8_t *const bytes = (const uint8_t *)config;
    const uint32_t sum = with_words(0u, bytes, ROWS_BEGIN);
    return with_words(sum, &bytes[ROWS_END], sizeof(*config) - ROWS_END);
}

static uint32_t row_sum(const guard_config_t *config, uint32_t task) {
    return with_words(0u, (const uint8_t *)&config->task[task], sizeof(task_config_t));
}

void config_watch_start(config_watch_t *self, const guard_config_t *config) {
    self->common = common_sum(config);
    for (uint32_t t = 0; t < (uint32_t)TASK_COUNT; ++t) {
        self->row[t] = row_sum(config, t);
    }
}

bool config_watch_step(const config_watch_t *self, const guard_config_t *config, uint32_t active, uint32_t other) {
    return (common_sum(config) == self->common) && (row_sum(config, active) == self->row[active]) &&
           (row_sum(config, other) == self->row[other]);
}
