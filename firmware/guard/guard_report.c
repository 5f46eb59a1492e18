#include "guard_parts.h"

#include <stddef.h>

#include "messages.h"
#include "scale.h"
#include "vec3.h"
#include "version.h"

static uint16_t held16(uint32_t value) {
    return (value > UINT16_MAX) ? (uint16_t)UINT16_MAX : (uint16_t)value;
}

/* Telemetry saturates at the ends of its range. The values that the guard decides on are never rounded. */
static int16_t torque_raw(num_t value) {
    return (int16_t)scale_to_raw(value, PROTOCOL_GUARD_INDEX_INDEX_SCALE, PROTOCOL_GUARD_INDEX_INDEX_RAW_MIN,
                                 PROTOCOL_GUARD_INDEX_INDEX_RAW_MAX);
}

static can_frame_t *next_frame(const guard_t *guard, guard_output_t *out, uint32_t slot) {
    can_frame_t *const frame = &out->frame[out->frame_count];
    ++out->frame_count;
    *frame = (can_frame_t){.id = protocol_transmit[slot].id, .length = protocol_transmit[slot].length};
    if ((guard->config != NULL) && (guard->config->format == (uint32_t)FORMAT_FD)) {
        frame->flags = (uint8_t)(CAN_FRAME_FD | CAN_FRAME_BRS);
    }
    return frame;
}

static void seal(e2e_transmitter_t *transmitter, can_frame_t *frame, uint32_t slot) {
    e2e_protect(transmitter, frame->data, frame->length, protocol_transmit[slot].data_ids);
}

static void stop_command(guard_t *guard, guard_output_t *out) {
    can_frame_t *const frame = next_frame(guard, out, PROTOCOL_TRANSMIT_STOP_COMMAND);
    struct tauperp_stop_command_t message = {0};
    /* With a second channel, which overwrites the copy, both opinions of this one must permit. */
    const bool permitted = out->permitted && (guard_is_alone(guard) || !out->withheld);
    const uint8_t permission =
        permitted ? TAUPERP_STOP_COMMAND_PERMISSION_MOVE_CHOICE : TAUPERP_STOP_COMMAND_PERMISSION_STOP_CHOICE;
    message.permission = permission;
    /* From the second computation. If the two differ, the pair permits nothing. */
    message.permission_inverted = out->withheld ? TAUPERP_STOP_COMMAND_PERMISSION_INVERTED_STOP_CHOICE
                                                : TAUPERP_STOP_COMMAND_PERMISSION_INVERTED_MOVE_CHOICE;
    message.stop_category = out->stop_category;
    message.channel = out->value_channel;
    message.full_speed = out->full_speed ? 1u : 0u;
    message.cycle = (uint8_t)(out->cycle & 0x0Fu);
    message.reason = (uint8_t)out->reason;
    message.joint = out->joint;
    message.trip_number = out->trip_number;
    message.index_value = torque_raw(out->value_nm);
    tauperp_stop_command_pack(frame->data, &message);
    seal(&guard->report.stop, frame, PROTOCOL_TRANSMIT_STOP_COMMAND);
}

static uint16_t singular_raw(num_t value) {
    return (uint16_t)scale_to_raw(value, PROTOCOL_GUARD_STATUS_SMALLEST_SINGULAR_SCALE,
                                  PROTOCOL_GUARD_STATUS_SMALLEST_SINGULAR_RAW_MIN,
                                  PROTOCOL_GUARD_STATUS_SMALLEST_SINGULAR_RAW_MAX);
}

static void fill_trip(const guard_trip_t *trip, struct tauperp_guard_status_t *message) {
    message->trip_channel = trip->channel;
    message->trip_joint = trip->joint;
    message->trip_reason = (uint8_t)trip->reason;
    message->trip_value = torque_raw(trip->value_nm);
    message->trip_threshold = (uint16_t)scale_to_raw(trip->threshold_nm, PROTOCOL_GUARD_STATUS_TRIP_THRESHOLD_SCALE,
                                                     PROTOCOL_GUARD_STATUS_TRIP_THRESHOLD_RAW_MIN,
                                                     PROTOCOL_GUARD_STATUS_TRIP_THRESHOLD_RAW_MAX);
}

static int8_t direction_raw(num_t value) {
    return (int8_t)scale_to_raw(value, PROTOCOL_GUARD_STATUS_CONTACT_X_SCALE, PROTOCOL_GUARD_STATUS_CONTACT_X_RAW_MIN,
                                PROTOCOL_GUARD_STATUS_CONTACT_X_RAW_MAX);
}

/* Size and direction of the force. */
static void fill_contact(const guard_output_t *out, struct tauperp_guard_status_t *message) {
    const num_t size = vec3_length(out->contact_force);
    const vec3_t direction = vec3_unit(out->contact_force, &(uint32_t){0});
    message->contact_link = out->contact_link;
    message->contact_class = out->contact_class;
    message->contact_force = (uint16_t)scale_to_raw(size, PROTOCOL_GUARD_STATUS_CONTACT_FORCE_SCALE,
                                                    PROTOCOL_GUARD_STATUS_CONTACT_FORCE_RAW_MIN,
                                                    PROTOCOL_GUARD_STATUS_CONTACT_FORCE_RAW_MAX);
    message->contact_x = direction_raw(direction.x);
    message->contact_y = direction_raw(direction.y);
    message->contact_z = direction_raw(direction.z);
}

