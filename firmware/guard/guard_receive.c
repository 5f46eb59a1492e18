#include "guard_parts.h"
#include "messages.h"
#include "scale.h"

/* Where a frame goes wrong, the tick hears of it: the first fault since the last tick is the one that is reported. */
static void note(guard_t *self, guard_reason_t reason, uint32_t joint) {
    if (self->inputs.fault == 0u) {
        self->inputs.fault = (uint32_t)reason;
        self->inputs.fault_joint = (uint8_t)joint;
    }
}

static void fault(guard_t *self, guard_reason_t reason, uint32_t joint) {
    count(&self->counters.range_errors, 1u);
    note(self, reason, joint);
}

static void good(guard_input_t *input, uint64_t now_us) {
    *input = (guard_input_t){.good_us = now_us, .seen = true};
}

static bool within(int32_t raw, int32_t min, int32_t max) {
    return (raw >= min) && (raw <= max);
}

static void receive_sync(guard_t *self, const can_frame_t *frame, uint64_t now_us) {
    struct tauperp_sync_t message;
    (void)tauperp_sync_unpack(&message, frame->data, frame->length);
    if ((message.cycle & E2E_COUNTER_MASK) != message.counter) {
        fault(self, GUARD_REASON_INPUT_RANGE, 0);
        return;
    }
    snapshot_begin(&self->inputs.snapshot, message.cycle);
    good(&self->inputs.sync, now_us);
}

static void receive_joint(guard_t *self, const can_frame_t *frame, uint32_t joint, uint64_t now_us) {
    const robot_joint_t *const limits = &self->config->robot.joint[joint];
    struct tauperp_joint_state_t message;
    (void)tauperp_joint_state_unpack(&message, frame->data, frame->length);
    if (message.sensor_status != TAUPERP_JOINT_STATE_SENSOR_STATUS_OK_CHOICE) {
        fault(self, GUARD_REASON_SENSOR_STATUS, joint + 1u);
        return;
    }
    const num_t position = scale_to_num(message.position, PROTOCOL_JOINT_STATE_POSITION_SCALE);
    const num_t velocity = scale_to_num(message.velocity, PROTOCOL_JOINT_STATE_VELOCITY_SCALE);
    const num_t torque = scale_to_num(message.torque, PROTOCOL_JOINT_STATE_TORQUE_SCALE);
    const bool on_wire =
        within(message.position, PROTOCOL_JOINT_STATE_POSITION_RAW_MIN, PROTOCOL_JOINT_STATE_POSITION_RAW_MAX) &&
        within(message.velocity, PROTOCOL_JOINT_STATE_VELOCITY_RAW_MIN, PROTOCOL_JOINT_STATE_VELOCITY_RAW_MAX) &&
        within(message.torque, PROTOCOL_JOINT_STATE_TORQUE_RAW_MIN, PROTOCOL_JOINT_STATE_TORQUE_RAW_MAX);
    const bool on_robot = (position >= limits->position_min_rad) && (position <= limits->position_max_rad) &&
                          (num_abs(velocity) <= limits->velocity_max_rad_s) &&
                          (num_abs(torque) <= limits->torque_max_nm);
    if (!(on_wire && on_robot)) {
        fault(self, GUARD_REASON_INPUT_RANGE, joint + 1u);
        return;
    }
    const snapshot_status_t status =
        snapshot_add(&self->inputs.snapshot, joint, message.counter, position, velocity, torque);
    if (status == SNAPSHOT_COMPLETED) {
        good(&self->inputs.joints, now_us);
    } else if (status != SNAPSHOT_TAKEN) {
        count(&self->counters.late_frames, 1u);
    } else {
        /* others are missing still */
    }
}

static bool task_configured(const guard_config_t *config, uint32_t task) {
    return (task < (uint32_t)TASK_COUNT) && (config->task[task].index != (uint32_t)INDEX_OFF);
}

static void receive_task(guard_t *self, const can_frame_t *frame, uint64_t now_us) {
    struct tauperp_task_command_t message;
    (void)tauperp_task_command_unpack(&message, frame->data, frame->length);
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
    self->inputs.acceleration = (vec3_t){.x = scale_to_num(message.accel_x, PROTOCOL_TASK_COMMAND_ACCEL_X_SCALE),
                                         .y = scale_to_num(message.accel_y, PROTOCOL_TASK_COMMAND_ACCEL_Y_SCALE),
                                         .z = scale_to_num(message.accel_z, PROTOCOL_TASK_COMMAND_ACCEL_Z_SCALE)};
    good(&self->inputs.task, now_us);
}

static void receive_reset(guard_t *self, const can_frame_t *frame) {
    struct tauperp_guard_reset_t message;
    (void)tauperp_guard_reset_unpack(&message, frame->data, frame->length);
    const bool request = message.request != 0u;
    if (request && !self->inputs.request) {
        self->inputs.edge = true;
        self->inputs.requested_trip = message.trip_number;
    }
    self->inputs.request = request;
}

/* True if the frame may update signals; everything else is counted. */
static bool accept(guard_t *self, const can_frame_t *frame, uint32_t slot) {
    const protocol_receive_t *const entry = &protocol_receive[slot];
    const uint8_t format = (self->config->format == (uint32_t)FORMAT_FD) ? (uint8_t)CAN_FRAME_FD : 0u;
    const uint8_t flags = (uint8_t)(frame->flags & (uint8_t)~CAN_FRAME_BRS);
    const bool of_robot = (entry->kind != (uint8_t)PROTOCOL_KIND_JOINT_STATE) || (entry->joint < self->joints);
    if ((frame->length != entry->length) || (flags != format) || !of_robot) {
        count(&self->counters.format_errors, 1u);
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
    return e2e_accepts(status);
}

/* Whatever is in it: this guard's own do not come back to it. */
static bool is_stop_command(const can_frame_t *frame) {
    return (frame->id == protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND].id) &&
           ((frame->flags & (uint8_t)CAN_FRAME_EXTENDED) == 0u);
}

void guard_receive(guard_t *self, const can_frame_t *frame, uint64_t now_us) {
    if (self->config == 0) {
        return;
    }
    const uint32_t slot = protocol_slot(frame->id);
    if (slot >= (uint32_t)PROTOCOL_RECEIVE_COUNT) {
        if (is_stop_command(frame)) {
            note(self, GUARD_REASON_ANOTHER_GUARD, 0u);
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
        receive_joint(self, frame, protocol_receive[slot].joint, now_us);
        break;
    case PROTOCOL_KIND_TASK_COMMAND:
        receive_task(self, frame, now_us);
        break;
    case PROTOCOL_KIND_GUARD_RESET:
        receive_reset(self, frame);
        break;
    case PROTOCOL_KIND_NONE:
    default:
        break;
    }
}

bool guard_cycle_complete(const guard_t *self) {
    return (self->config != 0) && snapshot_is_complete(&self->inputs.snapshot);
}
