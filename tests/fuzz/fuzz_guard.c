/* fuzz_guard: streams of frames, time and board reports against the guard. Every frame and every tick is judged
 * (judge.h).
 *
 * An input is a small program: its first byte selects how the guard is driven (directly, by the schedule in real time,
 * or in lockstep) and from which state it starts; then each byte is an operation with its arguments.
 */
#include "fuzz.h"
#include "guard_fixture.h"
#include "judge.h"
#include "schedule.h"

#define MAX_CYCLES  400u /* an input runs no more */
#define MAX_PENDING 64u  /* ticks that one frame may owe in lockstep */

typedef enum { DRIVE_DIRECT = 0, DRIVE_REAL_TIME = 1, DRIVE_LOCKSTEP = 2, DRIVE_COUNT = 3 } drive_t;
typedef enum { FROM_START = 0, FROM_WAITING = 1, FROM_MONITORING = 2, FROM_STOPPED = 3, FROM_COUNT = 4 } from_t;

typedef struct {
    bench_t bench;
    schedule_t schedule;
    drive_t drive;
    judge_t judge;
    can_frame_t last; /* frame */
    uint32_t cycles;
} world_t;

static world_t prepared[DRIVE_COUNT][FROM_COUNT];
static world_t world;

static void hear(const can_frame_t *frame, uint64_t now_us) {
    guard_t *const guard = &world.bench.guard;
    const guard_t before = *guard;
    guard_receive(guard, frame, now_us);
    ++fuzz_frames;
    judge_reception(&world.judge, &before, guard, frame, now_us);
}

static void tick_at(uint64_t now_us) {
    bench_t *const bench = &world.bench;
    guard_tick(&bench->guard, now_us, &bench->out);
    ++fuzz_ticks;
    judge_tick(&world.judge, &bench->config, &bench->out, now_us);
    schedule_ticked(&world.schedule, world.bench.now_us, bench->out.fresh);
}

/* --- how the guard is driven -------------------------------------------------------------------------------------- */

static uint64_t guard_time(void) {
    return (world.drive == DRIVE_DIRECT) ? world.bench.now_us : schedule_time(&world.schedule, world.bench.now_us);
}

static void deliver(can_frame_t frame) {
    if ((frame.flags == 0u) && (world.bench.config.format == (uint32_t)FORMAT_FD)) {
        frame.flags = CAN_FRAME_FD | CAN_FRAME_BRS;
    }
    world.last = frame;
    if (world.drive == DRIVE_DIRECT) {
        hear(&frame, world.bench.now_us);
        return;
    }
    schedule_hear(&world.schedule, &frame, world.bench.now_us);
    for (uint32_t i = 0; schedule_owes_tick(&world.schedule); ++i) {
        REQUIRE(i < MAX_PENDING);
        tick_at(guard_time());
    }
    hear(&frame, guard_time());
    if (schedule_complete(&world.schedule, guard_cycle_complete(&world.bench.guard))) {
        tick_at(guard_time());
    }
}

static void advance(uint64_t us) {
    world.bench.now_us += us;
    if ((world.drive != DRIVE_DIRECT) && schedule_is_due(&world.schedule, world.bench.now_us)) {
        tick_at(guard_time());
    }
}

static void cycle_of(uint32_t silent) {
    if (world.cycles >= MAX_CYCLES) {
        return;
    }
    ++world.cycles;
    ++world.bench.cycle;
    advance(PERIOD_US);
    deliver(sync_frame(&world.bench));
    deliver(task_frame(&world.bench));
    for (uint32_t i = 0; i < JOINTS; ++i) {
        if ((silent & (1u << i)) == 0u) {
            deliver(joint_frame(&world.bench, i));
        }
    }
    if (world.drive == DRIVE_DIRECT) {
        tick_at(world.bench.now_us);
    }
}

static void run(uint32_t number) {
    for (uint32_t i = 0; i < number; ++i) {
        cycle_of(0u);
    }
}

static void request_reset(uint8_t trip) {
    for (uint32_t i = 0; i < 3u; ++i) {
        deliver(reset_frame(&world.bench, trip, i == 2u));
        cycle_of(0u);
    }
}

static void prepare(drive_t drive) {
    const guard_config_t config = make_config();
    world = (world_t){.drive = drive};
    start_with(&world.bench, &config);
    schedule_init(&world.schedule, &world.bench.config, drive == DRIVE_LOCKSTEP, world.bench.now_us);
    prepared[drive][FROM_START] = world;
    run(MAX_CYCLES);
    REQUIRE(world.bench.out.reason == GUARD_REASON_AWAITING_RESET);
    world.cycles = 0;
    prepared[drive][FROM_WAITING] = world;
    request_reset(0u);
    REQUIRE(world.bench.out.permitted); /* a precondition of all checks below */
    prepared[drive][FROM_MONITORING] = world;
    world.bench.torque[1] = (int16_t)(world.bench.torque[1] + 1500); /* 15 Nm */
    run(100u);
    REQUIRE(world.bench.out.reason == GUARD_REASON_COLLISION);
    world.bench.torque[1] = (int16_t)(world.bench.torque[1] - 1500);
    run(250u);
    REQUIRE(world.bench.out.state == GUARD_STATE_STOPPED);
    world.cycles = 0;
    prepared[drive][FROM_STOPPED] = world;
    request_reset(world.bench.out.trip_number);
    REQUIRE(world.bench.out.permitted);
}

