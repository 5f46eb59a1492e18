#include "guard_parts.h"

static const guard_reason_t timeout_reason[INPUT_COUNT] = {GUARD_REASON_NONE, GUARD_REASON_SYNC_TIMEOUT,
                                                           GUARD_REASON_JOINT_TIMEOUT, GUARD_REASON_TASK_TIMEOUT};

/* --- deadlines ---------------------------------------------------------------------------------------------------- */

static bool in_time(guard_t *self, const guard_input_t *input, uint32_t deadline_us, uint64_t now_us) {
    const uint64_t age_us = now_us - input->good_us;
    if (!input->seen || (age_us > deadline_us)) {
        return false;
    }
    const uint32_t margin_us = deadline_us - (uint32_t)age_us;
    self->report.margin_us = (margin_us < self->report.margin_us) ? margin_us : self->report.margin_us;
    return true;
}

static bool in_cycles(const guard_t *self, uint16_t cycle, uint32_t deadline_us) {
    const uint32_t cycles = (uint16_t)(self->inputs.snapshot.cycle - cycle);
    return (cycles * self->config->period_us) <= deadline_us;
}

bool joints_in_cycles(const guard_t *self) {
    return in_cycles(self, self->inputs.snapshot.taken_cycle, self->config->joint_deadline_us);
}

bool task_in_cycles(const guard_t *self) {
    return in_cycles(self, self->inputs.task_cycle, self->config->task_deadline_us);
}

input_t missing_input(guard_t *self, uint64_t now_us) {
    const guard_config_t *const config = self->config;
    const bool sync = in_time(self, &self->inputs.sync, config->sync_deadline_us, now_us);
    const bool joints = in_time(self, &self->inputs.joints, config->joint_deadline_us, now_us);
    const bool task = in_time(self, &self->inputs.task, config->task_deadline_us, now_us);
    if (!sync) {
        return INPUT_SYNC;
    }
    if (!(joints && joints_in_cycles(self))) {
        return INPUT_JOINTS;
    }
    return (task && task_in_cycles(self)) ? INPUT_NONE : INPUT_TASK;
}

uint32_t missing_joint(const snapshot_t *snapshot) {
    const uint32_t missing = (uint32_t)snapshot->expected & ~(uint32_t)snapshot->received;
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        if ((missing & (1u << i)) != 0u) {
            return i + 1u;
        }
    }
    return 0;
}

bool is_settled(const guard_t *self) {
    return ((uint64_t)self->settled_cycles * self->config->period_us) >= self->config->settling_us;
}

bool healthy_for_long_enough(const guard_t *self, uint64_t now_us) {
    return self->healthy && ((now_us - self->healthy_since_us) >= self->config->reset_healthy_us);
}

bool is_blind(const guard_t *self) {
    const uint32_t task = (self->task < (uint32_t)TASK_COUNT) ? self->task : (uint32_t)TASK_INVALID;
    return (self->config->task[task].needed_links & self->sight.blind) != 0u;
}

/* --- events: what ends a permission ------------------------------------------------------------------------------- */

guard_event_t contact_event(const guard_t *self) {
    const guard_config_t *const config = self->config;
    guard_event_t event = {.reason = GUARD_REASON_NONE, .category = config->stop_collision};
    if (self->detector.tripped) {
        const uint32_t channel = self->detector.channel[self->detector.joint];
        const bool sudden = config->bank.channel[channel].of == (uint32_t)CHANNEL_SUDDEN;
        event.reason = sudden ? GUARD_REASON_SUDDEN : GUARD_REASON_COLLISION;
        event.joint = self->detector.joint + 1u;
        event.channel = channel;
        event.value_nm = self->detector.value_nm[self->detector.joint];
        event.threshold_nm = self->detector.threshold_nm[self->detector.joint];
    } else if (self->explained.tripped) {
        static const guard_reason_t reason[] = {GUARD_REASON_NONE, GUARD_REASON_EXPLAINED_FORCE,
                                                GUARD_REASON_EXPLAINED_MOMENT, GUARD_REASON_RESIDUAL_LIMIT};
        event.reason = reason[self->explained.excess];
        event.joint = (self->explained.excess == EXPLAINED_RESIDUAL) ? (self->explained.joint + 1u) : 0u;
        event.value_nm = self->explained.value;
        event.threshold_nm = self->explained.limit;
    } else {
        /* no unexplained contact */
    }
    return event;
}

guard_event_t input_event(const guard_t *self, input_t missing, bool saturated) {
    guard_event_t event = {.reason = GUARD_REASON_NONE, .category = self->config->stop_input};
    if (self->inputs.fault != 0u) {
        event.reason = (guard_reason_t)self->inputs.fault;
        event.joint = self->inputs.fault_joint;
    } else if (missing != INPUT_NONE) {
        event.reason = timeout_reason[missing];
        event.joint = (missing == INPUT_JOINTS) ? missing_joint(&self->inputs.snapshot) : 0u;
    } else if (self->plausibility.fault != 0u) {
        event.reason = (guard_reason_t)self->plausibility.fault;
        event.joint = self->plausibility.joint + 1u;
    } else if (!is_settled(self)) {
        event.reason = GUARD_REASON_OBSERVER_RESTART;
    } else if (is_blind(self) && (self->config->sight.reaction == (uint32_t)SIGHT_WITHDRAW)) {
        event.reason = GUARD_REASON_BLIND;
    } else if (saturated) {
        event.reason = GUARD_REASON_SATURATED;
    } else {
        /* every input is good */
    }
    return event;
}
