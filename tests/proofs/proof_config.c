/* firmware/guard/config.c: any block, also one that is damaged. */
#include "proof.h"

#include <stddef.h>

#include "config.c"

/* crc32_fold is shown in proof_small.c. */
static uint32_t any_crc;

uint32_t crc32_fold(uint32_t state, const uint8_t *data, uint32_t length) {
    (void)state;
    HOLDS(__CPROVER_r_ok(data, length), "the bytes are readable");
    __CPROVER_havoc_object(&any_crc);
    return any_crc;
}

static guard_status_t any_status;

guard_status_t config_bounds_check(const guard_config_t *config) {
    (void)config;
    return any_status;
}

void proof_config_check(void) {
    guard_config_t block;
    __CPROVER_havoc_object(&any_status);
    const guard_status_t status = config_check(&block);
    HOLDS((status != GUARD_OK) || (block.numeric == NUM_NUMERIC), "of this numeric type");
    HOLDS((status != GUARD_OK) || (block.wire == PROTOCOL_WIRE_CRC), "for this wire");
    HOLDS((status != GUARD_OK) || (any_status == GUARD_OK), "within the bounds");
    REACHED;
}

/* Row by row, with the row's number as a constant: an unknown one would make each word of a row one of seven. */
void proof_config_watch(void) {
    guard_config_t block;
    config_watch_t watch; /* possibly damaged */
    for (uint32_t task = 0; task < TASK_COUNT; ++task) {
        (void)config_watch_step(&watch, &block, task, task);
    }
    config_watch_start(&watch, &block);
    REACHED;
}
