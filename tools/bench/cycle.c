#include "cycle.h"

#include "protocol.h"
#include "scale.h"

enum { SENSOR_OK = 0 };

static void put(uint8_t *at, num_t value, scale_t scale) {
    const uint32_t raw = (uint32_t)scale_to_raw(value, scale, -32767, 32767);
    at[0] = (uint8_t)(raw & 0xFFu);
    at[1] = (uint8_t)((raw >> 8) & 0xFFu);
}

static can_frame_t *next(cycle_frames_t *self, const guard_config_t *config, uint32_t slot, uint32_t nibble) {
    can_frame_t *const frame = &self->frame[self->count];
    ++self->count;
    *frame = (can_frame_t){.id = protocol_receive[slot].id, .length = protocol_receive[slot].length};
    frame->flags = (config->format == (uint32_t)FORMAT_FD) ? (uint8_t)(CAN_FRAME_FD | CAN_FRAME_BRS) : 0u;
    frame->data[1] = (uint8_t)(nibble << 4);
    return frame;
}

static void seal(can_frame_t *frame, uint32_t slot, uint16_t cycle) {
    e2e_seal(frame->data, frame->length, protocol_receive[slot].data_ids, (uint8_t)(cycle & 0x0Fu));
}

void cycle_encode(cycle_frames_t *self, const guard_config_t *config, const bench_state_t *state, uint32_t task,
                  uint16_t cycle) {
    self->count = 0;
    can_frame_t *frame = next(self, config, PROTOCOL_RECEIVE_SYNC, 0u);
    frame->data[2] = (uint8_t)(cycle & 0xFFu);
    frame->data[3] = (uint8_t)(cycle >> 8);
    seal(frame, PROTOCOL_RECEIVE_SYNC, cycle);

    frame = next(self, config, PROTOCOL_RECEIVE_TASK_COMMAND, task);
    put(&frame->data[2], state->acceleration.x, PROTOCOL_TASK_COMMAND_ACCEL_X_SCALE);
    put(&frame->data[4], state->acceleration.y, PROTOCOL_TASK_COMMAND_ACCEL_Y_SCALE);
    put(&frame->data[6], state->acceleration.z, PROTOCOL_TASK_COMMAND_ACCEL_Z_SCALE);
    seal(frame, PROTOCOL_RECEIVE_TASK_COMMAND, cycle);

    for (uint32_t i = 0; i < config->robot.joint_count; ++i) {
        const uint32_t slot = PROTOCOL_RECEIVE_JOINT_STATE + i;
        frame = next(self, config, slot, SENSOR_OK | ((((uint32_t)cycle >> 4) & 3u) << 2));
        put(&frame->data[2], state->position[i], PROTOCOL_JOINT_STATE_POSITION_SCALE);
        put(&frame->data[4], state->velocity[i], PROTOCOL_JOINT_STATE_VELOCITY_SCALE);
        put(&frame->data[6], state->torque[i], PROTOCOL_JOINT_STATE_TORQUE_SCALE);
        seal(frame, slot, cycle);
    }
}
