/* schedule: when to tick. One state machine for the boards' loop, the Linux process and the host's guard node.
 *
 * Real time. A tick comes as soon as the cycle is complete. Where that does not happen the clock makes it: a period
 * after a tick on no new snapshot; a period and the grace after one on a fresh snapshot. The grace is half of what the
 * tick deadline leaves over, at most half a period, so that a cycle with some jitter is not cut in two.
 *
 * Lockstep. Guard time is bus time (lockstep.h); the caller's clock only measures the silence of the bus.
 *
 * It has no clock: `now_us` is the caller's, monotonic. One frame takes these calls, in this order:
 *
 *     schedule_hear(&schedule, &frame, now_us);
 *     while (schedule_owes_tick(&schedule)) { TICK }
 *     guard_receive(&guard, &frame, schedule_time(&schedule, now_us));
 *     if (schedule_complete(&schedule, guard_cycle_complete(&guard))) { TICK }
 *
 * and whenever due_us has come, or more often: if (schedule_is_due(&schedule, now_us)) { TICK }
 *
 * TICK is guard_tick at schedule_time(now), the answer sent, then schedule_ticked.
 * What a board reports of its bus goes to guard_trip in every state; the guard decides what follows from it.
 */
#ifndef TAUPERP_SCHEDULE_H
#define TAUPERP_SCHEDULE_H

#include "config.h"
#include "lockstep.h"

/* While the configuration block is refused nothing in it is used: the guard says so at this rate. */
#define SCHEDULE_REFUSED_PERIOD_US   2000u
#define SCHEDULE_REFUSED_DEADLINE_US 8000u

typedef struct {
    uint32_t period_us;
    uint32_t tick_deadline_us; /* for the watchdog: a tick comes more often than this */
    uint32_t grace_us;         /* by which a cycle may be late after a tick on a fresh snapshot */
    bool in_lockstep;
    bool was_complete; /* the cycle, after the frame before */
    uint64_t due_us;   /* by the caller's clock: schedule_is_due has something to say from here on */
    lockstep_t lockstep;
} schedule_t;

/* `config`: the block that the guard accepted, or NULL if it refused it. The first tick is due at now_us; in lockstep
 * with the first complete cycle. */
void schedule_init(schedule_t *self, const guard_config_t *config, bool in_lockstep, uint64_t now_us);

/* For each frame, before the guard receives it. */
void schedule_hear(schedule_t *self, const can_frame_t *frame, uint64_t now_us);

/* True if a tick has to be made before the guard receives the frame that was heard. */
bool schedule_owes_tick(schedule_t *self);

/* `complete`: as guard_cycle_complete says after the frame. True if the cycle's tick has to be made now: once a cycle,
 * also in FAULT or SELF_TEST, where no tick takes the snapshot and it stays complete. */
bool schedule_complete(schedule_t *self, bool complete);

/* True if a tick has to be made because the time has come. Moves due_us on in lockstep. */
bool schedule_is_due(schedule_t *self, uint64_t now_us);

/* Guard time of a frame or tick at `now_us`. */
uint64_t schedule_time(const schedule_t *self, uint64_t now_us);

/* A tick began at `began_us`; `fresh` as it said. */
void schedule_ticked(schedule_t *self, uint64_t began_us, bool fresh);

#endif
