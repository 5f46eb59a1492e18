/* soak: hours of simulated bus in minutes, with faults at random, and an account of every frame.
 *
 *   soak BLOCK CYCLES SEED HEX...     HEX: the 8 bytes of each joint's JointState, of a robot that stands still
 *
 * One cycle a period: the robot's frames go in, some of them lost, corrupted, repeated, delayed, reordered,
 * misaddressed, of a wrong length or format, with a sensor fault or a value out of range, or with frames inserted that
 * nobody sent; the bus is silent at times, people push the arm at times. Then one tick. After a trip the robot asks for
 * a reset. What the guard must make of it is decided here from what was done to each frame, not from what the guard
 * says:
 *   - a frame is refused and moves exactly one counter, or it is what the robot sent and moves none;
 *   - motion is permitted only while intact readings of one whole cycle, Sync and task are within their deadlines;
 *   - it is never permitted on a tick that took in a sensor fault, a value out of range or a StopCommand;
 *   - after a stop it is not permitted again without a reset that named the trip;
 *   - a push of 5 Nm ends it while it lasts.
 * Corruption is of 1 to 3 bits. The CRC finds all of it outside the counter; a flipped counter bit picks another data
 * id as well, and then about one in 1,400 is right by chance. What is right by chance, corrupted or inserted, is no
 * fault that any check could see, and is drawn anew. Exit 1 at the first breach. Prints one JSON object.
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "guard.h"

enum { SYNC = 0, TASK = 1, FIRST_JOINT = 2, MAX_FRAMES = 32 };

#define PUSH_CYCLES  40u
#define PUSH_RAW     500 /* 5 Nm */
#define WARM_CYCLES  400u
#define RESET_HALF   20u /* cycles of the request's square wave */
#define COUNTER_WRAP 60000u

typedef enum {
    FAULT_NONE = 0,
    FAULT_LOST,
    FAULT_CORRUPT,
    FAULT_REPEATED,
    FAULT_DELAYED,
    FAULT_REORDERED,
    FAULT_ADDRESS,
    FAULT_LENGTH,
    FAULT_FORMAT,
    FAULT_STATUS,
    FAULT_RANGE,
    FAULT_INSERTED,
    FAULT_COUNT
} fault_t;

static const char *const FAULT_NAMES[FAULT_COUNT] = {"none",    "lost",   "corrupt", "repeated", "delayed", "reordered",
                                                     "address", "length", "format",  "status",   "range",   "inserted"};

/* A frame on its way, and what was done to it. */
typedef struct {
    can_frame_t frame;
    fault_t fault;
    uint64_t cycle; /* that it was made for */
    uint8_t kind;   /* protocol_kind_t it was sent as */
    uint8_t joint;
    bool genuine; /* as the robot sent it, and true of the robot */
} sent_t;

typedef struct {
    uint64_t frames, accepted, initial, crc, sequence, range, format, late; /* every frame is in one of these */
    uint64_t injected[FAULT_COUNT];
    uint64_t ticks, permitted, trips, resets, pushes, silences;
} tally_t;

typedef struct {
    guard_t guard;
    const guard_config_t *config;
    guard_output_t out;
    uint64_t random;
    uint64_t cycle;
    uint32_t joints;
    uint8_t hold[ROBOT_MAX_JOINTS][CAN_FRAME_DATA_LENGTH];
    sent_t queue[MAX_FRAMES];
    uint32_t queued;
    sent_t late[MAX_FRAMES]; /* for the next cycle */
    uint32_t late_count;

    /* what the robot knows was delivered intact */
    uint64_t good_sync, good_joints, good_task; /* the newest cycle of each, plus one; 0: none */
    uint32_t joints_in;                         /* bit per joint of the cycle under way */
    bool sync_in;
    bool bad_value; /* a sensor fault or a value out of range got past the E2E check in this cycle, or a StopCommand */

    bool was_permitted;
    bool stopped;    /* since permission ended */
    bool reset_sent; /* since then, one that names the trip */
    uint8_t reset_counter;
    uint32_t reset_cycles;
    uint64_t push_until, push_from, silent_until;
    uint32_t pushed_joint;
    bool seen[PROTOCOL_RECEIVE_COUNT]; /* a good CRC got through: the first one only begins the count */
    tally_t tally;
} soak_t;

