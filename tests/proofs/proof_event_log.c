/* firmware/guard/event_log.c. */
#include "proof.h"

#include "guard_any.h"
#include "messages.c"
#include "protocol.c"

static e2e_transmitter_t sealed; /* e2e_protect is shown in proof_e2e.c */

void e2e_protect(e2e_transmitter_t *self, uint8_t *data, uint8_t length, const uint8_t *data_ids) {
    HOLDS((length >= 2u) && (length <= CAN_FRAME_DATA_LENGTH), "the precondition of e2e_protect");
    HOLDS(__CPROVER_w_ok(data, length) && __CPROVER_r_ok(data_ids, E2E_DATA_ID_COUNT), "the bytes are readable");
    *self = sealed;
}

#include "raw_stub.h"

#include "event_log.c"

static bool log_is_sound(const event_log_t *log) {
    bool sound = (log->joints >= 1u) && (log->joints <= ROBOT_MAX_JOINTS) && (log->slot < EVENT_SLOTS) &&
                 (log->cursor_slot < EVENT_SLOTS) && (log->remaining <= EVENT_AFTER) &&
                 (log->cursor <= (1u + (EVENT_SAMPLES * ROBOT_MAX_JOINTS)));
    for (uint32_t i = 0; i < EVENT_SLOTS; ++i) {
        sound = sound && (log->event[i].next < EVENT_SAMPLES) && (log->event[i].count <= EVENT_SAMPLES);
    }
    return sound;
}

void proof_event_log_init(void) {
    event_log_t log;
    guard_config_t block;
    assume_block(&block);
    event_log_init(&log, &block);
    HOLDS(log_is_sound(&log), "the log is sound");
    REACHED;
}

void proof_event_log_frame(void) {
    event_log_t log;
    can_frame_t frame;
    ASSUME(log_is_sound(&log));
    (void)event_log_frame(&log, &frame);
    HOLDS(log_is_sound(&log), "the log stays sound");
    REACHED;
}

static bool event_is_sound(const event_t *event) {
    return (event->next < EVENT_SAMPLES) && (event->count <= EVENT_SAMPLES);
}

void proof_event_log_sample(void) {
    event_t event;
    guard_output_t out;
    uint32_t joints;
    ASSUME(event_is_sound(&event) && (joints >= 1u) && (joints <= ROBOT_MAX_JOINTS));
    put_sample(&event, &out, joints);
    HOLDS(event_is_sound(&event), "the event stays sound");
    REACHED;
}

void proof_event_log_finish(void) {
    event_log_t log;
    ASSUME(log_is_sound(&log));
    finish(&log);
    HOLDS(log_is_sound(&log), "the log stays sound");
    REACHED;
}

/* Instead of put_sample and finish (proofs.toml). A sample is not written: it has no part in what follows. */
void stub_sample(event_t *event, const guard_output_t *out, uint32_t joints) {
    HOLDS(__CPROVER_w_ok(event, sizeof(*event)) && event_is_sound(event), "the event is sound");
    HOLDS(__CPROVER_r_ok(out, sizeof(*out)), "the output is there");
    HOLDS((joints >= 1u) && (joints <= ROBOT_MAX_JOINTS), "the joints of an arm");
    uint32_t next, count;
    ASSUME((next < EVENT_SAMPLES) && (count <= EVENT_SAMPLES));
    event->next = next;
    event->count = count;
}

static uint32_t finished;

void stub_finish(event_log_t *self) {
    uint32_t slot;
    HOLDS(__CPROVER_w_ok(self, sizeof(*self)) && log_is_sound(self), "the log is sound");
    ASSUME(slot < EVENT_SLOTS);
    self->slot = slot;
    ++finished;
}

void proof_event_log_note(void) {
    event_log_t log;
    guard_output_t out;
    ASSUME(log_is_sound(&log));
    const uint32_t remaining = log.remaining;
    finished = 0;
    event_log_note(&log, &out);
    HOLDS(log_is_sound(&log), "the log stays sound");
    HOLDS((finished == 0u) || (remaining == 1u), "an event ends with its last sample");
    HOLDS(log.last_trip == out.trip_number, "a trip is noted once");
    REACHED;
}