/* What takes a conversion, for the page that has it. */
static void fill_converted(const guard_t *guard, const guard_output_t *out, struct tauperp_guard_status_t *message) {
    if (message->page == (uint8_t)PAGE_STATE) {
        message->smallest_singular = singular_raw(out->smallest_singular);
    } else if (message->page == (uint8_t)PAGE_TRIP) {
        fill_trip(&guard->trip, message);
    } else if (message->page == (uint8_t)PAGE_CONTACT) {
        fill_contact(out, message);
    } else {
        /* copies only */
    }
}

/* Fields of other pages are not packed: the generated code writes those of `page` only. */
static void fill_page(guard_t *guard, const guard_output_t *out, struct tauperp_guard_status_t *message) {
    const guard_counters_t *const counters = &guard->counters;
    message->state = (uint8_t)out->state;
    message->task = out->task;
    message->reason = (uint8_t)out->reason;
    message->tick_time = held16(guard->report.tick_time_us);
    message->crc_errors = counters->crc_errors;
    message->sequence_errors = counters->sequence_errors;
    message->lost_frames = counters->lost_frames;
    message->range_errors = counters->range_errors;
    message->format_errors = counters->format_errors;
    message->late_frames = counters->late_frames;
    message->resets_refused = counters->resets_refused;
    message->trip_count = counters->trips;
    message->saturations = held16(guard->saturations);
    message->firmware_version = (uint16_t)(((uint32_t)TAUPERP_VERSION_MAJOR << 8) | (uint32_t)TAUPERP_VERSION_MINOR);
    message->wire_version = PROTOCOL_WIRE_VERSION;
    message->numeric = (uint8_t)NUM_NUMERIC;
    message->worst_tick_time = held16(guard->report.worst_tick_time_us);
    message->deadline_margin = held16(guard->report.margin_us);
    message->config_schema = (uint8_t)CONFIG_SCHEMA;
    message->start_cause = guard->start_cause;
    message->restarts = guard->restarts;
    message->variant = guard->variant;
    message->channels = guard_is_alone(guard) ? 1u : 2u;
    fill_converted(guard, out, message);
    message->blind_links = out->blind_links;
    message->needed_links = out->needed_links;
    message->build_id = (uint16_t)(TAUPERP_BUILD_ID >> 16);
    if (guard->config != NULL) {
        message->config_crc = guard->config->crc;
        message->robot_joints = (uint8_t)guard->joints;
        message->format = (uint8_t)guard->config->format;
    }
    if (message->page == (uint8_t)PAGE_TIMING) {
        guard->report.margin_us = UINT32_MAX;
    }
}

static void status(guard_t *guard, guard_output_t *out, uint32_t page) {
    can_frame_t *const frame = next_frame(guard, out, PROTOCOL_TRANSMIT_GUARD_STATUS);
    struct tauperp_guard_status_t message = {0};
    message.page = (uint8_t)page;
    fill_page(guard, out, &message);
    tauperp_guard_status_pack(frame->data, &message);
    seal(&guard->report.status, frame, PROTOCOL_TRANSMIT_GUARD_STATUS);
}

static void joint_index(guard_t *guard, guard_output_t *out, uint32_t joint) {
    can_frame_t *const frame = next_frame(guard, out, PROTOCOL_TRANSMIT_GUARD_INDEX);
    struct tauperp_guard_index_t message = {0};
    message.joint = (uint8_t)joint;
    message.residual = torque_raw(out->residual[joint]);
    message.index = torque_raw(out->index[joint]);
    message.channel = out->index_channel[joint];
    message.threshold =
        (uint16_t)scale_to_raw(out->threshold[joint], PROTOCOL_GUARD_INDEX_THRESHOLD_SCALE,
                               PROTOCOL_GUARD_INDEX_THRESHOLD_RAW_MIN, PROTOCOL_GUARD_INDEX_THRESHOLD_RAW_MAX);
    tauperp_guard_index_pack(frame->data, &message);
    seal(&guard->report.index, frame, PROTOCOL_TRANSMIT_GUARD_INDEX);
}

void report_init(guard_report_t *self) {
    *self = (guard_report_t){.margin_us = UINT32_MAX};
}

/* StopCommand in every tick, then alternately a page of GuardStatus and a joint of GuardIndex. */
void report_tick(guard_t *guard, guard_output_t *out) {
    guard_report_t *const self = &guard->report;
    out->frame_count = 0;
    stop_command(guard, out);
    const uint32_t joints = (guard->joints < ROBOT_MAX_JOINTS) ? guard->joints : ROBOT_MAX_JOINTS;
    if ((joints == 0u) || ((self->round_robin % 2u) == 0u)) {
        status(guard, out, (self->round_robin / 2u) % (uint32_t)PAGE_COUNT);
    } else {
        joint_index(guard, out, (self->round_robin / 2u) % joints);
    }
    /* common multiple of twice the pages and twice any number of joints, so that no sequence is cut short */
    self->round_robin = (self->round_robin + 1u) % (2u * (uint32_t)PAGE_COUNT * 840u);
}