static _Noreturn void breach(const soak_t *self, const char *what, const sent_t *sent) {
    (void)fprintf(stderr, "soak: cycle %" PRIu64 ": %s", self->cycle, what);
    if (sent != NULL) {
        (void)fprintf(stderr, " (fault %s, id %03x, cycle %" PRIu64 ")", FAULT_NAMES[sent->fault], sent->frame.id,
                      sent->cycle);
    }
    (void)fprintf(stderr, "; state %d, reason %d\n", (int)self->out.state, (int)self->out.reason);
    exit(1);
}

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
    if (fault == FAULT_STATUS) {
        data[1] = (uint8_t)((1u + draw(self, 15u)) << 4u);
    }
    if (fault == FAULT_RANGE) {
        put_word(&data[2u + (2u * draw(self, 3u))], -32768);
    }
    sent_t sent = make(self, PROTOCOL_RECEIVE_JOINT_STATE + joint, data, (uint8_t)(self->cycle & 0xFu));
    sent.genuine = (fault != FAULT_STATUS) && (fault != FAULT_RANGE);
    return sent;
}

static bool crc_holds(const can_frame_t *frame) {
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
    } while (crc_holds(&sent.frame));
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
    } while (crc_holds(&sent->frame));
    sent->genuine = false;
}

/* On its way to the guard. */
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

/* Mostly none; those that end motion at once are rarer. */
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
    if (!self->stopped) {
        self->reset_cycles = 0;
        return;
    }
    const bool request = ((self->reset_cycles / RESET_HALF) % 2u) != 0u;
    const uint8_t data[4] = {0, (uint8_t)(request ? 0x10u : 0u), self->out.trip_number, 0};
    self->reset_counter = (uint8_t)((self->reset_counter + 1u) & 0xFu);
    send(self, make(self, PROTOCOL_RECEIVE_GUARD_RESET, data, self->reset_counter), pick(self, false));
    self->reset_cycles++;
}

static void robot_sends(soak_t *self) {
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

/* Which of the counters moved, and that no more than one did. */
static void account(soak_t *self, const sent_t *sent, const guard_counters_t *before) {
    const guard_counters_t *const after = &self->guard.counters;
    tally_t *const tally = &self->tally;
    const uint32_t crc = (uint32_t)(after->crc_errors - before->crc_errors);
    const uint32_t sequence = (uint32_t)(after->sequence_errors - before->sequence_errors);
    const uint32_t range = (uint32_t)(after->range_errors - before->range_errors);
    const uint32_t format = (uint32_t)(after->format_errors - before->format_errors);
    const uint32_t late = (uint32_t)(after->late_frames - before->late_frames);
    const uint32_t moved = crc + sequence + range + format + late;
    tally->frames++;
    tally->crc += crc;
    tally->sequence += sequence;
    tally->range += range;
    tally->format += format;
    tally->late += late;
    if (moved > 1u) {
        breach(self, "a frame moved more than one counter", sent);
    }
    const uint32_t slot = protocol_slot(sent->frame.id);
    if ((moved == 0u) && (slot < (uint32_t)PROTOCOL_RECEIVE_COUNT) && !self->seen[slot]) {
        tally->initial++;
    } else if (moved == 0u) {
        tally->accepted++;
    } else {
        /* refused */
    }
    if ((slot < (uint32_t)PROTOCOL_RECEIVE_COUNT) && ((moved == 0u) || (sequence + range + late > 0u))) {
        self->seen[slot] = true;
    }
    if ((moved == 0u) && !sent->genuine) {
        breach(self, "a frame was taken that the robot did not send so", sent);
    }
    const bool stop_command = (sent->frame.id == protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND].id) &&
                              ((sent->frame.flags & (uint8_t)CAN_FRAME_EXTENDED) == 0u);
    self->bad_value = self->bad_value || (range > 0u) || stop_command;
}

