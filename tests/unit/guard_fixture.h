/* guard_fixture: an installation with the ku_dex arm at rest, and a controller that communicates with the guard. */
#ifndef GUARD_FIXTURE_H
#define GUARD_FIXTURE_H

#include <stddef.h>
#include <string.h>

#include "crc32.h"
#include "guard.h"
#include "messages.h"
#include "robots.h"
#include "scale.h"
#include "unity.h"

/* Images for emulated processors are built with SPARSER (core_fixture.h). There a repetition tests the processor; on
 * the host it covers the whole range. */
#if defined(SPARSER) && (SPARSER > 1)
#define ON_HOST_ELSE(host, emulated) (emulated)
#else
#define ON_HOST_ELSE(host, emulated) (host)
#endif

#define PERIOD_US       1000u
#define JOINTS          7u
#define DEADLINE_CYCLES 4u
#define SETTLING_CYCLES 100u /* 5/K of K = 50 1/s */
#define START_LIMIT     400u /* cycles: self-test, settling, health */

typedef struct {
    guard_config_t config;
    guard_t guard;
    guard_output_t out;
    uint64_t now_us;
    uint16_t cycle;
    uint8_t task;
    uint8_t reset_counter;
    int16_t position[ROBOT_MAX_JOINTS]; /* raw */
    int16_t velocity[ROBOT_MAX_JOINTS];
    int16_t torque[ROBOT_MAX_JOINTS];
    uint8_t sensor_status[ROBOT_MAX_JOINTS];
} bench_t;

static inline void seal_config(guard_config_t *config) {
    const size_t covered = offsetof(guard_config_t, numeric);
    config->crc =
        crc32_finish(crc32_fold(CRC32_START, (const uint8_t *)config + covered, (uint32_t)(sizeof(*config) - covered)));
}

/* K = 50 1/s at 1 kHz: decay exp(-0.05 g). */
static inline guard_config_t make_config(void) {
    static const double decay[CONFIG_MAX_GAP] = {0.951229424500714, 0.904837418035960, 0.860707976425058,
                                                 0.818730753077982};
    guard_config_t config = {.magic = CONFIG_MAGIC,
                             .schema = CONFIG_SCHEMA,
                             .size = sizeof(guard_config_t),
                             .numeric = NUM_NUMERIC,
                             .wire = PROTOCOL_WIRE_CRC,
                             .format = FORMAT_CLASSIC,
                             .period_us = PERIOD_US,
                             .sync_deadline_us = DEADLINE_CYCLES * PERIOD_US,
                             .joint_deadline_us = DEADLINE_CYCLES * PERIOD_US,
                             .task_deadline_us = 2u * DEADLINE_CYCLES * PERIOD_US,
                             .tick_deadline_us = 5u * PERIOD_US,
                             .tick_budget_us = 500u,
                             .reset_healthy_us = SETTLING_CYCLES * PERIOD_US,
                             .stop_collision = 2u,
                             .stop_input = 1u,
                             .stop_fault = 0u,
                             .settling_us = SETTLING_CYCLES * PERIOD_US,
                             .task_dwell_cycles = 250u,
                             .bank = {.channels = 1u},
                             .subspace = {.order = ORDER_PROJECT_FIRST,
                                          .projector = PROJECTOR_SOFT,
                                          .tolerance = NUM(0.005),
                                          .lever_m = NUM(0.1),
                                          .softness = NUM(0.05)},
                             .acceleration = {.force_floor_n = NUM(1), .error_max = NUM(2)},
                             .sight = {.reaction = SIGHT_REPORT, .force_n = NUM(500)},
                             .robot = robot_ku_dex};
    config.observer.torque_sample = TORQUE_INTERVAL;
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) {
        config.observer.decay[g] = NUM(decay[g]);
        config.observer.gain[g] = NUM(1.0 - decay[g]);
        config.observer.momentum_gain[g] = NUM((1.0 - decay[g]) / ((g + 1.0) * 1e-3));
        config.bank.channel[0].own[g] = NUM(decay[g]); /* a first-order low-pass with the observer's gain */
        config.bank.channel[0].in[g] = NUM(1);
    }
    static const uint32_t index[TASK_COUNT] = {INDEX_OFF, INDEX_RESIDUAL, INDEX_PAYLOAD, INDEX_CONTACT};
    for (uint32_t t = TASK_NONE; t < TASK_COUNT; ++t) {
        config.task[t].index.kind = index[t];
        config.task[t].index.components = (index[t] == (uint32_t)INDEX_CONTACT) ? INDEX_ALL_COMPONENTS : 0u;
        config.task[t].detector.debounce_ticks = 2u;
        config.task[t].detector.channels = 1u;
        config.task[t].limits = (explained_config_t){.mass_max_kg = NUM(5),
                                                     .arm_max_m = NUM(0.2),
                                                     .force_max_n = NUM(140),
                                                     .moment_max_nm = NUM(40),
                                                     .force_slack_n = NUM(25),
                                                     .moment_slack_nm = NUM(10)};
        for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
            config.task[t].detector.threshold_nm[0][i] = NUM(2.0);
            config.task[t].limits.residual_max_nm[i] = (i < JOINTS) ? robot_ku_dex.joint[i].torque_max_nm : NUM(0);
        }
    }
    seal_config(&config);
    return config;
}

