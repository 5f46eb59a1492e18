/* lockstep: guard time as bus time, for a robot that is simulated and waits for every answer.
 *
 * The calls of the guard and their times depend only on the order of the frames, never on durations:
 *   1. Guard time is period x cycles, counted from the first Sync. A frame is received at the time of the Sync before
 *      it. Only a Sync with a valid CRC advances time: by the difference of its cycle to the newest one, at most
 *      LOCKSTEP_MAX_STEP (beyond it every deadline has passed), and not at all if it repeats the newest or is older.
 *      Two older ones in a row come from a restarted robot: time continues with them.
 *   2. Each cycle gets exactly one tick at its time: when its joint readings are complete; otherwise, and for cycles
 *      whose Sync was lost, just before the next Sync is received.
 *   3. A robot that waits for the answer to a cycle with a lost frame would wait for ever. After LOCKSTEP_SILENCE_US
 *      of real time without a frame, the tick of rule 2 is made early. If that cycle has had its tick and joint
 *      readings arrived since, they belong to a cycle whose Sync was lost: time advances by one cycle, and that cycle
 *      gets its tick. After that nothing happens until the next frame.
 * A library driven in lockstep (frames of cycle k at k x period, then the tick) makes the same calls.
 */
#ifndef TAUPERP_LOCKSTEP_H
#define TAUPERP_LOCKSTEP_H

#include <stdbool.h>
#include <stdint.h>

#include "frame.h"

#define LOCKSTEP_MAX_STEP   16u
#define LOCKSTEP_SILENCE_US 250000u

/* Starts as all zero bytes, but for the period. */
typedef struct {
    uint32_t period_us;
    uint64_t now_us;
    uint32_t steps;  /* cycles that time has to go on by before the last frame that was heard */
    uint16_t newest; /* cycle */
    uint16_t behind; /* cycle of the last Sync, if that lay behind the newest */
    bool begun;      /* a Sync came in */
    bool is_behind;
    bool assumed; /* the newest cycle is one without Sync */
    bool ticked;  /* it had its tick */
    bool heard;   /* a joint reading came in since that tick */
} lockstep_t;

/* For each frame, before the guard receives it. Then lockstep_owes_tick until that is false; then the guard receives
 * the frame at now_us. */
void lockstep_hear(lockstep_t *self, const can_frame_t *frame);

/* True if a tick is to be made at now_us, before the frame that was heard. */
bool lockstep_owes_tick(lockstep_t *self);

/* The guard says that the cycle is complete: true if its tick is to be made now, at now_us. */
bool lockstep_complete(lockstep_t *self);

/* The bus has been silent: true if a tick is to be made, at now_us. */
bool lockstep_silence(lockstep_t *self);

#endif
