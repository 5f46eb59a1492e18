#include "guard_parts.h"

bool reason_is_fault(guard_reason_t reason) {
    return ((reason >= GUARD_REASON_TICK_LATE) && (reason <= GUARD_REASON_STAGE_MISSED)) ||
           (reason == GUARD_REASON_TIME_BACKWARDS);
}

/* The one number that bounds loops, in the block, here and in the snapshot: looked at before any of them runs. */
static bool joint_count_holds(const guard_t *self) {
    return (self->joints <= ROBOT_MAX_JOINTS) && (self->joints == self->config->robot.joint_count) &&
           (((1u << self->joints) - 1u) == self->inputs.snapshot.expected);
}

static bool state_holds(const guard_t *self) {
    bool holds = (self->state == ~self->state_inverted) && (self->state >= (uint32_t)GUARD_STATE_SELF_TEST) &&
                 (self->state <= (uint32_t)GUARD_STATE_FAULT) && snapshot_holds(&self->inputs.snapshot) &&
                 e2e_transmitter_holds(&self->report.stop) && e2e_transmitter_holds(&self->report.status) &&
                 e2e_transmitter_holds(&self->report.index) && (self->inputs.task_number < (uint8_t)TASK_COUNT);
    for (uint32_t slot = 0; slot < (uint32_t)PROTOCOL_RECEIVE_COUNT; ++slot) {
        holds = holds && e2e_receiver_holds(&self->inputs.receiver[slot]);
    }
    return holds;
}

static bool from_the_future(const guard_input_t *input, uint64_t now_us) {
    return input->seen && (input->good_us > now_us);
}

static bool time_holds(const guard_t *self, uint64_t now_us) {
    const guard_inputs_t *const inputs = &self->inputs;
    return !(from_the_future(&inputs->sync, now_us) || from_the_future(&inputs->joints, now_us) ||
             from_the_future(&inputs->task, now_us) || (self->ticked && (now_us < self->last_tick_us)));
}

guard_reason_t supervise(guard_t *self, uint64_t now_us) {
    guard_reason_t reason = GUARD_REASON_NONE;
    if (!state_holds(self)) {
        reason = GUARD_REASON_STATE_CORRUPT;
    } else if (!joint_count_holds(self) || !config_watch_step(&self->watch, self->config)) {
        reason = GUARD_REASON_CONFIG_CORRUPT;
    } else if (!time_holds(self, now_us)) {
        reason = GUARD_REASON_TIME_BACKWARDS;
    } else if (self->ticked && ((now_us - self->last_tick_us) > self->config->tick_deadline_us)) {
        reason = GUARD_REASON_TICK_LATE;
    } else if (self->over_budget) {
        reason = GUARD_REASON_TICK_OVER_BUDGET;
    } else if (reason_is_fault((guard_reason_t)self->inputs.fault)) {
        reason = (guard_reason_t)self->inputs.fault;
    } else {
        /* everything holds */
    }
    self->ticked = true;
    self->last_tick_us = now_us;
    return reason;
}
