/* The robot that the soak guards: its frames, and their random faults. */
#include "soak.h"

#include <string.h>

#define PUSH_CYCLES 40u
#define PUSH_RAW    500 /* 5 Nm */
#define RESET_HALF  20u /* cycles of the request's square wave */

/* xorshift64*, Vigna 2016 */
static uint32_t draw(soak_t *self, uint32_t below) {
    self->random ^= self->random >> 12u;
    self->random ^= self->random << 25u;
    self->random ^= self->random >> 27u;
    const uint32_t high = (uint32_t)((self->random * 0x2545F4914F6CDD1Du) >> 32u);
    return (uint32_t)(((uint64_t)high * below) >> 32u);
}

static bool chance(soak_t *self, uint32_t one_in) {
    return draw(self, one_in) == 0u;
}

/* --- the robot's frames ------------------------------------------------------------------------------------------- */

static sent_t make(const soak_t *self, uint32_t slot, const uint8_t *data, uint8_t counter) {
    const protocol_receive_t *const entry = &protocol_receive[slot];
    sent_t sent = {.cycle = self->cycle, .kind = entry->kind, .joint = entry->joint, .genuine = true};
    sent.frame.id = entry->id;
    sent.frame.length = entry->length;
    sent.frame.flags = (self->config->format == (uint32_t)FORMAT_FD) ? (uint8_t)(CAN_FRAME_FD | CAN_FRAME_BRS) : 0u;
    (void)memcpy(sent.frame.data, data, entry->length);
    e2e_seal(sent.frame.data, sent.frame.length, entry->data_ids, counter);
    return sent;
}

static int16_t torque_of(const uint8_t *data) {
    return (int16_t)(data[6] | (data[7] << 8));
}

static void put_word(uint8_t *data, int32_t value) {
    data[0] = (uint8_t)((uint32_t)value & 0xFFu);
    data[1] = (uint8_t)(((uint32_t)value >> 8u) & 0xFFu);
}

static sent_t make_joint(soak_t *self, uint32_t joint, fault_t fault) {
    uint8_t data[CAN_FRAME_DATA_LENGTH];
    (void)memcpy(data, self->hold[joint], sizeof data);
    if ((self->cycle < self->push_until) && (joint == self->pushed_joint)) {
        put_word(&data[6], torque_of(data) + PUSH_RAW);
    }
    const uint32_t status = (fault == FAULT_STATUS) ? (1u + draw(self, 3u)) : 0u;
    data[1] = (uint8_t)((status << 4u) | (((self->cycle >> 4u) & 3u) << 6u)); /* SensorStatus, CycleHigh */
    if (fault == FAULT_RANGE) {
        put_word(&data[2u + (2u * draw(self, 3u))], -32768);
    }
    sent_t sent = make(self, PROTOCOL_RECEIVE_JOINT_STATE + joint, data, (uint8_t)(self->cycle & 0xFu));
    sent.genuine = (fault != FAULT_STATUS) && (fault != FAULT_RANGE);
    return sent;
}

static bool crc_is_valid(const can_frame_t *frame) {
    const uint32_t slot = protocol_slot(frame->id);
    e2e_receiver_t any = {0};
    return (slot < (uint32_t)PROTOCOL_RECEIVE_COUNT) && (frame->length == protocol_receive[slot].length) &&
           (e2e_check(&any, frame->data, frame->length, protocol_receive[slot].data_ids, E2E_MAX_DELTA) !=
            E2E_WRONG_CRC);
}

static sent_t make_nonsense(soak_t *self) {
    static const uint32_t ids[] = {0x020u, 0x030u, 0x040u, 0x101u, 0x103u, 0x107u, 0x108u, 0x010u, 0x201u, 0x7FFu};
    sent_t sent = {.cycle = self->cycle, .fault = FAULT_INSERTED};
    do {
        sent.frame.id = ids[draw(self, sizeof ids / sizeof ids[0])];
        sent.frame.length = chance(self, 2u) ? CAN_FRAME_DATA_LENGTH : (uint8_t)draw(self, 65u);
        sent.frame.flags = chance(self, 4u) ? (uint8_t)draw(self, 16u) : (uint8_t)(CAN_FRAME_FD | CAN_FRAME_BRS);
        for (uint32_t i = 0; i < CAN_FRAME_DATA_LENGTH; i++) {
            sent.frame.data[i] = (i < sent.frame.length) ? (uint8_t)draw(self, 256u) : 0u;
        }
    } while (crc_is_valid(&sent.frame));
    return sent;
}

/* --- faults ------------------------------------------------------------------------------------------------------- */

static void put(soak_t *self, sent_t sent) {
    if (self->queued < (uint32_t)MAX_FRAMES) {
        self->queue[self->queued++] = sent;
    }
}

static void flip_bits(soak_t *self, can_frame_t *frame) {
    const uint32_t bits = 8u * frame->length;
    uint32_t place[3];
    for (uint32_t i = 0, count = 1u + draw(self, 3u); i < count; i++) {
        bool again = true;
        while (again) {
            place[i] = draw(self, bits);
            again = false;
            for (uint32_t j = 0; j < i; j++) {
                again = again || (place[j] == place[i]);
            }
        }
        frame->data[place[i] / 8u] ^= (uint8_t)(1u << (place[i] % 8u));
    }
}

