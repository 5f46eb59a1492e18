#include "guard_parts.h"
#include "messages.h"
#include "scale.h"

#define MICRO     SCALE(0.000001F, 0, 1u, 1000000)
#define LARGEST_U 511000000

static int32_t micro(num_t value) {
    return scale_to_raw(value, MICRO, -LARGEST_U, LARGEST_U);
}

static num_t from_micro(int32_t value) {
    uint32_t held = 0; /* a quotient of two whole numbers below 512 fits */
    const num_t whole = num_from_int(value / 1000000);
    const num_t rest = num_div(num_from_int((value % 1000000) / 2000), num_from_int(500), &held);
    return num_add(whole, rest, &held);
}

void guard_join(guard_t *self, bool second) {
    self->company = GUARD_PAIRED;
    self->second = second;
}

bool guard_is_alone(const guard_t *self) {
    return self->company == GUARD_ALONE;
}

void guard_tell(const guard_t *self, const guard_finding_t *finding, opinion_t *opinion) {
    const uint32_t joints = (self->joints < ROBOT_MAX_JOINTS) ? self->joints : ROBOT_MAX_JOINTS;
    const guard_event_t *const event = &finding->event;
    *opinion = (opinion_t){.wish = (uint8_t)finding->wish,
                           .reason = (uint8_t)event->reason,
                           .joint = (uint8_t)event->joint,
                           .category = (uint8_t)event->category,
                           .bank = (uint8_t)event->channel,
                           .value = micro(event->value_nm),
                           .threshold = micro(event->threshold_nm),
                           .healthy = finding->healthy,
                           .tested = finding->tested,
                           .fresh = finding->fresh,
                           .saturated = finding->saturated,
                           .hard = self->config->subspace.projector == (uint32_t)PROJECTOR_HARD,
                           .state = (uint8_t)self->state,
                           .trip_number = self->trip.number,
                           .task = (uint8_t)self->task,
                           .rank = (uint8_t)self->index.rank,
                           .joints = (uint8_t)joints,
                           .channels = (uint8_t)self->config->bank.channels,
                           .cycle = self->inputs.snapshot.cycle,
                           .period_us = self->config->period_us};
    for (uint32_t i = 0; i < joints; ++i) {
        opinion->residual[i] = micro(self->observer.residual[i]);
    }
    for (uint32_t c = 0; (c < self->config->bank.channels) && (c < BANK_MAX_CHANNELS); ++c) {
        for (uint32_t i = 0; i < joints; ++i) {
            opinion->index[c][i] = micro(self->bank.channel[c].output[i]);
        }
    }
}

guard_event_t opinion_event(const opinion_t *opinion) {
    return (guard_event_t){.reason = (guard_reason_t)opinion->reason,
                           .joint = opinion->joint,
                           .category = opinion->category,
                           .channel = opinion->bank,
                           .value_nm = from_micro(opinion->value),
                           .threshold_nm = from_micro(opinion->threshold)};
}

#define CYCLE_BYTE      3u
#define PERMISSION_BYTE 2u
#define SPEED_BYTE      4u
#define FULL_SPEED_BIT  0x80u

void guard_confirm(const guard_output_t *own, can_frame_t *stop_command) {
    uint8_t *const data = stop_command->data;
    const bool cycle = (uint32_t)(data[CYCLE_BYTE] >> 4u) == (own->cycle & 0x0Fu);
    const bool move = own->permitted && !own->withheld && cycle;
    const uint8_t copy = move ? TAUPERP_STOP_COMMAND_PERMISSION_INVERTED_MOVE_CHOICE
                              : TAUPERP_STOP_COMMAND_PERMISSION_INVERTED_STOP_CHOICE;
    data[PERMISSION_BYTE] = (uint8_t)((data[PERMISSION_BYTE] & 0x0Fu) | (uint8_t)(copy << 4u));
    if (!own->full_speed) {
        data[SPEED_BYTE] = (uint8_t)(data[SPEED_BYTE] & (uint8_t)~FULL_SPEED_BIT);
    }
    e2e_seal(data, stop_command->length, protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND].data_ids,
             data[1] & E2E_COUNTER_MASK);
}
