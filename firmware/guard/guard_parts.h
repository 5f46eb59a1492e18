/* guard_parts: how guard.c is divided. For the files of this folder only. */
#ifndef TAUPERP_GUARD_PARTS_H
#define TAUPERP_GUARD_PARTS_H

#include "guard.h"

static inline void count(uint16_t *counter, uint32_t more) {
    const uint32_t room = (uint32_t)UINT16_MAX - *counter;
    *counter = (uint16_t)(*counter + ((more < room) ? more : room));
}

/* guard_stages.c: one snapshot through the stages. Bits of guard_t.stages: the stages that ran in this tick. */
enum { STAGE_MOTION = 1u, STAGE_OBSERVER = 2u, STAGE_INDEX = 4u, STAGE_DETECTOR = 8u, STAGE_ALL = 15u };

/* Takes the snapshot, which must be complete, and runs every stage on it; without a task only motion and observer. */
void stages_run(guard_t *self);

/* Every stage ran that was due. */
bool stages_complete(const guard_t *self);

/* Every result of this tick is a finite number, and the projection converged. */
bool stages_valid(const guard_t *self);

/* True if a fixed-point result did not fit since the last call. Updates guard_t.saturations. */
bool stages_saturated(guard_t *self);

/* guard_supervise.c: the guard's supervision of itself. Returns GUARD_REASON_NONE, or why the guard cannot be trusted
 * any more: a reason of FAULT. Once per tick, before anything else. */
guard_reason_t supervise(guard_t *self, uint64_t now_us);

/* The reason puts the guard in FAULT, which lasts until guard_init. */
bool reason_is_fault(guard_reason_t reason);

/* guard_report.c: fills the frames of `out` from its verdict and the state. */
void report_init(guard_report_t *self);
void report_tick(guard_t *guard, guard_output_t *out);

/* guard_self_test.c: known answers of the CRC, the E2E check and the projection, which is worked out in `scratch` and
 * leaves it as after subspace_init. Cost: about 5,000 instructions. */
bool self_test(subspace_t *scratch);

#endif
