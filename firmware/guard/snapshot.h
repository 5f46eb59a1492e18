/* snapshot: the joint readings of one cycle, complete only if every joint's sample of that cycle was received.
 *
 * The dynamics of an arm are wrong if q, qd and tau of its joints belong to different instants. Every joint samples at
 * the Sync frame and puts the low nibble of the cycle into its counter. A reading is accepted only if the nibble is
 * that of the current Sync. The next Sync drops a cycle with missing readings. The user of a complete snapshot takes it
 * once, and gets the number of cycles that its observer must bridge since the last one.
 *
 * The nibble cannot distinguish a frame from one 16 cycles older. The guard checks two more bits of the cycle, so only
 * multiples of 64 remain. A gap cannot be distinguished from the same gap plus 65536 cycles; the guard's deadlines are
 * shorter. Units: rad, rad/s, Nm; joints count from 0. Cost: constant per call, about 25 instructions.
 */
#ifndef TAUPERP_SNAPSHOT_H
#define TAUPERP_SNAPSHOT_H

#include "robot.h"

typedef enum {
    SNAPSHOT_NONE = 0,
    SNAPSHOT_NO_SYNC = 1,     /* refused: no cycle has started */
    SNAPSHOT_NO_JOINT = 2,    /* refused: the robot has no such joint */
    SNAPSHOT_LATE = 3,        /* refused: 1 to 8 cycles behind the current one */
    SNAPSHOT_WRONG_CYCLE = 4, /* refused: 1 to 7 cycles ahead, so a Sync was lost */
    SNAPSHOT_DUPLICATE = 5,   /* refused: this joint's reading was already received; the first one stays */
    SNAPSHOT_TAKEN = 6,       /* good; others are still missing */
    SNAPSHOT_COMPLETED = 7    /* good, and the last missing one */
} snapshot_status_t;

typedef struct {
    num_t position[ROBOT_MAX_JOINTS]; /* of one cycle if and only if snapshot_is_complete() */
    num_t velocity[ROBOT_MAX_JOINTS];
    num_t torque[ROBOT_MAX_JOINTS];
    uint16_t cycle;       /* cycle of the current Sync */
    uint16_t taken_cycle; /* cycle of the last taken snapshot */
    uint8_t received;     /* bit i: the reading of joint i was received */
    uint8_t expected;     /* value of `received` when complete */
    bool begun;           /* a cycle has started */
    bool taken;           /* the current cycle's snapshot has been taken */
    bool referenced;      /* taken_cycle is valid */
} snapshot_t;

/* Starts without a cycle and without a complete snapshot. Fails if and only if `joint_count` is not 1 to
 * ROBOT_MAX_JOINTS. */
bool snapshot_init(snapshot_t *self, uint32_t joint_count);

/* Starts a cycle at a good Sync. Missing readings of the previous cycle are no longer accepted. */
void snapshot_begin(snapshot_t *self, uint16_t cycle);

/* Forgets all earlier cycles, as after snapshot_init: the next snapshot is the first. */
void snapshot_restart(snapshot_t *self);

/* Adds one joint's good and in-range reading. `counter` is its E2E counter. A refused reading changes nothing. */
snapshot_status_t snapshot_add(snapshot_t *self, uint32_t joint, uint8_t counter, num_t position, num_t velocity,
                               num_t torque);

/* True if every joint's reading of `cycle` was received and the snapshot was not taken. A Sync or snapshot_take ends
 * it. */
bool snapshot_is_complete(const snapshot_t *self);

/* Marks the complete snapshot as taken. Returns the cycles since the last taken snapshot; 0: there is none.
 * Precondition: snapshot_is_complete(). */
uint32_t snapshot_take(snapshot_t *self);

/* True if the functions above can produce this state. Constant time. */
bool snapshot_is_valid(const snapshot_t *self);

#endif
