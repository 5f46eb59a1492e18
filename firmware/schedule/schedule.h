/* schedule: decides when to tick. One state machine for the boards' loop, the Linux process and the host's guard node.
 *
 * Real time. A tick comes as soon as the cycle is complete. If the cycle does not complete, the clock makes the tick:
 * one period after a tick without a new snapshot, and one period plus the grace after a tick on a fresh snapshot. The
 * grace is half of the margin that the tick deadline leaves, at most half a period. A cycle with some jitter thus gets
 * one tick.
 *
 * Lockstep. Guard time is bus time (lockstep.h). The caller's clock only measures the silence of the bus.
 *
 * The schedule has no clock: `now_us` comes from the caller's monotonic clock. One frame takes these calls, in this
 * order:
 *
 *     schedule_hear(&schedule, &frame, now_us);
 *     while (schedule_owes_tick(&schedule)) { TICK }
 *     guard_receive(&guard, &frame, schedule_time(&schedule, now_us));
 *     if (schedule_complete(&schedule, guard_cycle_complete(&guard))) { TICK }
 *
 * At due_us, or more often, the caller also calls: if (schedule_is_due(&schedule, now_us)) { TICK }
 *
 * TICK is: guard_tick at schedule_time(now), send the answer, then schedule_ticked. A board passes its bus faults to
 * guard_trip in every state. The guard decides on the consequence.
 */
#ifndef TAUPERP_SCHEDULE_H
#define TAUPERP_SCHEDULE_H

#include "config.h"
#include "lockstep.h"

/* Rate of ticks while the configuration block is refused. Nothing in the block is then used. */
#define SCHEDULE_REFUSED_PERIOD_US   2000u
#define SCHEDULE_REFUSED_DEADLINE_US 8000u

typedef struct {
    uint32_t period_us;
    uint32_t tick_deadline_us; /* for the watchdog: ticks come more often than this */
    uint32_t grace_us;         /* allowed delay of a cycle after a tick on a fresh snapshot */
    bool in_lockstep;
    bool was_complete; /* whether the cycle was complete after the last frame */
    uint64_t due_us;   /* on the caller's clock: from here on schedule_is_due may become true */
    lockstep_t lockstep;
} schedule_t;

/* `config`: the block that the guard accepted, or NULL if it refused it. The first tick is due at now_us, in lockstep
 * with the first complete cycle. */
void schedule_init(schedule_t *self, const guard_config_t *config, bool in_lockstep, uint64_t now_us);

/* Call for each frame, before the guard receives it. */
void schedule_hear(schedule_t *self, const can_frame_t *frame, uint64_t now_us);

/* True if a tick must be made before the guard receives the last frame. */
bool schedule_owes_tick(schedule_t *self);

/* `complete`: the result of guard_cycle_complete after the frame. True if the cycle's tick must be made now. It is true
 * once per cycle, also in FAULT and SELF_TEST, where no tick takes the snapshot and it stays complete. */
bool schedule_complete(schedule_t *self, bool complete);

/* True if a tick is due. In lockstep it advances due_us. */
bool schedule_is_due(schedule_t *self, uint64_t now_us);

/* Guard time of a frame or a tick at `now_us`. */
uint64_t schedule_time(const schedule_t *self, uint64_t now_us);

/* A tick started at `began_us`. `fresh`: whether it evaluated a new snapshot. */
void schedule_ticked(schedule_t *self, uint64_t began_us, bool fresh);

#endif
