/* session: a robot's frames, and every guard and detector that receives them. */
#ifndef KERNEL_SESSION_H
#define KERNEL_SESSION_H

#include "tracks.h"

/* The robot's controller and joints on the bus, and all guards and detectors that receive its frames. */
typedef struct {
    const kernel_setup_t *setup;
    frames_t frames;
    tracks_t tracks;
    uint32_t asking; /* cycles for which a reset has been requested */
    uint32_t cycle;  /* the last cycle; 0 before the first */
} session_t;

/* False if a guard refuses its configuration. */
bool session_init(session_t *self, const kernel_setup_t *setup);

/* Sends one cycle and ticks the guards. For missing cycles before it, the guards first tick without frames. False if a
 * guard is in FAULT or a reading does not fit. */
bool session_cycle(session_t *self, uint32_t cycle, uint32_t task, const double *acceleration,
                   const reading_t *reading);

bool session_permitted(const session_t *self);

/* Counts a stop by its kind: by a computed value, or by a missing, frozen or implausible input. */
void session_count_stop(const session_t *self, kernel_result_t *result);

/* The stop in `result`, as the guard reports it. */
void session_note_stop(const session_t *session, double time_s, double force_n, kernel_result_t *result);

static inline double value_of(num_t value) {
#ifdef TAUPERP_FIXED
    return (double)value * 0x1p-22;
#else
    return (double)value;
#endif
}

#endif
