#include "event_log.h"

#include "messages.h"
#include "scale.h"

enum { PART_HEADER = 0, PART_SAMPLE = 1 };

void event_log_init(event_log_t *self, const guard_config_t *config) {
    *self = (event_log_t){.joints = config->robot.joint_count, .fd = config->format == (uint32_t)FORMAT_FD};
    const uint32_t interval = EVENT_STEP_US / config->period_us;
    self->interval = (interval > 0u) ? interval : 1u;
    self->step_us = self->interval * config->period_us;
    self->ticks = self->interval - 1u;
}

static int16_t torque_raw(num_t value) {
    return (int16_t)scale_to_raw(value, PROTOCOL_GUARD_EVENT_SAMPLE_INDEX_SCALE,
                                 PROTOCOL_GUARD_EVENT_SAMPLE_INDEX_RAW_MIN, PROTOCOL_GUARD_EVENT_SAMPLE_INDEX_RAW_MAX);
}

static void put_sample(event_t *event, const guard_output_t *out, uint32_t joints) {
    event_sample_t *const sample = &event->sample[event->next];
    for (uint32_t joint = 0; joint < joints; ++joint) {
        sample->residual[joint] = torque_raw(out->residual[joint]);
        sample->index[joint] = torque_raw(out->index[joint]);
    }
    sample->task = out->task;
    sample->channel = out->channel;
    event->next = (event->next + 1u) % EVENT_SAMPLES;
    event->count += (event->count < EVENT_SAMPLES) ? 1u : 0u;
}

/* The event that is being recorded is complete. The oldest event makes space for the next. */
static void finish(event_log_t *self) {
    event_t *const event = &self->event[self->slot];
    event->trip = self->noted_trip;
    event->reason = self->noted_reason;
    event->joint = self->noted_joint;
    event->before = event->count - EVENT_AFTER - 1u;
    self->slot = (self->slot + 1u) % EVENT_SLOTS;
    self->event[self->slot] = (event_t){0};
    self->frame_ticks = 0;
}

void event_log_note(event_log_t *self, const guard_output_t *out) {
    const bool tripped = (out->trip_number != self->last_trip) && (self->remaining == 0u);
    self->last_trip = out->trip_number;
    ++self->ticks;
    if (!tripped && (self->ticks < self->interval)) {
        return;
    }
    self->ticks = 0;
    put_sample(&self->event[self->slot], out, self->joints);
    if (tripped) {
        self->noted_trip = out->trip_number;
        self->noted_reason = (uint8_t)out->reason;
        self->noted_joint = out->joint;
        self->remaining = EVENT_AFTER;
    } else if (self->remaining > 0u) {
        --self->remaining;
        if (self->remaining == 0u) {
            finish(self);
        }
    } else {
        /* no event yet */
    }
}

/* The next complete event from the cursor on. False if there is none. */
static bool seek(event_log_t *self) {
    for (uint32_t turn = 0; turn <= EVENT_SLOTS; ++turn) {
        const event_t *const event = &self->event[self->cursor_slot];
        if ((event->trip != 0u) && (self->cursor < (1u + (event->count * self->joints)))) {
            return true;
        }
        self->cursor_slot = (self->cursor_slot + 1u) % EVENT_SLOTS;
        self->cursor = 0;
    }
    return false;
}

static void fill_header(const event_log_t *self, const event_t *event, struct tauperp_guard_event_t *message) {
    message->event_part = (uint8_t)PART_HEADER;
    message->event_trip = event->trip;
    message->event_reason = event->reason;
    message->event_joint = event->joint;
    message->event_joints = (uint8_t)self->joints;
    message->event_step = (uint16_t)((self->step_us < UINT16_MAX) ? self->step_us : UINT16_MAX);
    message->event_before = (uint8_t)event->before;
}

static void fill_sample(const event_log_t *self, const event_t *event, struct tauperp_guard_event_t *message) {
    const uint32_t number = (self->cursor - 1u) / self->joints;
    const uint32_t joint = (self->cursor - 1u) % self->joints;
    const uint32_t oldest = event->next + EVENT_SAMPLES - event->count;
    const event_sample_t *const sample = &event->sample[(oldest + number) % EVENT_SAMPLES];
    message->event_part = (uint8_t)PART_SAMPLE;
    message->event_sample = (uint8_t)number;
    message->sample_joint = (uint8_t)joint;
    message->sample_task = sample->task;
    message->sample_channel = sample->channel;
    message->sample_residual = sample->residual[joint];
    message->sample_index = sample->index[joint];
}

bool event_log_frame(event_log_t *self, can_frame_t *frame) {
    ++self->frame_ticks;
    if ((self->frame_ticks < EVENT_FRAME_TICKS) || !seek(self)) {
        return false;
    }
    self->frame_ticks = 0;
    const protocol_transmit_t *const entry = &protocol_transmit[PROTOCOL_TRANSMIT_GUARD_EVENT];
    const event_t *const event = &self->event[self->cursor_slot];
    struct tauperp_guard_event_t message = {.event_slot = (uint8_t)self->cursor_slot};
    if (self->cursor == 0u) {
        fill_header(self, event, &message);
    } else {
        fill_sample(self, event, &message);
    }
    ++self->cursor;
    *frame = (can_frame_t){.id = entry->id, .length = entry->length};
    if (self->fd) {
        frame->flags = (uint8_t)(CAN_FRAME_FD | CAN_FRAME_BRS);
    }
    tauperp_guard_event_pack(frame->data, &message);
    e2e_protect(&self->transmitter, frame->data, frame->length, entry->data_ids);
    return true;
}
