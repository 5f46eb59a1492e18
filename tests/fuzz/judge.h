/* judge: the rules for every reception and every tick of a guard.
 *
 * It uses only the configuration and the wire's tables of the firmware: it has its own CRC, and it records the arrival
 * of each frame itself. A violation ends the process.
 */
#ifndef FUZZ_JUDGE_H
#define FUZZ_JUDGE_H

#include "guard.h"

/* Times are the guard's. All zero at the start of the guard. */
typedef struct {
    uint64_t sync_us, task_us, fresh_us; /* of the last Sync and TaskCommand with a right CRC, of the last evaluation */
    bool sync, task, fresh;
    bool reset_ever;       /* a GuardReset with Request 1 and a right CRC was received */
    bool reset_named[256]; /* the same since the last tick, by trip number */
    guard_state_t state;   /* of the last tick */
    uint8_t trip_number;
} judge_t;

/* A frame that changed the guard from `before` to `after`. */
void judge_reception(judge_t *judge, const guard_t *before, const guard_t *after, const can_frame_t *frame,
                     uint64_t now_us);

void judge_tick(judge_t *judge, const guard_config_t *config, const guard_output_t *out, uint64_t now_us);

#endif
