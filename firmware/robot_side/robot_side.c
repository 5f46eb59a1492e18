#include "robot_side.h"

#include "protocol.h"

#define MOVE          0x1u /* StopCommand.Permission */
#define MOVE_INVERTED 0xEu
#define NO_REASON     1u /* StopCommand.Reason of a permission */
#define REASON_BITS   0x7Fu
#define FULL_SPEED    0x80u
#define MAX_DELTA     4u          /* StopCommand's MaxDeltaCounter */
#define SECOND_GUARD  8u          /* a second guard exists if this many StopCommands ... */
#define LAST_24       0x00FFFFFFu /* ... among the last 24 are out of sequence */
#define SILENCE       1u          /* stop category if no valid frame arrived */
#define RAW_LIMIT     32767.0f

/* Physical value of one bit, inverted (dbc/tauperp.dbc). tests/host/test_robot_side.py compares with cantools. */
#define PER_RAD   8000.0f
#define PER_RAD_S 4000.0f
#define PER_NM    100.0f
#define PER_M_S2  1000.0f

static bool config_is_valid(const robot_side_config_t *config) {
    return (config->joints >= 1u) && (config->joints <= ROBOT_SIDE_MAX_JOINTS) && (config->answer_us > 0u) &&
           (config->hold_us >= config->answer_us);
}

bool robot_side_init(robot_side_t *self, const robot_side_config_t *config) {
    *self = (robot_side_t){0};
    if (!config_is_valid(config)) {
        return false;
    }
    self->config = *config;
    return true;
}

/* --- packing ------------------------------------------------------------------------------------------------------ */

static void begin_frame(const robot_side_t *self, const protocol_receive_t *entry, can_frame_t *frame) {
    *frame = (can_frame_t){.id = entry->id, .length = entry->length};
    if (self->config.fd) {
        frame->flags = (uint8_t)(CAN_FRAME_FD | CAN_FRAME_BRS);
    }
}

static void seal(const protocol_receive_t *entry, uint16_t cycle, can_frame_t *frame) {
    e2e_seal(frame->data, frame->length, entry->data_ids, (uint8_t)(cycle & E2E_COUNTER_MASK));
}

/* Writes the nearest raw value, little-endian. False if the value does not fit or is not a number. */
static bool put(uint8_t *at, float value, float per_unit) {
    const float scaled = value * per_unit;
    if (!((scaled >= -RAW_LIMIT) && (scaled <= RAW_LIMIT))) {
        return false;
    }
    const int32_t raw = (int32_t)((scaled < 0.0f) ? (scaled - 0.5f) : (scaled + 0.5f));
    const uint32_t bits = (uint32_t)raw;
    at[0] = (uint8_t)(bits & 0xFFu);
    at[1] = (uint8_t)((bits >> 8u) & 0xFFu);
    return true;
}

static void begin_cycle(robot_side_t *self, uint16_t cycle, uint64_t now_us) {
    self->cycle = cycle;
    self->begun = true;
    self->begun_us = now_us;
    self->answered = false;
    self->stopped = false;
}

void robot_side_begin(robot_side_t *self, uint64_t now_us, can_frame_t *frame) {
    const protocol_receive_t *const entry = &protocol_receive[PROTOCOL_RECEIVE_SYNC];
    begin_cycle(self, (uint16_t)(self->begun ? (self->cycle + 1u) : 0u), now_us);
    begin_frame(self, entry, frame);
    frame->data[2] = (uint8_t)(self->cycle & 0xFFu);
    frame->data[3] = (uint8_t)(self->cycle >> 8u);
    seal(entry, self->cycle, frame);
}

bool robot_side_follow(robot_side_t *self, const can_frame_t *sync, uint64_t now_us) {
    const protocol_receive_t *const entry = &protocol_receive[PROTOCOL_RECEIVE_SYNC];
    const uint8_t wrong = (uint8_t)(CAN_FRAME_EXTENDED | CAN_FRAME_REMOTE);
    e2e_receiver_t any = {0};
    if ((sync->id != entry->id) || (sync->length != entry->length) || ((sync->flags & wrong) != 0u) ||
        (e2e_check(&any, sync->data, sync->length, entry->data_ids, entry->max_delta) == E2E_WRONG_CRC)) {
        return false;
    }
    begin_cycle(self, (uint16_t)((uint32_t)sync->data[2] | ((uint32_t)sync->data[3] << 8u)), now_us);
    return true;
}

bool robot_side_task(const robot_side_t *self, robot_side_task_t task, const float acceleration[3],
                     can_frame_t *frame) {
    const protocol_receive_t *const entry = &protocol_receive[PROTOCOL_RECEIVE_TASK_COMMAND];
    if ((task < ROBOT_SIDE_TASK_NONE) || (task > ROBOT_SIDE_TASK_6)) {
        return false;
    }
    begin_frame(self, entry, frame);
    frame->data[1] = (uint8_t)((uint32_t)task << 4u);
    for (uint32_t axis = 0; axis < 3u; ++axis) {
        if (!put(&frame->data[2u + (2u * axis)], acceleration[axis], PER_M_S2)) {
            return false;
        }
    }
    seal(entry, self->cycle, frame);
    return true;
}

