/* frames: the robot's side of the bus: turns readings into complete, protected frames. */
#ifndef TAUPERP_KERNEL_FRAMES_H
#define TAUPERP_KERNEL_FRAMES_H

#include <stdbool.h>

#include "frame.h"
#include "kernel.h"

#define FRAMES_MAX (3 + KERNEL_JOINTS)

typedef struct {
    double position[KERNEL_JOINTS], velocity[KERNEL_JOINTS], torque[KERNEL_JOINTS];
} reading_t;

typedef struct {
    const kernel_setup_t *setup;
    uint32_t task_counter, sync_counter, reset_counter;
    uint32_t count;
    can_frame_t frame[FRAMES_MAX]; /* frames of the current cycle, in the order of sending */
    bool in_range;                 /* every reading so far fits into its signal */
} frames_t;

void frames_init(frames_t *self, const kernel_setup_t *setup);

/* Packs Sync, TaskCommand with the tip's acceleration (3, m/s^2), and one JointState per joint. */
void frames_cycle(frames_t *self, uint32_t cycle, uint32_t task, const double *acceleration, const reading_t *reading);

/* Skips a cycle whose frames get lost: only the counters advance. */
void frames_skip(frames_t *self);

/* Appends a GuardReset to the frames of the cycle. */
void frames_reset(frames_t *self, uint32_t request, uint32_t trip_number);

#endif
