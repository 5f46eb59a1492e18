#include "restarts.h"

#define RECORD_MAGIC 0x53545254u /* "TRTS" */

typedef struct {
    uint32_t magic;
    uint32_t count;
    uint32_t count_inverted;
} record_t;

/* Not cleared by the start-up code. */
__attribute__((section(".noinit"))) static record_t record;

static bool is_expected(guard_start_t cause) {
    return (cause == GUARD_START_POWER_ON) || (cause == GUARD_START_COMMANDED);
}

bool restarts_recorded(void) {
    return (record.magic == RECORD_MAGIC) && (record.count == ~record.count_inverted);
}

uint32_t restarts_note(guard_start_t cause) {
    const uint32_t too_many = GUARD_MAX_RESTARTS + 1u;
    uint32_t count = 0;
    if (!is_expected(cause)) {
        count = restarts_recorded() ? record.count : (GUARD_MAX_RESTARTS - 1u);
        count = (count < too_many) ? (count + 1u) : too_many;
    }
    record = (record_t){.magic = RECORD_MAGIC, .count = count, .count_inverted = ~count};
    return count;
}