/* The same for an arm with as many joints as the wire can carry. */
static inline guard_config_t make_config_of_eight(void) {
    guard_config_t config = make_config();
    config.robot.joint_count = ROBOT_MAX_JOINTS;
    config.robot.joint[7] = config.robot.joint[6];
    for (uint32_t t = TASK_NONE; t <= (uint32_t)TASK_CONTACT; ++t) {
        config.task[t].limits.residual_max_nm[7] = NUM(40);
    }
    seal_config(&config);
    return config;
}

/* Gravity torque of the arm at rest in its zero position, on the wire. */
static inline void rest(bench_t *bench) {
    motion_t motion;
    num_t q[ROBOT_MAX_JOINTS] = {NUM(0)};
    num_t qd[ROBOT_MAX_JOINTS] = {NUM(0)};
    const uint32_t joints = bench->config.robot.joint_count;
    for (uint32_t i = 0; i < joints; ++i) {
        bench->position[i] = (int16_t)(800 * (int)(i + 1u)); /* 0.1 rad, 0.2 rad, ... */
        bench->velocity[i] = 0;
        q[i] = scale_to_num(bench->position[i], PROTOCOL_JOINT_STATE_POSITION_SCALE);
    }
    motion_init(&motion);
    motion_step(&motion, &bench->config.robot, q, qd);
    for (uint32_t i = 0; i < joints; ++i) {
        bench->torque[i] = (int16_t)scale_to_raw(motion.gravity[i], PROTOCOL_JOINT_STATE_TORQUE_SCALE, -32767, 32767);
    }
}

static inline void start_with(bench_t *bench, const guard_config_t *config) {
    *bench = (bench_t){.task = TASK_NONE, .cycle = 65530u, .now_us = 1000000u};
    bench->config = *config;
    TEST_ASSERT_EQUAL(GUARD_OK, guard_init(&bench->guard, &bench->config));
    guard_note_start(&bench->guard, GUARD_START_POWER_ON, 0u, GUARD_VARIANT_PRODUCT);
    rest(bench);
}

static inline void start(bench_t *bench) {
    const guard_config_t config = make_config();
    start_with(bench, &config);
}

/* An external torque on a joint, added to its reading. */
static inline void push(bench_t *bench, uint32_t joint, int32_t raw) {
    bench->torque[joint] = (int16_t)(bench->torque[joint] + raw);
}

static inline void put16(uint8_t *at, int32_t value) {
    at[0] = (uint8_t)((uint32_t)value & 0xFFu);
    at[1] = (uint8_t)(((uint32_t)value >> 8) & 0xFFu);
}

static inline can_frame_t sealed(uint32_t slot, const uint8_t data[8], uint8_t high_nibble, uint8_t counter) {
    can_frame_t frame = {.id = protocol_receive[slot].id, .length = protocol_receive[slot].length};
    memcpy(frame.data, data, frame.length);
    frame.data[1] = (uint8_t)(high_nibble << 4);
    e2e_seal(frame.data, frame.length, protocol_receive[slot].data_ids, counter);
    return frame;
}

static inline can_frame_t sync_frame(const bench_t *bench) {
    uint8_t data[8] = {0};
    put16(data + 2, bench->cycle);
    return sealed(PROTOCOL_RECEIVE_SYNC, data, 0u, (uint8_t)(bench->cycle & 0x0Fu));
}

static inline can_frame_t task_frame(const bench_t *bench) {
    const uint8_t data[8] = {0};
    return sealed(PROTOCOL_RECEIVE_TASK_COMMAND, data, bench->task, (uint8_t)(bench->cycle & 0x0Fu));
}

