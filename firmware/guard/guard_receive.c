#include "guard_parts.h"

#include <stddef.h>

#include "guard_reason.h"
#include "messages.h"
#include "scale.h"

/* Error rate of a sender: a leaky counter. Each good frame subtracts 1. A bad frame adds ERROR_STEP: more than one in
 * nine, or 8 in a row, reach the limit. A missing or late frame adds LOSS_STEP: more than one in five reach it. */
#define ERROR_STEP    8u
#define LOSS_STEP     4u
#define ERROR_LIMIT   64u
#define REPEATS_LIMIT 3u

/* Time and cycles are compared within a quarter, over WINDOW_US, but at least 16 and at most 64 cycles. */
#define WINDOW_US         64000u
#define WINDOW_MIN_CYCLES 16u
#define WINDOW_MAX_CYCLES 64u

void note_fault(guard_t *self, guard_reason_t reason, uint32_t joint) {
    const guard_reason_t before = (guard_reason_t)self->inputs.fault;
    if (reason_worse(before, reason) != before) {
        self->inputs.fault = (uint32_t)reason;
        self->inputs.fault_joint = (uint8_t)joint;
    }
}

static void fault(guard_t *self, guard_reason_t reason, uint32_t joint) {
    count(&self->counters.range_errors, 1u);
    note_fault(self, reason, joint);
}

static void good(guard_input_t *input, uint64_t now_us) {
    *input = (guard_input_t){.good_us = now_us, .seen = true};
}

static bool within(int32_t raw, int32_t min, int32_t max) {
    /* Uncovered in both: 1 branch, 1 condition. Every range that the DBC gives today ends at the largest raw value. */
    return (raw >= min) && (raw <= max);
}

/* Guard time and cycles must agree within a quarter. There is no permission before one whole window has shown it. */
static void compare_clocks(guard_t *self, uint32_t advance, uint64_t now_us) {
    guard_inputs_t *const inputs = &self->inputs;
    if (!inputs->window_started) {
        inputs->window_started = true;
        inputs->window_start_us = now_us;
        inputs->window_cycles = 0;
        return;
    }
    inputs->window_cycles += advance;
    const uint64_t nominal_us = (uint64_t)inputs->window_cycles * self->config->period_us;
    if ((inputs->window_cycles < WINDOW_MIN_CYCLES) ||
        ((inputs->window_cycles < WINDOW_MAX_CYCLES) && (nominal_us < WINDOW_US))) {
        return;
    }
    const uint64_t elapsed_us = now_us - inputs->window_start_us;
    inputs->clocks_agree = false;
    if (elapsed_us == 0u) {
        note_fault(self, GUARD_REASON_CLOCK_STOPPED, 0u);
    } else if (((4u * elapsed_us) < (3u * nominal_us)) || ((4u * elapsed_us) > (5u * nominal_us))) {
        note_fault(self, GUARD_REASON_CLOCK_RATE, 0u);
    } else {
        inputs->clocks_agree = true;
    }
    inputs->window_start_us = now_us;
    inputs->window_cycles = 0;
}

static void receive_sync(guard_t *self, const can_frame_t *frame, uint64_t now_us) {
    struct tauperp_sync_t message;
    tauperp_sync_unpack(&message, frame->data);
    if ((message.cycle & E2E_COUNTER_MASK) != message.counter) {
        fault(self, GUARD_REASON_INPUT_RANGE, 0);
        return;
    }
    const bool first = !self->inputs.sync.seen;
    const uint16_t advance = (uint16_t)(message.cycle - self->inputs.snapshot.cycle);
    const uint16_t beyond_one = (uint16_t)(advance - 1u); /* wraps where the number did not advance */
    const bool jumped = !first && (beyond_one >= protocol_receive[PROTOCOL_RECEIVE_SYNC].max_delta);
    if (jumped) {
        /* All 16 bits must advance as the counter does. A robot with a new cycle number is accepted again at once, but
         * everything evaluated before is invalid. */
        count(&self->counters.sequence_errors, 1u);
        note_fault(self, GUARD_REASON_CYCLE_JUMP, 0u);
        self->inputs.window_started = false;
        self->inputs.clocks_agree = false;
        snapshot_restart(&self->inputs.snapshot);
    } else {
        compare_clocks(self, advance, now_us);
    }
    snapshot_begin(&self->inputs.snapshot, message.cycle);
    good(&self->inputs.sync, now_us);
}

static uint32_t joint_of(uint32_t slot) {
    return (protocol_receive[slot].kind == (uint8_t)PROTOCOL_KIND_JOINT_STATE) ? (protocol_receive[slot].joint + 1u)
                                                                               : 0u;
}

static void add_errors(guard_t *self, uint32_t slot, uint32_t weight) {
    uint8_t *const errors = &self->inputs.errors[slot];
    const uint32_t sum = *errors + weight;
    *errors = (uint8_t)((sum < ERROR_LIMIT) ? sum : ERROR_LIMIT);
    if (*errors >= ERROR_LIMIT) {
        note_fault(self, GUARD_REASON_ERROR_RATE, joint_of(slot));
    }
}

