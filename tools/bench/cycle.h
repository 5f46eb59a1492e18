/* cycle: the frames of one cycle on the bus, as a robot with one controller and one node per joint sends them. */
#ifndef TAUPERP_BENCH_CYCLE_H
#define TAUPERP_BENCH_CYCLE_H

#include "frame.h"
#include "states.h"

#define CYCLE_MAX_FRAMES (2u + ROBOT_MAX_JOINTS)

typedef struct {
    can_frame_t frame[CYCLE_MAX_FRAMES]; /* Sync, TaskCommand, JointState1 to n */
    uint32_t count;
} cycle_frames_t;

void cycle_encode(cycle_frames_t *self, const guard_config_t *config, const bench_state_t *state, uint32_t task,
                  uint16_t cycle);

#endif
