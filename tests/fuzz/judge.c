#include "judge.h"

#include <stddef.h>
#include <string.h>

#include "fuzz.h"

#define MOVE 0xE1u /* of StopCommand's byte 2: Permission 1 and its inverted copy 14 */

static const protocol_receive_t *entry_of(const can_frame_t *frame) {
    for (uint32_t slot = 0; slot < (uint32_t)PROTOCOL_RECEIVE_COUNT; ++slot) {
        if (protocol_receive[slot].id == frame->id) {
            return &protocol_receive[slot];
        }
    }
    return NULL;
}

static bool is_well_formed(const can_frame_t *frame, const protocol_receive_t *entry, const guard_config_t *config) {
    const uint32_t flags = frame->flags & ~(uint32_t)CAN_FRAME_BRS;
    const uint32_t wanted = (config->format == (uint32_t)FORMAT_FD) ? (uint32_t)CAN_FRAME_FD : 0u;
    const bool of_robot =
        (entry->kind != (uint8_t)PROTOCOL_KIND_JOINT_STATE) || (entry->joint < config->robot.joint_count);
    return of_robot && (frame->length == entry->length) && (flags == wanted) &&
           crc_is_good(frame->data, frame->length, entry->data_ids);
}

/* Everything in the inputs but the error counts and the fault that the next tick acts on. */
static bool same_signals(guard_inputs_t one, guard_inputs_t other) {
    guard_inputs_t *const both[] = {&one, &other};
    for (uint32_t i = 0; i < 2u; ++i) {
        memset(both[i]->errors, 0, sizeof both[i]->errors);
        memset(both[i]->repeats, 0, sizeof both[i]->repeats);
        both[i]->repeated = 0u;
        both[i]->fault = 0u;
        both[i]->fault_joint = 0u;
    }
    return memcmp(&one, &other, sizeof one) == 0;
}

/* A reception changes the inputs and the counters, and nothing else. */
static bool same_rest(const guard_t *one, const guard_t *other) {
    const uint8_t *const a = (const uint8_t *)one;
    const uint8_t *const b = (const uint8_t *)other;
    const size_t inputs = offsetof(guard_t, inputs);
    const size_t behind = inputs + sizeof one->inputs;
    const size_t counters = offsetof(guard_t, counters);
    const size_t rest = counters + sizeof one->counters;
    return (memcmp(a, b, inputs) == 0) && (memcmp(a + behind, b + behind, counters - behind) == 0) &&
           (memcmp(a + rest, b + rest, sizeof *one - rest) == 0);
}

static void note_reception(judge_t *judge, const can_frame_t *frame, const protocol_receive_t *entry, uint64_t now_us) {
    if (entry->kind == (uint8_t)PROTOCOL_KIND_SYNC) {
        judge->sync = true;
        judge->sync_us = now_us;
    } else if (entry->kind == (uint8_t)PROTOCOL_KIND_TASK_COMMAND) {
        judge->task = true;
        judge->task_us = now_us;
    } else if ((entry->kind == (uint8_t)PROTOCOL_KIND_GUARD_RESET) && ((frame->data[1] & 0x10u) != 0u)) {
        judge->reset_ever = true;
        judge->reset_named[frame->data[2]] = true;
    } else {
        /* a joint: recorded by the tick that evaluates it */
    }
}

void judge_reception(judge_t *judge, const guard_t *before, const guard_t *after, const can_frame_t *frame,
                     uint64_t now_us) {
    REQUIRE(same_rest(before, after));
    const protocol_receive_t *const entry = entry_of(frame);
    if ((entry != NULL) && is_well_formed(frame, entry, after->config)) {
        note_reception(judge, frame, entry, now_us);
    } else {
        REQUIRE(same_signals(before->inputs, after->inputs));
    }
}

static bool is_recent(bool seen, uint64_t then_us, uint32_t deadline_us, uint64_t now_us) {
    return seen && (then_us <= now_us) && ((now_us - then_us) <= deadline_us);
}

static void judge_frames(const guard_output_t *out) {
    REQUIRE((out->frame_count >= 1u) && (out->frame_count <= GUARD_MAX_FRAMES));
    REQUIRE(out->frame[0].id == protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND].id);
    for (uint32_t i = 0; i < out->frame_count; ++i) {
        const can_frame_t *const frame = &out->frame[i];
        bool known = false;
        for (uint32_t slot = 0; slot < (uint32_t)PROTOCOL_TRANSMIT_COUNT; ++slot) {
            const protocol_transmit_t *const entry = &protocol_transmit[slot];
            known = known || ((entry->id == frame->id) && (entry->length == frame->length) &&
                              crc_is_good(frame->data, frame->length, entry->data_ids));
        }
        REQUIRE(known);
    }
}

static void judge_permission(const judge_t *judge, const guard_config_t *config, const guard_output_t *out,
                             uint64_t now_us) {
    const bool moves = out->frame[0].data[2] == MOVE;
    REQUIRE(moves == (out->permitted && !out->withheld));
    REQUIRE(out->permitted == (out->state == GUARD_STATE_MONITORING));
    if (!out->permitted) {
        return;
    }
    REQUIRE(!out->withheld); /* the two opinions never differ without a fault in memory */
    REQUIRE(out->reason == GUARD_REASON_NONE);
    REQUIRE(judge->reset_ever);
    REQUIRE(is_recent(judge->sync, judge->sync_us, config->sync_deadline_us, now_us)); /* silence means stop */
    REQUIRE(is_recent(judge->task, judge->task_us, config->task_deadline_us, now_us));
    REQUIRE(is_recent(judge->fresh, judge->fresh_us, config->joint_deadline_us, now_us));
}

static void judge_states(const judge_t *judge, const guard_output_t *out) {
    REQUIRE((out->state >= GUARD_STATE_SELF_TEST) && (out->state <= GUARD_STATE_FAULT));
    if (judge->state == GUARD_STATE_FAULT) {
        REQUIRE(out->state == GUARD_STATE_FAULT);
    }
    if (judge->state == GUARD_STATE_STOPPED) {
        const bool still = (out->state == GUARD_STATE_STOPPED) || (out->state == GUARD_STATE_FAULT);
        REQUIRE(still || judge->reset_named[judge->trip_number]);
    }
    if (judge->state == GUARD_STATE_MONITORING) { /* a permission ends by a trip, and a trip has a new number */
        const bool same = (out->state == GUARD_STATE_MONITORING) && (out->trip_number == judge->trip_number);
        const bool latched = ((out->state == GUARD_STATE_STOPPED) || (out->state == GUARD_STATE_FAULT)) &&
                             (out->trip_number != judge->trip_number);
        REQUIRE(same || latched);
    }
}

static void judge_numbers(const guard_output_t *out) {
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        REQUIRE(num_finite(out->residual[i]) && num_finite(out->index[i]) && num_finite(out->threshold[i]));
    }
}

void judge_tick(judge_t *judge, const guard_config_t *config, const guard_output_t *out, uint64_t now_us) {
    if (out->fresh) {
        judge->fresh = true;
        judge->fresh_us = now_us;
    }
    judge_frames(out);
    judge_permission(judge, config, out, now_us);
    judge_states(judge, out);
    judge_numbers(out);
    judge->state = out->state;
    judge->trip_number = out->trip_number;
    memset(judge->reset_named, 0, sizeof judge->reset_named);
}
