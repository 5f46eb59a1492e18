#include "guard_parts.h"
#include "guard_reason.h"

#define STANDING_TICKS 4u /* consecutive ticks at the same time: the clock stands still */

/* The number that bounds loops, in the block, here and in the snapshot. It is checked before any loop runs. */
static bool joint_count_is_valid(const guard_t *self) {
    return (self->joints <= ROBOT_MAX_JOINTS) && (self->joints == self->config->robot.joint_count) &&
           ((((uint32_t)1 << self->joints) - 1u) == self->inputs.snapshot.expected);
}

/* Each word that alone decides on a permission or on the task in force differs from its copy in every bit. */
static bool copies_agree(const guard_t *self) {
    const uint32_t different = (self->state ^ self->state_inverted) & (self->task ^ self->task_inverted) &
                               (self->inputs.task_number ^ self->inputs.task_number_inverted);
    return (different == UINT32_MAX) &&
           ((self->acknowledged == (uint8_t)GUARD_SET) || (self->acknowledged == (uint8_t)GUARD_CLEAR));
}

static bool state_is_valid(const guard_t *self) {
    bool valid = copies_agree(self) && (self->state >= (uint32_t)GUARD_STATE_SELF_TEST) &&
                 (self->state <= (uint32_t)GUARD_STATE_FAULT) && snapshot_is_valid(&self->inputs.snapshot) &&
                 e2e_transmitter_is_valid(&self->report.stop) && e2e_transmitter_is_valid(&self->report.status) &&
                 e2e_transmitter_is_valid(&self->report.index) && (self->inputs.task_number < (uint8_t)TASK_COUNT) &&
                 (self->task < (uint32_t)TASK_COUNT);
    for (uint32_t slot = 0; slot < (uint32_t)PROTOCOL_RECEIVE_COUNT; ++slot) {
        valid = valid && e2e_receiver_is_valid(&self->inputs.receiver[slot]);
    }
    return valid;
}

/* No tick uses a part of the block that it has not checked. A requested task may become active in this tick. Otherwise
 * the rows of the tasks that are not active follow each other, one per cycle. */
static bool config_is_intact(const guard_t *self) {
    const uint32_t requested = self->inputs.task_number;
    const uint32_t next = (uint32_t)self->inputs.snapshot.cycle % TASK_COUNT;
    return config_watch_step(&self->watch, self->config, self->task, (requested != self->task) ? requested : next);
}

/* All times are 0 before the first input and the first tick. */
static bool time_is_valid(const guard_t *self, uint64_t now_us) {
    const guard_inputs_t *const inputs = &self->inputs;
    return (inputs->sync.good_us <= now_us) && (inputs->joints.good_us <= now_us) && (inputs->task.good_us <= now_us) &&
           (self->last_tick_us <= now_us);
}

/* A tick comes once per cycle, so time must have advanced since the last tick. */
static bool clock_runs(guard_t *self, uint64_t now_us) {
    if (!self->ticked || (now_us != self->last_tick_us)) {
        self->standing_ticks = 0;
    } else if (self->standing_ticks < STANDING_TICKS) {
        ++self->standing_ticks;
    } else {
        /* held */
    }
    return self->standing_ticks < STANDING_TICKS;
}

guard_reason_t supervise(guard_t *self, uint64_t now_us) {
    guard_reason_t reason = GUARD_REASON_NONE;
    if (!state_is_valid(self)) {
        reason = GUARD_REASON_STATE_CORRUPT;
    } else if (!joint_count_is_valid(self) || !config_is_intact(self)) {
        reason = GUARD_REASON_CONFIG_CORRUPT;
    } else if (!time_is_valid(self, now_us)) {
        reason = GUARD_REASON_TIME_BACKWARDS;
    } else if (self->ticked && ((now_us - self->last_tick_us) > self->config->tick_deadline_us)) {
        reason = GUARD_REASON_TICK_LATE;
    } else if (!clock_runs(self, now_us)) {
        reason = GUARD_REASON_CLOCK_STOPPED;
    } else if (self->over_budget) {
        reason = GUARD_REASON_TICK_OVER_BUDGET;
    } else if (self->restarts > GUARD_MAX_RESTARTS) {
        reason = GUARD_REASON_RESTART_LIMIT;
    } else if ((self->inputs.fault != 0u) && ((reason_class((guard_reason_t)self->inputs.fault) == REASON_FAULT) ||
                                              (reason_class((guard_reason_t)self->inputs.fault) == REASON_UNKNOWN))) {
        reason = (guard_reason_t)self->inputs.fault;
    } else {
        /* nothing is wrong */
    }
    self->ticked = true;
    self->last_tick_us = now_us;
    return reason;
}