/* Valid, but of another cycle. */
static void late(guard_t *self, uint32_t slot) {
    count(&self->counters.late_frames, 1u);
    add_errors(self, slot, LOSS_STEP);
}

static void receive_joint(guard_t *self, const can_frame_t *frame, uint32_t slot, uint64_t now_us) {
    const uint32_t joint = protocol_receive[slot].joint;
    const robot_joint_t *const limits = &self->config->robot.joint[joint];
    struct tauperp_joint_state_t message;
    tauperp_joint_state_unpack(&message, frame->data);
    if (message.sensor_status != TAUPERP_JOINT_STATE_SENSOR_STATUS_OK_CHOICE) {
        fault(self, GUARD_REASON_SENSOR_STATUS, joint + 1u);
        return;
    }
    if (message.cycle_high != (uint8_t)((self->inputs.snapshot.cycle >> 4) & 3u)) {
        late(self, slot); /* of a cycle 16, 32 or 48 before, which the counter cannot distinguish */
        return;
    }
    const num_t position = scale_to_num(message.position, PROTOCOL_JOINT_STATE_POSITION_SCALE);
    const num_t velocity = scale_to_num(message.velocity, PROTOCOL_JOINT_STATE_VELOCITY_SCALE);
    const num_t torque = scale_to_num(message.torque, PROTOCOL_JOINT_STATE_TORQUE_SCALE);
    const bool on_wire =
        within(message.position, PROTOCOL_JOINT_STATE_POSITION_RAW_MIN, PROTOCOL_JOINT_STATE_POSITION_RAW_MAX) &&
        within(message.velocity, PROTOCOL_JOINT_STATE_VELOCITY_RAW_MIN, PROTOCOL_JOINT_STATE_VELOCITY_RAW_MAX) &&
        within(message.torque, PROTOCOL_JOINT_STATE_TORQUE_RAW_MIN, PROTOCOL_JOINT_STATE_TORQUE_RAW_MAX);
    const bool on_robot =
        (position >= limits->position_min_rad) && (position <= limits->position_max_rad) &&
        (num_abs(velocity) <= limits->velocity_max_rad_s) &&
        (num_abs(torque) < limits->torque_max_nm); /* at its limit a sensor's reading is meaningless */
    if (!(on_wire && on_robot)) {
        fault(self, GUARD_REASON_INPUT_RANGE, joint + 1u);
        return;
    }
    const snapshot_status_t status =
        snapshot_add(&self->inputs.snapshot, joint, message.counter, position, velocity, torque);
    if (status == SNAPSHOT_COMPLETED) {
        self->inputs.completed_us = now_us; /* good when a tick has evaluated it */
    } else if (status != SNAPSHOT_TAKEN) {
        late(self, slot);
    } else {
        /* others are still missing */
    }
}

static bool task_configured(const guard_config_t *config, uint32_t task) {
    return (task < (uint32_t)TASK_COUNT) && (config->task[task].index.kind != (uint32_t)INDEX_OFF);
}

static void receive_task(guard_t *self, const can_frame_t *frame, uint32_t slot, uint64_t now_us) {
    struct tauperp_task_command_t message;
    tauperp_task_command_unpack(&message, frame->data);
    /* Its counter is the cycle's. A command of another cycle is stale. */
    if (message.counter != (uint8_t)(self->inputs.snapshot.cycle & E2E_COUNTER_MASK)) {
        late(self, slot);
        return;
    }
    if (!task_configured(self->config, message.task)) {
        fault(self, GUARD_REASON_TASK_INVALID, 0);
        return;
    }
    if (!(within(message.accel_x, PROTOCOL_TASK_COMMAND_ACCEL_X_RAW_MIN, PROTOCOL_TASK_COMMAND_ACCEL_X_RAW_MAX) &&
          within(message.accel_y, PROTOCOL_TASK_COMMAND_ACCEL_Y_RAW_MIN, PROTOCOL_TASK_COMMAND_ACCEL_Y_RAW_MAX) &&
          within(message.accel_z, PROTOCOL_TASK_COMMAND_ACCEL_Z_RAW_MIN, PROTOCOL_TASK_COMMAND_ACCEL_Z_RAW_MAX))) {
        fault(self, GUARD_REASON_INPUT_RANGE, 0);
        return;
    }
    self->inputs.task_number = message.task;
    self->inputs.task_number_inverted = ~(uint32_t)message.task;
    self->inputs.acceleration = (vec3_t){.x = scale_to_num(message.accel_x, PROTOCOL_TASK_COMMAND_ACCEL_X_SCALE),
                                         .y = scale_to_num(message.accel_y, PROTOCOL_TASK_COMMAND_ACCEL_Y_SCALE),
                                         .z = scale_to_num(message.accel_z, PROTOCOL_TASK_COMMAND_ACCEL_Z_SCALE)};
    self->inputs.task_cycle = self->inputs.snapshot.cycle;
    good(&self->inputs.task, now_us);
}