static void corrupt(soak_t *self, sent_t *sent) {
    const can_frame_t intact = sent->frame;
    do {
        sent->frame = intact;
        flip_bits(self, &sent->frame);
    } while (crc_is_valid(&sent->frame));
    sent->genuine = false;
}

/* Faults on the way to the guard. */
static void send(soak_t *self, sent_t sent, fault_t fault) {
    sent.fault = fault;
    self->tally.injected[fault]++;
    switch (fault) {
    case FAULT_LOST:
        return;
    case FAULT_CORRUPT:
        corrupt(self, &sent);
        break;
    case FAULT_REPEATED:
        put(self, sent);
        break;
    case FAULT_DELAYED:
        if (self->late_count < (uint32_t)MAX_FRAMES) {
            self->late[self->late_count++] = sent;
        }
        return;
    case FAULT_REORDERED:
        put(self, sent);
        if (self->queued > 1u) {
            const uint32_t other = draw(self, self->queued - 1u);
            const sent_t swapped = self->queue[other];
            self->queue[other] = self->queue[self->queued - 1u];
            self->queue[self->queued - 1u] = swapped;
        }
        return;
    case FAULT_ADDRESS:
        sent.frame.id = (sent.frame.id == 0x102u) ? 0x103u : 0x102u;
        sent.genuine = false;
        break;
    case FAULT_LENGTH:
        sent.frame.length = (uint8_t)(sent.frame.length + 1u);
        sent.genuine = false;
        break;
    case FAULT_FORMAT:
        sent.frame.flags ^= chance(self, 2u) ? (uint8_t)CAN_FRAME_FD : (uint8_t)CAN_FRAME_EXTENDED;
        sent.genuine = false;
        break;
    case FAULT_INSERTED:
        put(self, make_nonsense(self));
        break;
    case FAULT_NONE:
    case FAULT_STATUS:
    case FAULT_RANGE:
    case FAULT_COUNT:
    default:
        break;
    }
    put(self, sent);
}

/* Mostly none. Faults that end motion at once are rarer. */
static fault_t pick(soak_t *self, bool is_joint) {
    if (!chance(self, 200u)) {
        return FAULT_NONE;
    }
    const fault_t fault = (fault_t)(1u + draw(self, (uint32_t)FAULT_COUNT - 1u));
    const bool ends = (fault == FAULT_STATUS) || (fault == FAULT_RANGE);
    return (ends && (!is_joint || !chance(self, 20u))) ? FAULT_NONE : fault;
}

/* --- one cycle ---------------------------------------------------------------------------------------------------- */

static void plan(soak_t *self) {
    if ((self->cycle >= self->silent_until) && chance(self, 20000u)) {
        self->silent_until = self->cycle + 1u + draw(self, 30u);
        self->tally.silences++;
    }
    if (self->was_permitted && (self->cycle >= self->push_until) && chance(self, 10000u)) {
        self->push_from = self->cycle;
        self->push_until = self->cycle + PUSH_CYCLES;
        self->pushed_joint = draw(self, self->joints);
        self->tally.pushes++;
    }
}

static void ask_for_reset(soak_t *self) {
    const bool first =
        (self->out.reason == GUARD_REASON_AWAITING_RESET) || (self->out.reason == GUARD_REASON_RESTARTED);
    if (!self->stopped && !first) {
        self->reset_cycles = 0;
        return;
    }
    const bool request = ((self->reset_cycles / RESET_HALF) % 2u) != 0u;
    const uint8_t data[4] = {0, (uint8_t)(request ? 0x10u : 0u), self->out.trip_number, 0};
    self->reset_counter = (uint8_t)((self->reset_counter + 1u) & 0xFu);
    send(self, make(self, PROTOCOL_RECEIVE_GUARD_RESET, data, self->reset_counter), pick(self, false));
    self->reset_cycles++;
}

void robot_sends(soak_t *self) {
    const uint8_t sync[4] = {0, 0, (uint8_t)(self->cycle & 0xFFu), (uint8_t)((self->cycle >> 8u) & 0xFFu)};
    const uint8_t task[8] = {0, TASK_NONE << 4u};
    const uint8_t counter = (uint8_t)(self->cycle & 0xFu);
    const uint32_t late = self->late_count;
    sent_t delayed[MAX_FRAMES];
    (void)memcpy(delayed, self->late, sizeof delayed);
    self->queued = 0;
    self->late_count = 0;
    plan(self);
    if (self->cycle < self->silent_until) {
        return;
    }
    ask_for_reset(self);
    send(self, make(self, PROTOCOL_RECEIVE_SYNC, sync, counter), pick(self, false));
    for (uint32_t i = 0; i < late; i++) {
        put(self, delayed[i]);
    }
    send(self, make(self, PROTOCOL_RECEIVE_TASK_COMMAND, task, counter), pick(self, false));
    for (uint32_t joint = 0; joint < self->joints; joint++) {
        const fault_t fault = pick(self, true);
        send(self, make_joint(self, joint, fault), fault);
    }
}
