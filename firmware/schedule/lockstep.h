/* lockstep: guard time as bus time, for a simulated robot that waits for every answer.
 *
 * The calls of the guard and their times depend only on the order of the frames, never on durations:
 *   1. Guard time is period x cycles, counted from the first Sync. A frame is received at the time of the Sync before
 *      it. Only a Sync with a valid CRC advances time. It advances by the difference of its cycle to the newest cycle,
 *      at most by LOCKSTEP_MAX_STEP (after which every deadline has passed). It does not advance if the Sync repeats
 *      the newest cycle or is older. Two older Syncs in a row come from a restarted robot: time continues with them.
 *   2. Each cycle gets exactly one tick, at its time. The tick comes when the joint readings of the cycle are complete.
 *      For an incomplete cycle, and for a cycle with a lost Sync, it comes directly before the next Sync is received.
 *   3. A robot that waits for the answer to a cycle with a lost frame would wait for ever. After LOCKSTEP_SILENCE_US of
 *      real time without a frame, the tick of rule 2 is therefore made early. If that cycle already had its tick and
 *      joint readings arrived afterwards, they belong to a cycle whose Sync was lost: time advances by one cycle, and
 *      that cycle gets its tick. Then nothing happens until the next frame.
 * A library driven in lockstep (frames of cycle k at k x period, then the tick) makes the same calls.
 */
#ifndef TAUPERP_LOCKSTEP_H
#define TAUPERP_LOCKSTEP_H

#include <stdbool.h>
#include <stdint.h>

#include "frame.h"

#define LOCKSTEP_MAX_STEP   16u
#define LOCKSTEP_SILENCE_US 250000u

/* Starts as all zero bytes, except the period. */
typedef struct {
    uint32_t period_us;
    uint64_t now_us;
    uint32_t steps;  /* cycles by which guard time must advance before the last received frame may be delivered */
    uint16_t newest; /* cycle */
    uint16_t behind; /* cycle of the last Sync, if it was older than the newest */
    bool begun;      /* a Sync was received */
    bool is_behind;
    bool assumed; /* the newest cycle has no Sync */
    bool ticked;  /* the newest cycle had its tick */
    bool heard;   /* a joint reading was received after that tick */
} lockstep_t;

/* Call for each frame before the guard receives it. Then call lockstep_owes_tick until it is false. Then the guard
 * receives the frame at now_us. */
void lockstep_hear(lockstep_t *self, const can_frame_t *frame);

/* True if a tick must be made at now_us, before the last frame is delivered. */
bool lockstep_owes_tick(lockstep_t *self);

/* The guard reports that the cycle is complete. True if its tick must be made now, at now_us. */
bool lockstep_complete(lockstep_t *self);

/* The bus was silent. True if a tick must be made, at now_us. */
bool lockstep_silence(lockstep_t *self);

#endif
