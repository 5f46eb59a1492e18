#include "lockstep.h"

#include "messages.h"
#include "protocol.h"

#define HALF_WAY 0x8000u /* a larger difference of cycles means an older cycle */

/* A Sync with a valid CRC. Its counter does not matter here. */
static bool is_sync(const can_frame_t *frame, struct tauperp_sync_t *message) {
    const protocol_receive_t *const entry = &protocol_receive[PROTOCOL_RECEIVE_SYNC];
    const uint8_t wrong = (uint8_t)(CAN_FRAME_EXTENDED | CAN_FRAME_REMOTE);
    if ((frame->id != entry->id) || (frame->length != entry->length) || ((frame->flags & wrong) != 0u)) {
        return false;
    }
    e2e_receiver_t any = {0};
    if (e2e_check(&any, frame->data, frame->length, entry->data_ids, entry->max_delta) == E2E_WRONG_CRC) {
        return false;
    }
    tauperp_sync_unpack(message, frame->data);
    return true;
}

/* Cycles by which guard time advances for a Sync of this cycle. */
static uint32_t steps_to(lockstep_t *self, uint16_t cycle) {
    const uint16_t ahead = (uint16_t)(cycle - self->newest);
    if (ahead == 0u) {
        if (self->assumed) {
            /* The robot was only paused. The cycle that counted as lost starts now. */
            self->ticked = false;
        }
        return 0;
    }
    if (ahead < HALF_WAY) {
        return (ahead < LOCKSTEP_MAX_STEP) ? ahead : LOCKSTEP_MAX_STEP;
    }
    if (self->is_behind && (cycle == (uint16_t)(self->behind + 1u))) {
        return 1;
    }
    self->is_behind = true;
    self->behind = cycle;
    return 0;
}

void lockstep_hear(lockstep_t *self, const can_frame_t *frame) {
    struct tauperp_sync_t message = {0};
    self->steps = 0;
    if (!is_sync(frame, &message)) {
        const uint32_t slot = protocol_slot(frame->id);
        if ((slot < (uint32_t)PROTOCOL_RECEIVE_COUNT) &&
            (protocol_receive[slot].kind == (uint8_t)PROTOCOL_KIND_JOINT_STATE)) {
            self->heard = self->ticked;
        }
        return;
    }
    if (!self->begun) {
        self->begun = true;
        self->newest = message.cycle;
        self->now_us = (uint64_t)message.cycle * self->period_us;
        return;
    }
    self->steps = steps_to(self, message.cycle);
    if (self->steps > 0u) {
        self->newest = message.cycle;
        self->is_behind = false;
    }
    if (message.cycle == self->newest) {
        self->assumed = false;
    }
}

bool lockstep_owes_tick(lockstep_t *self) {
    while (self->steps > 0u) {
        if (!self->ticked) {
            self->ticked = true;
            return true;
        }
        self->now_us += self->period_us;
        self->steps--;
        self->ticked = false;
        self->heard = false;
    }
    return false;
}

bool lockstep_complete(lockstep_t *self) {
    const bool due = self->begun && !self->ticked;
    if (due) {
        self->ticked = true;
        self->heard = false;
    }
    return due;
}

bool lockstep_silence(lockstep_t *self) {
    if (lockstep_complete(self)) {
        return true;
    }
    if (!self->heard) {
        return false;
    }
    self->heard = false;
    self->assumed = true;
    self->newest++;
    self->now_us += self->period_us;
    return true;
}
