/* tracks: the guards that receive the same frames, and the detectors that are compared with them on their signals. */
#ifndef TAUPERP_KERNEL_TRACKS_H
#define TAUPERP_KERNEL_TRACKS_H

#include "frames.h"
#include "guard.h"
#include "kernel.h"

typedef struct {
    double state[KERNEL_SECTIONS][2][KERNEL_JOINTS];
    uint32_t above; /* consecutive ticks above the threshold */
} detector_track_t;

typedef struct {
    guard_t guard[KERNEL_GUARDS];
    guard_output_t out[KERNEL_GUARDS];
    detector_track_t detector[KERNEL_DETECTORS];
} tracks_t;

/* False if a guard refuses its configuration. */
bool tracks_init(tracks_t *self, const kernel_setup_t *setup);

/* Every guard receives the frames and ticks. False if a guard goes to FAULT. */
bool tracks_tick(tracks_t *self, const kernel_setup_t *setup, const frames_t *frames, uint64_t now_us);

/* Runs the detectors on the guards' last outputs and records in `result` which exceed their thresholds. `since_onset_s`
 * is negative before the onset. Until `watched`, the filters stay in the steady state of the current signal. */
void tracks_detect(tracks_t *self, const kernel_setup_t *setup, bool watched, double time_s, double since_onset_s,
                   kernel_result_t *result);

void result_init(kernel_result_t *result, uint64_t number);

#endif