static void receive_reset(guard_t *self, const can_frame_t *frame) {
    struct tauperp_guard_reset_t message;
    tauperp_guard_reset_unpack(&message, frame->data);
    const bool request = message.request != 0u;
    if (request && !self->inputs.request) {
        self->inputs.edge = (uint8_t)GUARD_SET;
        self->inputs.requested_trip = message.trip_number;
    }
    self->inputs.request = request;
}

/* Records that a frame under this id was good, bad (E2E_UNCHECKED: its format), late, or repeated. */
static void judge_sender(guard_t *self, uint32_t slot, e2e_status_t status) {
    guard_inputs_t *const inputs = &self->inputs;
    const uint16_t bit = (uint16_t)(1u << slot);
    uint8_t *const errors = &inputs->errors[slot];
    uint8_t *const repeats = &inputs->repeats[slot];
    if ((status == E2E_INITIAL) || e2e_accepts(status)) {
        *errors = (uint8_t)((*errors > 0u) ? (*errors - 1u) : 0u);
        *repeats = ((inputs->repeated & bit) != 0u) ? *repeats : 0u;
        inputs->repeated &= (uint16_t)~bit;
        /* An event has no rate: after a restart of the sender the counter jumps, and nothing is missing. */
        const bool lost = (status == E2E_SOME_LOST) && (protocol_receive[slot].timeout_cycles != 0u);
        add_errors(self, slot, lost ? (inputs->receiver[slot].lost * LOSS_STEP) : 0u);
        return;
    }
    if ((status == E2E_REPEATED) && ((inputs->repeated & bit) == 0u)) {
        inputs->repeated |= bit;
        *repeats = (uint8_t)((*repeats < REPEATS_LIMIT) ? (*repeats + 1u) : *repeats);
    }
    if (*repeats >= REPEATS_LIMIT) {
        note_fault(self, GUARD_REASON_ANOTHER_SENDER, joint_of(slot));
    } else {
        add_errors(self, slot, ERROR_STEP); /* single frames may be lost */
    }
}

/* True if the frame may update signals. Every other frame is counted. */
static bool accept(guard_t *self, const can_frame_t *frame, uint32_t slot) {
    const protocol_receive_t *const entry = &protocol_receive[slot];
    const uint8_t format = (self->config->format == (uint32_t)FORMAT_FD) ? (uint8_t)CAN_FRAME_FD : 0u;
    const uint8_t flags = (uint8_t)(frame->flags & (uint8_t)~CAN_FRAME_BRS);
    const bool of_robot = entry->joint < self->joints; /* 0 for a frame that is not of a joint */
    if ((frame->length != entry->length) || (flags != format) || !of_robot) {
        count(&self->counters.format_errors, 1u);
        if (of_robot) {
            judge_sender(self, slot, E2E_UNCHECKED);
        }
        return false;
    }
    e2e_receiver_t *const receiver = &self->inputs.receiver[slot];
    const e2e_status_t status = e2e_check(receiver, frame->data, frame->length, entry->data_ids, entry->max_delta);
    if (status == E2E_WRONG_CRC) {
        count(&self->counters.crc_errors, 1u);
    } else if ((status == E2E_REPEATED) || (status == E2E_WRONG_SEQUENCE)) {
        count(&self->counters.sequence_errors, 1u);
    } else if (status == E2E_SOME_LOST) {
        count(&self->counters.lost_frames, receiver->lost);
    } else {
        /* good, or the first one */
    }
    judge_sender(self, slot, status);
    return e2e_accepts(status);
}

/* Whatever it contains: the guard does not receive its own frames. */
static bool is_stop_command(const can_frame_t *frame) {
    return (frame->id == protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND].id) &&
           ((frame->flags & (uint8_t)CAN_FRAME_EXTENDED) == 0u);
}

void guard_receive(guard_t *self, const can_frame_t *frame, uint64_t now_us) {
    if (self->config == NULL) {
        return;
    }
    const uint32_t slot = protocol_slot(frame->id);
    if (slot >= (uint32_t)PROTOCOL_RECEIVE_COUNT) {
        if (is_stop_command(frame)) {
            note_fault(self, GUARD_REASON_ANOTHER_GUARD, 0u);
        }
        count(&self->counters.format_errors, 1u);
        return;
    }
    if (!accept(self, frame, slot)) {
        return;
    }
    switch ((protocol_kind_t)protocol_receive[slot].kind) {
    case PROTOCOL_KIND_SYNC:
        receive_sync(self, frame, now_us);
        break;
    case PROTOCOL_KIND_JOINT_STATE:
        receive_joint(self, frame, slot, now_us);
        break;
    case PROTOCOL_KIND_TASK_COMMAND:
        receive_task(self, frame, slot, now_us);
        break;
    case PROTOCOL_KIND_GUARD_RESET:
        receive_reset(self, frame);
        break;
    /* Uncovered in both, 2 lines: 2 regions, 2 branches. No row of the generated table has another kind. */
    case PROTOCOL_KIND_NONE:
    default:
        break;
    }
}

bool guard_cycle_complete(const guard_t *self) {
    return snapshot_is_complete(&self->inputs.snapshot); /* never without a configuration, since nothing is received */
}
