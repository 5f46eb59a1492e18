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