/* What the robot knows: intact frames in the order that they got there. */
static void note_intact(soak_t *self, const sent_t *sent) {
    if (!sent->genuine) {
        return;
    }
    if (sent->kind == (uint8_t)PROTOCOL_KIND_SYNC) {
        self->good_sync = self->cycle + 1u;
        self->sync_in = sent->cycle == self->cycle;
        self->joints_in = 0;
    } else if ((sent->kind == (uint8_t)PROTOCOL_KIND_JOINT_STATE) && (sent->cycle == self->cycle) && self->sync_in) {
        self->joints_in |= 1u << sent->joint;
    } else if ((sent->kind == (uint8_t)PROTOCOL_KIND_JOINT_STATE) && !self->sync_in) {
        self->joints_in |= 1u << sent->joint; /* of a delayed Sync's cycle */
    } else if (sent->kind == (uint8_t)PROTOCOL_KIND_TASK_COMMAND) {
        self->good_task = self->cycle + 1u;
    } else if ((sent->kind == (uint8_t)PROTOCOL_KIND_GUARD_RESET) && self->stopped &&
               (sent->frame.data[2] == self->out.trip_number)) {
        self->reset_sent = self->reset_sent || ((sent->frame.data[1] & 0x10u) != 0u);
    } else {
        /* of another cycle */
    }
    if (self->joints_in == ((1u << self->joints) - 1u)) {
        self->good_joints = self->cycle + 1u;
    }
}

static void deliver(soak_t *self, uint64_t now_us) {
    self->sync_in = false;
    self->joints_in = 0;
    self->bad_value = false;
    for (uint32_t i = 0; i < self->queued; i++) {
        const guard_counters_t before = self->guard.counters;
        guard_receive(&self->guard, &self->queue[i].frame, now_us);
        account(self, &self->queue[i], &before);
        note_intact(self, &self->queue[i]);
    }
}

static void judge(soak_t *self) {
    const guard_config_t *const config = self->config;
    const bool permitted = self->out.permitted;
    const uint64_t now = self->cycle + 1u;
    if (permitted && ((now - self->good_sync) > (config->sync_deadline_us / config->period_us))) {
        breach(self, "permitted without Sync", NULL);
    }
    if (permitted && ((now - self->good_joints) > (config->joint_deadline_us / config->period_us))) {
        breach(self, "permitted without readings", NULL);
    }
    if (permitted && ((now - self->good_task) > (config->task_deadline_us / config->period_us))) {
        breach(self, "permitted without a task", NULL);
    }
    if (permitted && self->bad_value) {
        breach(self, "permitted on a sensor fault, a value out of range or another guard's StopCommand", NULL);
    }
    if (permitted && self->stopped && !self->reset_sent) {
        breach(self, "permitted after a stop without a reset", NULL);
    }
    if (permitted && (self->cycle + 1u == self->push_until)) {
        breach(self, "permitted while somebody pushes", NULL);
    }
    if (self->out.state == GUARD_STATE_FAULT) {
        breach(self, "the guard is in FAULT", NULL);
    }
    if (permitted) {
        self->stopped = false;
        self->reset_sent = false;
    }
    if (self->was_permitted && !permitted) {
        self->stopped = true;
        self->reset_sent = false;
        self->tally.trips++;
    }
    self->tally.resets += (permitted && !self->was_permitted) ? 1u : 0u;
    self->tally.ticks++;
    self->tally.permitted += permitted ? 1u : 0u;
    self->was_permitted = permitted;
}

