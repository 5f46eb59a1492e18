/* snapshot: the joint readings of one cycle, complete only when every joint's sample of that cycle is in.
 *
 * The dynamics of an arm are wrong if q, qd and tau of its joints belong to different instants. Every joint samples on
 * the Sync frame and puts the low nibble of that cycle into its counter, so a reading is taken only when that nibble
 * is the one of the current Sync. A cycle whose readings do not all arrive is dropped by the next Sync. The user of a
 * complete snapshot takes it once, and learns how many cycles its observer must bridge since the last one.
 *
 * The nibble cannot tell a frame from one 16 cycles older: the guard looks at two more bits of the cycle, which leaves
 * multiples of 64. Nor can it tell a gap from the same gap plus 65536 cycles: the guard's deadlines are shorter. Units:
 * rad, rad/s, Nm; joints count from 0. Cost: constant per call, about 25 instructions.
 */
#ifndef TAUPERP_SNAPSHOT_H
#define TAUPERP_SNAPSHOT_H

#include "robot.h"

typedef enum {
    SNAPSHOT_NONE = 0,
    SNAPSHOT_NO_SYNC = 1,     /* refused: no cycle has begun */
    SNAPSHOT_NO_JOINT = 2,    /* refused: the robot has no such joint */
    SNAPSHOT_LATE = 3,        /* refused: 1 to 8 cycles behind the current one */
    SNAPSHOT_WRONG_CYCLE = 4, /* refused: 1 to 7 cycles ahead, so a Sync did not get here */
    SNAPSHOT_DUPLICATE = 5,   /* refused: the joint's reading of this cycle is in; the first one stays */
    SNAPSHOT_TAKEN = 6,       /* good; others are missing still */
    SNAPSHOT_COMPLETED = 7    /* good, and the last one that was missing */
} snapshot_status_t;

typedef struct {
    num_t position[ROBOT_MAX_JOINTS]; /* of one cycle if and only if snapshot_is_complete() */
    num_t velocity[ROBOT_MAX_JOINTS];
    num_t torque[ROBOT_MAX_JOINTS];
    uint16_t cycle;       /* of the current Sync */
    uint16_t taken_cycle; /* of the last snapshot that was taken */
    uint8_t received;     /* bit i: the reading of joint i is in */
    uint8_t expected;     /* the same when complete */
    bool begun;           /* a cycle is under way */
    bool taken;           /* the current cycle's snapshot has been taken */
    bool referenced;      /* taken_cycle is one */
} snapshot_t;

/* Starts with no cycle begun and none complete. Fails iff `joint_count` is not 1 to ROBOT_MAX_JOINTS. */
bool snapshot_init(snapshot_t *self, uint32_t joint_count);

/* A good Sync: readings of `cycle` are awaited from here on and what is missing of the cycle before never comes. */
void snapshot_begin(snapshot_t *self, uint16_t cycle);

/* Forgets the cycles so far, as after snapshot_init: the next snapshot follows none. */
void snapshot_restart(snapshot_t *self);

/* One joint's good and in-range reading; `counter` is its E2E counter. A refused reading changes nothing. */
snapshot_status_t snapshot_add(snapshot_t *self, uint32_t joint, uint8_t counter, num_t position, num_t velocity,
                               num_t torque);

/* Every joint's reading of `cycle` is in and nobody has taken it; a Sync or snapshot_take ends it. */
bool snapshot_is_complete(const snapshot_t *self);

/* Marks the complete snapshot as used and tells the cycles since the one taken before; 0: there is none to go on from.
 * Precondition: snapshot_is_complete(). */
uint32_t snapshot_take(snapshot_t *self);

/* True if the state is one that the functions above can leave behind. Constant time. */
bool snapshot_is_valid(const snapshot_t *self);

#endif