static inline can_frame_t joint_frame(const bench_t *bench, uint32_t joint) {
    uint8_t data[8] = {0};
    put16(data + 2, bench->position[joint]);
    put16(data + 4, bench->velocity[joint]);
    put16(data + 6, bench->torque[joint]);
    const uint32_t high = (uint32_t)(bench->cycle >> 4) & 3u;
    return sealed(joint, data, (uint8_t)(bench->sensor_status[joint] | (high << 2)), (uint8_t)(bench->cycle & 0x0Fu));
}

static inline can_frame_t reset_frame(bench_t *bench, uint8_t trip, bool request) {
    const uint8_t data[8] = {0, 0, trip, 0};
    ++bench->reset_counter;
    return sealed(PROTOCOL_RECEIVE_GUARD_RESET, data, request ? 1u : 0u, (uint8_t)(bench->reset_counter & 0x0Fu));
}

/* In the format of the configuration, unless the frame states another. */
static inline void receive(bench_t *bench, can_frame_t frame) {
    if ((frame.flags == 0u) && (bench->config.format == FORMAT_FD)) {
        frame.flags = CAN_FRAME_FD | CAN_FRAME_BRS;
    }
    guard_receive(&bench->guard, &frame, bench->now_us);
}

static inline void tick(bench_t *bench) {
    guard_tick(&bench->guard, bench->now_us, &bench->out);
}

static inline void next_cycle(bench_t *bench) {
    ++bench->cycle;
    bench->now_us += PERIOD_US;
}

/* One cycle in which the joints in `silent` (bit per joint) send nothing; then the tick. */
static inline void cycle_without(bench_t *bench, uint32_t silent) {
    next_cycle(bench);
    receive(bench, sync_frame(bench));
    receive(bench, task_frame(bench));
    for (uint32_t i = 0; i < bench->config.robot.joint_count; ++i) {
        if ((silent & (1u << i)) == 0u) {
            receive(bench, joint_frame(bench, i));
        }
    }
    tick(bench);
}

static inline void cycle(bench_t *bench) {
    cycle_without(bench, 0u);
}

static inline void cycles(bench_t *bench, uint32_t number) {
    for (uint32_t i = 0; i < number; ++i) {
        cycle(bench);
    }
}

static inline void silent_cycles(bench_t *bench, uint32_t number) {
    for (uint32_t i = 0; i < number; ++i) {
        next_cycle(bench);
        tick(bench);
    }
}

/* Requests the end of `trip` as a controller does: Request 0 twice (the first frame only sets the E2E reference),
 * then 1. Takes three cycles. */
static inline void ask_reset(bench_t *bench, uint8_t trip) {
    for (uint32_t i = 0; i < 3u; ++i) {
        receive(bench, reset_frame(bench, trip, i == 2u));
        cycle(bench);
    }
}

/* Runs until the guard reports `reason`. */
static inline void run_until(bench_t *bench, guard_reason_t reason) {
    for (uint32_t i = 0; (i < START_LIMIT) && (bench->out.reason != reason); ++i) {
        cycle(bench);
    }
    TEST_ASSERT_EQUAL(reason, bench->out.reason);
}

static inline void run_until_permitted(bench_t *bench) {
    if (bench->out.trip_number == 0u) {
        run_until(bench, GUARD_REASON_AWAITING_RESET);
        ask_reset(bench, 0u);
    } else {
        cycles(bench, 2u * SETTLING_CYCLES);
    }
    TEST_ASSERT_TRUE(bench->out.permitted);
    TEST_ASSERT_EQUAL(GUARD_STATE_MONITORING, bench->out.state);
}

static inline void assert_stopped(const bench_t *bench, guard_reason_t reason, uint32_t joint) {
    TEST_ASSERT_FALSE(bench->out.permitted);
    TEST_ASSERT_EQUAL(GUARD_STATE_STOPPED, bench->out.state);
    TEST_ASSERT_EQUAL(reason, bench->out.reason);
    TEST_ASSERT_EQUAL(joint, bench->out.joint);
}

static inline void assert_fault(const bench_t *bench, guard_reason_t reason) {
    TEST_ASSERT_FALSE(bench->out.permitted);
    TEST_ASSERT_EQUAL(GUARD_STATE_FAULT, bench->out.state);
    TEST_ASSERT_EQUAL(reason, bench->out.reason);
}

#endif
