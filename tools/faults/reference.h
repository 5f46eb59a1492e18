/* reference: a recorded run, the answers of a guard without a fault, and one cycle with or without a fault.
 */
#ifndef FAULTS_REFERENCE_H
#define FAULTS_REFERENCE_H

#include "fault.h"
#include "robot_side.h"

enum { STOPS_MAX = 64 };

typedef struct {
    uint64_t now_us;
    uint32_t first, frames;
} cycle_t;

typedef struct {
    machine_t machine;
    robot_side_t robot;
} world_t;

typedef struct {
    bool permits, in_fault;
} answer_t;

/* Arrays of one element per cycle. reaction: the block's worst case, in cycles. */
typedef struct {
    uint32_t channels, cycle_count;
    cycle_t *cycles;
    can_frame_t *frames;
    world_t *before; /* at the beginning of each cycle */
    answer_t *answer;
    uint32_t *quiet; /* cycles until the permission changes next */
    uint32_t stop[STOPS_MAX], stops, reaction;
} reference_t;

_Noreturn void give_up(const char *why);

/* Reads the recording and runs it without a fault. Gives up on a file of another kind, or without a stop. */
void reference_run(reference_t *self, const char *path);

/* One cycle. fault: NULL for none. */
answer_t reference_cycle(const reference_t *self, world_t *world, uint32_t at, const fault_t *fault);

#endif
