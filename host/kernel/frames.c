#include "frames.h"

#include <math.h>
#include <string.h>

#include "e2e.h"

static uint64_t packed(const kernel_signal_t *signal, double value, bool *in_range) {
    const double raw = rint(value * signal->per_unit);
    if (!(raw >= signal->min && raw <= signal->max)) {
        *in_range = false;
        return 0;
    }
    return ((uint64_t)(int64_t)raw & signal->mask) << signal->shift;
}

static can_frame_t *next_frame(frames_t *self, const kernel_message_t *message, uint64_t bits) {
    can_frame_t *const frame = &self->frame[self->count++];
    memset(frame, 0, sizeof *frame);
    frame->id = message->id;
    frame->length = (uint8_t)message->length;
    frame->flags = self->setup->fd ? (uint8_t)(CAN_FRAME_FD | CAN_FRAME_BRS) : 0u;
    for (uint32_t i = 0; i < message->length; ++i) {
        frame->data[i] = (uint8_t)(bits >> (8u * i));
    }
    return frame;
}

static void seal(can_frame_t *frame, const kernel_message_t *message, uint32_t cycle, uint32_t *counter) {
    const uint32_t number = message->counter_is_cycle ? cycle : ++*counter;
    e2e_seal(frame->data, frame->length, message->data_ids, (uint8_t)(number & E2E_COUNTER_MASK));
}

void frames_init(frames_t *self, const kernel_setup_t *setup) {
    *self = (frames_t){.setup = setup, .in_range = true};
}

void frames_cycle(frames_t *self, uint32_t cycle, uint32_t task, const double *acceleration, const reading_t *reading) {
    const kernel_setup_t *const setup = self->setup;
    self->count = 0;
    bool *const good = &self->in_range;
    uint64_t bits = packed(&setup->sync.signal[0], (double)(cycle & 0xFFFFu), good);
    seal(next_frame(self, &setup->sync, bits), &setup->sync, cycle, &self->sync_counter);
    bits = packed(&setup->task.signal[0], (double)task, good);
    for (int axis = 0; axis < 3; ++axis) {
        bits |= packed(&setup->task.signal[1 + axis], acceleration[axis], good);
    }
    seal(next_frame(self, &setup->task, bits), &setup->task, cycle, &self->task_counter);
    for (uint32_t joint = 0; joint < setup->joints; ++joint) {
        const kernel_message_t *const message = &setup->joint[joint];
        bits = packed(&message->signal[0], (double)((cycle >> 4) & 3u), good) |
               packed(&message->signal[1], reading->position[joint], good) |
               packed(&message->signal[2], reading->velocity[joint], good) |
               packed(&message->signal[3], reading->torque[joint], good);
        uint32_t unused = 0;
        seal(next_frame(self, message, bits), message, cycle, &unused);
    }
}

void frames_skip(frames_t *self) {
    self->count = 0;
    ++self->task_counter;
    ++self->sync_counter;
}

void frames_reset(frames_t *self, uint32_t request, uint32_t trip_number) {
    const kernel_message_t *const message = &self->setup->reset;
    const uint64_t bits = packed(&message->signal[0], (double)request, &self->in_range) |
                          packed(&message->signal[1], (double)trip_number, &self->in_range);
    seal(next_frame(self, message, bits), message, 0, &self->reset_counter);
}
