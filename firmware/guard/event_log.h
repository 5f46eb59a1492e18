/* event_log: the event recorder. It keeps the last trips, with residual, index, channel and task of 200 ms around each.
 * The board provides the memory. The recorder sends the events repeatedly as GuardEvent. Nothing on the bus writes to
 * it, and nothing in the guard depends on it.
 *
 * Call event_log_note(&log, &out) after guard_tick. If event_log_frame(&log, &frame) is true, send the frame after the
 * guard's own frames. That is at most one frame in EVENT_FRAME_TICKS ticks, and none before the first event is
 * complete.
 *
 * It takes a sample every 5 ms (every tick if a period is longer), and at the trip. The event is complete EVENT_AFTER
 * samples later. A trip before that belongs to the same event.
 *
 * Cost: at most one copy of a sample per tick; 5.6 KB. Preconditions: one writer; no interrupt reads it.
 */
#ifndef TAUPERP_EVENT_LOG_H
#define TAUPERP_EVENT_LOG_H

#include "guard.h"

#define EVENT_SLOTS       4u /* one is being recorded, the others hold the last three trips */
#define EVENT_SAMPLES     40u
#define EVENT_AFTER       20u /* samples after the one of the trip */
#define EVENT_STEP_US     5000u
#define EVENT_FRAME_TICKS 8u

typedef struct {
    int16_t residual[ROBOT_MAX_JOINTS]; /* raw, as on the wire */
    int16_t index[ROBOT_MAX_JOINTS];
    uint8_t task;
    uint8_t channel;
} event_sample_t;

typedef struct {
    event_sample_t sample[EVENT_SAMPLES]; /* ring buffer; `next` is written next */
    uint32_t next;
    uint32_t count;  /* number of samples in it */
    uint32_t before; /* samples before the one of the trip */
    uint8_t trip;    /* number; 0: the event is not complete */
    uint8_t reason;
    uint8_t joint;
} event_t;

typedef struct {
    event_t event[EVENT_SLOTS];
    e2e_transmitter_t transmitter;
    uint32_t slot;      /* slot that is being recorded */
    uint32_t remaining; /* samples until the event is complete; 0: it has no trip yet */
    uint32_t ticks;     /* since the last sample */
    uint32_t interval;  /* ticks between two samples */
    uint32_t step_us;
    uint32_t joints;
    uint32_t last_trip;
    uint32_t frame_ticks; /* since the last frame */
    uint32_t cursor_slot;
    uint32_t cursor; /* 0: the header; then 1 + sample * joints + joint */
    uint8_t noted_trip, noted_reason, noted_joint;
    bool fd;
} event_log_t;

/* `config`: the block that the guard accepted. */
void event_log_init(event_log_t *self, const guard_config_t *config);

/* Call it once per tick, with the output of the tick. */
void event_log_note(event_log_t *self, const guard_output_t *out);

/* True if `frame` must be sent now. Call it once per tick, after event_log_note. */
bool event_log_frame(event_log_t *self, can_frame_t *frame);

#endif