/* --- the operations ----------------------------------------------------------------------------------------------- */

static can_frame_t frame_of(uint8_t kind, bytes_t *bytes) {
    bench_t *const bench = &world.bench;
    const uint32_t slot = kind % (uint32_t)PROTOCOL_RECEIVE_COUNT;
    if (slot == (uint32_t)PROTOCOL_RECEIVE_SYNC) {
        return sync_frame(bench);
    }
    if (slot == (uint32_t)PROTOCOL_RECEIVE_TASK_COMMAND) {
        return task_frame(bench);
    }
    if (slot == (uint32_t)PROTOCOL_RECEIVE_GUARD_RESET) {
        const uint8_t how = next8(bytes);
        return reset_frame(bench, (uint8_t)(bench->out.trip_number + (how >> 4)), (how & 1u) != 0u);
    }
    return joint_frame(bench, slot % ROBOT_MAX_JOINTS);
}

static can_frame_t raw_frame(bytes_t *bytes) {
    const uint8_t pick = next8(bytes);
    const uint8_t form = next8(bytes);
    const protocol_receive_t *const entry = &protocol_receive[pick % (uint32_t)PROTOCOL_RECEIVE_COUNT];
    can_frame_t frame = {.id = entry->id, .length = entry->length, .flags = (uint8_t)(form & 0x0Fu)};
    if ((pick & 0xC0u) == 0xC0u) {
        frame.id = next16(bytes);
    }
    if ((form & 0x30u) == 0x30u) {
        frame.length = (uint8_t)(form >> 1); /* 24 to 31, 56 to 63, ... or a short one below */
        frame.length = ((form & 0x80u) != 0u) ? frame.length : (uint8_t)(frame.length % 8u);
    }
    for (uint32_t i = 0; i < CAN_FRAME_DATA_LENGTH; ++i) {
        frame.data[i] = next8(bytes);
    }
    if (((form & 0x40u) != 0u) && (frame.length >= 2u) && (frame.length <= CAN_FRAME_DATA_LENGTH)) {
        e2e_seal(frame.data, frame.length, entry->data_ids, frame.data[1]);
    }
    return frame;
}

static void move_joint(bytes_t *bytes) {
    const uint8_t which = next8(bytes);
    int16_t *const values[] = {world.bench.position, world.bench.velocity, world.bench.torque};
    int16_t *const value = &values[(which >> 3) % 3u][which % JOINTS];
    const int32_t change = (int16_t)next16(bytes);
    const bool set = (which & 0x80u) != 0u;
    const int32_t wanted = set ? change : (*value + change / 64);
    *value = (int16_t)((wanted > INT16_MAX) ? INT16_MAX : ((wanted < INT16_MIN) ? INT16_MIN : wanted));
}

static void corrupted(bytes_t *bytes) {
    can_frame_t frame = frame_of(next8(bytes), bytes);
    const uint8_t where = next8(bytes);
    frame.data[where % CAN_FRAME_DATA_LENGTH] ^= next8(bytes);
    deliver(frame);
}

static void operate(uint8_t op, bytes_t *bytes) {
    bench_t *const bench = &world.bench;
    switch (op % 16u) {
    case 0:
        run(1u + next8(bytes) % 32u);
        break;
    case 1:
        cycle_of(next8(bytes));
        break;
    case 2:
        bench->cycle = (uint16_t)(bench->cycle + (int8_t)next8(bytes));
        deliver(sync_frame(bench));
        break;
    case 3:
        deliver(frame_of(next8(bytes), bytes));
        break;
    case 4:
        bench->task = next8(bytes) % 16u;
        break;
    case 5:
        bench->sensor_status[next8(bytes) % JOINTS] = next8(bytes) % 4u;
        break;
    case 6:
        deliver(raw_frame(bytes));
        break;
    case 7:
        corrupted(bytes);
        break;
    case 8:
        advance((uint64_t)next16(bytes) << (op >> 6));
        break;
    case 9:
        tick_at(guard_time());
        break;
    case 10:
        guard_note_tick_time(&bench->guard, next16(bytes));
        break;
    case 11:
        guard_trip(&bench->guard, (guard_reason_t)(next8(bytes) % 64u));
        break;
    case 12:
    case 13:
        move_joint(bytes);
        break;
    case 14:
        deliver(world.last);
        break;
    default:
        request_reset((uint8_t)(bench->out.trip_number + (op >> 7)));
        break;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static bool ready;
    if (!ready) {
        for (uint32_t drive = 0; drive < (uint32_t)DRIVE_COUNT; ++drive) {
            prepare((drive_t)drive);
        }
        ready = true;
    }
    bytes_t bytes = {.data = data, .size = size};
    const uint8_t mode = next8(&bytes);
    world = prepared[(mode >> 2) % (uint32_t)DRIVE_COUNT][mode % (uint32_t)FROM_COUNT];
    const guard_config_t config = world.bench.config;
    fuzz_count_at_exit();
    while ((bytes.size > 0u) && (world.cycles < MAX_CYCLES)) {
        operate(next8(&bytes), &bytes);
    }
    REQUIRE(memcmp(&config, &world.bench.config, sizeof config) == 0);
    return 0;
}