static void step(soak_t *self) {
    const uint64_t now_us = self->cycle * self->config->period_us;
    robot_sends(self);
    deliver(self, now_us);
    guard_tick(&self->guard, now_us, &self->out);
    judge(self);
    /* They stop at 65535; the account goes on. */
    if ((self->guard.counters.crc_errors > COUNTER_WRAP) || (self->guard.counters.sequence_errors > COUNTER_WRAP) ||
        (self->guard.counters.format_errors > COUNTER_WRAP) || (self->guard.counters.late_frames > COUNTER_WRAP) ||
        (self->guard.counters.range_errors > COUNTER_WRAP)) {
        self->guard.counters = (guard_counters_t){0};
    }
    self->cycle++;
}

static void print(const soak_t *self, uint64_t seed) {
    const tally_t *const t = &self->tally;
    const uint64_t refused = t->crc + t->sequence + t->range + t->format + t->late;
    (void)printf("{\"seed\":%" PRIu64 ",\"cycles\":%" PRIu64 ",\"frames\":%" PRIu64 ",\"accepted\":%" PRIu64
                 ",\"initial\":%" PRIu64 ",\"crc_errors\":%" PRIu64 ",\"sequence_errors\":%" PRIu64
                 ",\"range_errors\":%" PRIu64 ",\"format_errors\":%" PRIu64 ",\"late_frames\":%" PRIu64
                 ",\"unaccounted\":%" PRId64 ",\"permitted\":%" PRIu64 ",\"trips\":%" PRIu64 ",\"resumed\":%" PRIu64
                 ",\"pushes\":%" PRIu64 ",\"silences\":%" PRIu64 ",\"faults\":{",
                 seed, self->cycle, t->frames, t->accepted, t->initial, t->crc, t->sequence, t->range, t->format,
                 t->late, (int64_t)(t->frames - t->accepted - t->initial - refused), t->permitted, t->trips, t->resets,
                 t->pushes, t->silences);
    for (uint32_t i = 1; i < (uint32_t)FAULT_COUNT; i++) {
        (void)printf("%s\"%s\":%" PRIu64, (i == 1u) ? "" : ",", FAULT_NAMES[i], t->injected[i]);
    }
    (void)printf("}}\n");
}

int main(int argc, char **argv) {
    static soak_t soak;
    static guard_config_t block;
    if ((argc < 5) || (argc > 4 + (int)ROBOT_MAX_JOINTS)) {
        (void)fputs("soak: BLOCK CYCLES SEED HEX...\n", stderr);
        return 2;
    }
    FILE *const file = fopen(argv[1], "rb");
    if ((file == NULL) || (fread(&block, sizeof block, 1, file) != 1u)) {
        (void)fprintf(stderr, "soak: %s cannot be read\n", argv[1]);
        return 2;
    }
    (void)fclose(file);
    const uint64_t cycles = strtoull(argv[2], NULL, 10);
    const uint64_t seed = strtoull(argv[3], NULL, 10);
    soak.config = &block;
    soak.joints = (uint32_t)argc - 4u;
    soak.random = (seed * 0x9E3779B97F4A7C15u) | 1u;
    if ((guard_init(&soak.guard, &block) != GUARD_OK) || (soak.joints != block.robot.joint_count)) {
        (void)fputs("soak: the block is refused, or is for a robot with other joints\n", stderr);
        return 2;
    }
    for (uint32_t joint = 0; joint < soak.joints; joint++) {
        for (uint32_t i = 0; i < CAN_FRAME_DATA_LENGTH; i++) {
            unsigned int byte = 0;
            (void)sscanf(&argv[4u + joint][2u * i], "%2x", &byte);
            soak.hold[joint][i] = (uint8_t)byte;
        }
    }
    (void)fprintf(stderr, "soak: seed %" PRIu64 "\n", seed);
    while (soak.cycle < cycles) {
        step(&soak);
    }
    print(&soak, seed);
    return 0;
}
