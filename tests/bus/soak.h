/* soak: common declarations of soak.c (the main loop), soak_robot.c (the robot and the faults of its frames) and
 * soak_judge.c (the expected reaction of the guard). */
#ifndef TAUPERP_SOAK_H
#define TAUPERP_SOAK_H

#include <inttypes.h>

#include "guard.h"

enum { MAX_FRAMES = 32 };

typedef enum {
    FAULT_NONE = 0,
    FAULT_LOST,
    FAULT_CORRUPT,
    FAULT_REPEATED,
    FAULT_DELAYED,
    FAULT_REORDERED,
    FAULT_ADDRESS,
    FAULT_LENGTH,
    FAULT_FORMAT,
    FAULT_STATUS,
    FAULT_RANGE,
    FAULT_INSERTED,
    FAULT_COUNT
} fault_t;

/* A frame between robot and guard, and its fault. */
typedef struct {
    can_frame_t frame;
    fault_t fault;
    uint64_t cycle; /* in which it was made */
    uint8_t kind;   /* protocol_kind_t it was sent as */
    uint8_t joint;
    bool genuine; /* sent by the robot unchanged, with true values */
} sent_t;

typedef struct {
    uint64_t frames, accepted, initial, crc, sequence, range, format,
        late; /* every frame counts in exactly one of these */
    uint64_t injected[FAULT_COUNT];
    uint64_t ticks, permitted, trips, resets, pushes, silences;
} tally_t;

typedef struct {
    guard_t guard;
    const guard_config_t *config;
    guard_output_t out;
    uint64_t random;
    uint64_t cycle;
    uint32_t joints;
    uint8_t hold[ROBOT_MAX_JOINTS][CAN_FRAME_DATA_LENGTH];
    sent_t queue[MAX_FRAMES];
    uint32_t queued;
    sent_t late[MAX_FRAMES]; /* for the next cycle */
    uint32_t late_count;

    /* the robot's account of what was delivered intact */
    uint64_t good_sync, good_joints, good_task; /* the newest cycle of each, plus one; 0: none */
    uint32_t joints_in;                         /* bit per joint of the current cycle */
    bool sync_in;
    bool bad_value; /* a sensor fault, a value out of range, or a StopCommand passed the E2E check in this cycle */

    bool was_permitted;
    bool stopped;    /* the permission ended, or a trip came before the first one */
    bool reset_sent; /* after that stop, and it named the trip */
    uint8_t reset_counter;
    uint32_t reset_cycles;
    uint64_t push_until, push_from, silent_until;
    uint32_t pushed_joint;
    bool seen[PROTOCOL_RECEIVE_COUNT]; /* a frame with a valid CRC arrived: the first one only sets the counter */
    tally_t tally;
} soak_t;

/* Fills the queue with the frames that reach the guard in this cycle. */
void robot_sends(soak_t *self);

/* Passes the queue to the guard, and checks each frame against its fault. Exits with 1 on a violation. */
void deliver(soak_t *self, uint64_t now_us);

/* Checks the tick's verdict against the guard's inputs. Exits with 1 on a violation. */
void judge(soak_t *self);

extern const char *const fault_names[FAULT_COUNT];

#endif