bool robot_side_joint(const robot_side_t *self, uint32_t joint, const robot_side_reading_t *reading,
                      can_frame_t *frame) {
    if (joint >= self->config.joints) {
        return false;
    }
    const protocol_receive_t *const entry = &protocol_receive[(uint32_t)PROTOCOL_RECEIVE_JOINT_STATE + joint];
    begin_frame(self, entry, frame);
    uint32_t status = (uint32_t)reading->status & 3u;
    const bool fits = put(&frame->data[2], reading->position_rad, PER_RAD) &&
                      put(&frame->data[4], reading->velocity_rad_s, PER_RAD_S) &&
                      put(&frame->data[6], reading->torque_nm, PER_NM);
    if (!fits) {
        begin_frame(self, entry, frame);
        status = (uint32_t)ROBOT_SIDE_SENSOR_NOT_AVAILABLE;
    }
    const uint32_t cycle_high = ((uint32_t)self->cycle >> 4u) & 3u;
    frame->data[1] = (uint8_t)((status << 4u) | (cycle_high << 6u));
    seal(entry, self->cycle, frame);
    return true;
}

void robot_side_reset(robot_side_t *self, bool request, can_frame_t *frame) {
    const protocol_receive_t *const entry = &protocol_receive[PROTOCOL_RECEIVE_GUARD_RESET];
    begin_frame(self, entry, frame);
    frame->data[1] = request ? 0x10u : 0u;
    frame->data[2] = self->last_trip;
    e2e_protect(&self->reset, frame->data, frame->length, entry->data_ids);
}

/* --- the answer --------------------------------------------------------------------------------------------------- */

static robot_side_permit_t unpack(const can_frame_t *frame) {
    const uint8_t category = frame->data[3] & 0x3u;
    return (robot_side_permit_t){.category =
                                     (category <= 2u) ? category : 0u, /* an unknown category counts as category 0 */
                                 .reason = frame->data[4] & REASON_BITS,
                                 .full_speed = (frame->data[4] & FULL_SPEED) != 0u,
                                 .joint = (uint8_t)(frame->data[1] >> 4u),
                                 .trip = frame->data[5]};
}

/* True if both copies permit and no other field contradicts them or is out of range. */
static bool is_move(const can_frame_t *frame) {
    const bool both = ((frame->data[2] & 0xFu) == MOVE) && ((frame->data[2] >> 4u) == MOVE_INVERTED);
    const bool valued = (frame->data[6] != 0x00u) || (frame->data[7] != 0x80u); /* IndexValue is not "not available" */
    return both && valued && ((frame->data[4] & REASON_BITS) == NO_REASON) && ((frame->data[3] & 0x3u) <= 2u) &&
           ((frame->data[1] >> 4u) <= ROBOT_SIDE_MAX_JOINTS);
}

static uint32_t bits_of(uint32_t word) {
    uint32_t count = 0;
    for (uint32_t i = 0; i < 24u; ++i) {
        count += (word >> i) & 1u;
    }
    return count;
}

void robot_side_hear(robot_side_t *self, const can_frame_t *frame, uint64_t now_us) {
    const protocol_transmit_t *const entry = &protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND];
    const uint8_t wrong = (uint8_t)(CAN_FRAME_EXTENDED | CAN_FRAME_REMOTE);
    if ((frame->id != entry->id) || (frame->length != entry->length) || ((frame->flags & wrong) != 0u)) {
        return;
    }
    const e2e_status_t status = e2e_check(&self->receiver, frame->data, frame->length, entry->data_ids, MAX_DELTA);
    if (status == E2E_WRONG_CRC) {
        return;
    }
    const bool out_of_sequence = (status == E2E_REPEATED) || (status == E2E_WRONG_SEQUENCE);
    self->sequence = ((self->sequence << 1u) | (out_of_sequence ? 1u : 0u)) & LAST_24;
    robot_side_permit_t said = unpack(frame);
    self->last_trip = said.trip;
    if (!is_move(frame)) {
        /* A stop needs neither a fresh counter nor the current cycle. The worst stop applies. */
        if (!self->stopped || (said.category <= self->stop.category)) {
            self->stop = said;
        }
        self->stopped = true;
        return;
    }
    const bool answers = self->begun && ((frame->data[3] >> 4u) == (self->cycle & 0xFu));
    const bool in_time = (now_us >= self->begun_us) && ((now_us - self->begun_us) <= self->config.answer_us);
    if (answers && in_time && e2e_accepts(status)) {
        said.allowed = true;
        self->answer = said;
        self->answered = true;
    }
}

bool robot_side_has_company(const robot_side_t *self) {
    return bits_of(self->sequence) >= SECOND_GUARD;
}

robot_side_permit_t robot_side_permit(const robot_side_t *self, uint64_t now_us) {
    const robot_side_permit_t silence = {.category = SILENCE, .trip = self->last_trip};
    if (self->stopped) {
        return self->stop;
    }
    const bool in_time = (now_us >= self->begun_us) && ((now_us - self->begun_us) <= self->config.hold_us);
    if (!self->answered || !in_time || robot_side_has_company(self)) {
        return silence;
    }
    return self->answer;
}
