/* event_log: the event recorder. It keeps the last trips with 200 ms of residual, index, channel and task around each,
 * in memory that the board provides, and says them on the bus, over and over, as GuardEvent. Nothing on the bus writes
 * to it, and nothing in the guard depends on it.
 *
 * After guard_tick: event_log_note(&log, &out). Whenever event_log_frame(&log, &frame) says so, the frame is
 * sent behind the guard's own: at most one in EVENT_FRAME_TICKS ticks, none before the first event is complete.
 *
 * A sample is taken every 5 ms, or every tick where a period is longer, and at the trip. EVENT_AFTER samples later the
 * event is complete. A trip that comes earlier belongs to the event that is being recorded.
 *
 * Cost: one copy of a sample at most a tick; 5.6 KB. Preconditions: one writer; no interrupt reads it.
 */
#ifndef TAUPERP_EVENT_LOG_H
#define TAUPERP_EVENT_LOG_H

#include "guard.h"

#define EVENT_SLOTS       4u /* one is being recorded: the last three trips are kept */
#define EVENT_SAMPLES     40u
#define EVENT_AFTER       20u /* samples behind the trip's own */
#define EVENT_STEP_US     5000u
#define EVENT_FRAME_TICKS 8u

typedef struct {
    int16_t residual[ROBOT_MAX_JOINTS]; /* raw, as on the wire */
    int16_t index[ROBOT_MAX_JOINTS];
    uint8_t task;
    uint8_t channel;
} event_sample_t;

typedef struct {
    event_sample_t sample[EVENT_SAMPLES]; /* a ring; `next` is written next */
    uint32_t next;
    uint32_t count;  /* of samples in it */
    uint32_t before; /* of them before the trip's own */
    uint8_t trip;    /* number; 0: not complete */
    uint8_t reason;
    uint8_t joint;
} event_t;

typedef struct {
    event_t event[EVENT_SLOTS];
    e2e_transmitter_t transmitter;
    uint32_t slot;      /* that is being recorded */
    uint32_t remaining; /* samples until it is complete; 0: no trip in it yet */
    uint32_t ticks;     /* since the last sample */
    uint32_t interval;  /* ticks from sample to sample */
    uint32_t step_us;
    uint32_t joints;
    uint32_t last_trip;
    uint32_t frame_ticks; /* since the last frame */
    uint32_t cursor_slot;
    uint32_t cursor; /* 0 the header, then 1 + sample * joints + joint */
    uint8_t noted_trip, noted_reason, noted_joint;
    bool fd;
} event_log_t;

/* `config`: the block that the guard accepted. */
void event_log_init(event_log_t *self, const guard_config_t *config);

/* Once a tick, with what the tick put out. */
void event_log_note(event_log_t *self, const guard_output_t *out);

/* True if `frame` is to be sent now. Once a tick, after event_log_note. */
bool event_log_frame(event_log_t *self, can_frame_t *frame);

#endif
