/* soak: what its three files share: soak.c (the hour), soak_robot.c (the robot and what happens to its frames) and
 * soak_judge.c (what the guard must make of it). */
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

/* A frame on its way, and what was done to it. */
typedef struct {
    can_frame_t frame;
    fault_t fault;
    uint64_t cycle; /* that it was made for */
    uint8_t kind;   /* protocol_kind_t it was sent as */
    uint8_t joint;
    bool genuine; /* as the robot sent it, and true of the robot */
} sent_t;

typedef struct {
    uint64_t frames, accepted, initial, crc, sequence, range, format, late; /* every frame is in one of these */
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

    /* what the robot knows was delivered intact */
    uint64_t good_sync, good_joints, good_task; /* the newest cycle of each, plus one; 0: none */
    uint32_t joints_in;                         /* bit per joint of the cycle under way */
    bool sync_in;
    bool bad_value; /* a sensor fault or a value out of range got past the E2E check in this cycle, or a StopCommand */

    bool was_permitted;
    bool stopped;    /* since permission ended, or a trip came before the first one */
    bool reset_sent; /* since then, one that names the trip */
    uint8_t reset_counter;
    uint32_t reset_cycles;
    uint64_t push_until, push_from, silent_until;
    uint32_t pushed_joint;
    bool seen[PROTOCOL_RECEIVE_COUNT]; /* a good CRC got through: the first one only begins the count */
    tally_t tally;
} soak_t;

/* Fills the queue with what gets to the guard in this cycle. */
void robot_sends(soak_t *self);

/* Hands the queue to the guard, and holds each frame against what was done to it. Exits with 1 at a breach. */
void deliver(soak_t *self, uint64_t now_us);

/* Holds the tick's verdict against what the guard was given. Exits with 1 at a breach. */
void judge(soak_t *self);

extern const char *const fault_names[FAULT_COUNT];

#endif
