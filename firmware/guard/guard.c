#include "guard.h"

#include "guard_parts.h"

/* The inputs that have a deadline, in the order in which they are reported missing. */
typedef enum { INPUT_NONE = 0, INPUT_SYNC = 1, INPUT_JOINTS = 2, INPUT_TASK = 3, INPUT_COUNT = 4 } input_t;

static const guard_reason_t waiting_reason[INPUT_COUNT] = {GUARD_REASON_SETTLING, GUARD_REASON_WAITING_SYNC,
                                                           GUARD_REASON_WAITING_JOINT, GUARD_REASON_WAITING_TASK};
static const guard_reason_t timeout_reason[INPUT_COUNT] = {GUARD_REASON_NONE, GUARD_REASON_SYNC_TIMEOUT,
                                                           GUARD_REASON_JOINT_TIMEOUT, GUARD_REASON_TASK_TIMEOUT};

/* What is wrong with the bus or the board, and not with an input that may still come. */
static bool latches_while_waiting(guard_reason_t reason) {
    return ((reason >= GUARD_REASON_BUS_OFF) && (reason <= GUARD_REASON_SHUTDOWN)) ||
           (reason == GUARD_REASON_ANOTHER_GUARD);
}

static void enter(guard_t *self, guard_state_t state) {
    self->state = (uint32_t)state;
    self->state_inverted = ~(uint32_t)state;
}

static void trip(guard_t *self, guard_state_t state, guard_reason_t reason, uint32_t joint) {
    self->trip = (guard_trip_t){.reason = (uint32_t)reason,
                                .number = (self->trip.number == UINT8_MAX) ? 1u : (uint8_t)(self->trip.number + 1u),
                                .joint = (uint8_t)joint};
    if (reason == GUARD_REASON_COLLISION) {
        self->trip.value_nm = self->detector.value_nm;
        self->trip.threshold_nm = self->detector.threshold_nm;
    }
    self->healthy = false;
    count(&self->counters.trips, 1u);
    enter(self, state);
}

/* --- deadlines and states ----------------------------------------------------------------------------------------- */

static bool in_time(guard_t *self, const guard_input_t *input, uint32_t deadline_us, uint64_t now_us) {
    const uint64_t age_us = now_us - input->good_us;
    if (!input->seen || (age_us > deadline_us)) {
        return false;
    }
    const uint32_t margin_us = deadline_us - (uint32_t)age_us;
    self->report.margin_us = (margin_us < self->report.margin_us) ? margin_us : self->report.margin_us;
    return true;
}

/* The first input that is past its deadline, or has not come yet. Looks at all of them, for the margin. */
static input_t missing_input(guard_t *self, uint64_t now_us) {
    const guard_config_t *const config = self->config;
    const bool sync = in_time(self, &self->inputs.sync, config->sync_deadline_us, now_us);
    const bool joints = in_time(self, &self->inputs.joints, config->joint_deadline_us, now_us);
    const bool task = in_time(self, &self->inputs.task, config->task_deadline_us, now_us);
    if (!sync) {
        return INPUT_SYNC;
    }
    if (!joints) {
        return INPUT_JOINTS;
    }
    return task ? INPUT_NONE : INPUT_TASK;
}

/* The first joint, 1 to n, whose reading of the current cycle is not in; 0 if none is missing. */
static uint32_t missing_joint(const snapshot_t *snapshot) {
    const uint32_t missing = (uint32_t)snapshot->expected & ~(uint32_t)snapshot->received;
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        if ((missing & (1u << i)) != 0u) {
            return i + 1u;
        }
    }
    return 0;
}

static void while_monitoring(guard_t *self, input_t missing, bool saturated) {
    if (self->inputs.fault != 0u) {
        trip(self, GUARD_STATE_STOPPED, (guard_reason_t)self->inputs.fault, self->inputs.fault_joint);
    } else if (missing != INPUT_NONE) {
        const uint32_t joint = (missing == INPUT_JOINTS) ? missing_joint(&self->inputs.snapshot) : 0u;
        trip(self, GUARD_STATE_STOPPED, timeout_reason[missing], joint);
    } else if (saturated) {
        trip(self, GUARD_STATE_STOPPED, GUARD_REASON_SATURATED, 0u);
    } else if (self->detector.tripped) {
        trip(self, GUARD_STATE_STOPPED, GUARD_REASON_COLLISION, self->detector.joint + 1u);
    } else {
        /* the permission goes on */
    }
}

/* Every input is good and the index below its thresholds; keeps the time since when. */
static void track_health(guard_t *self, input_t missing, uint64_t now_us) {
    const bool healthy = (missing == INPUT_NONE) && (self->inputs.fault == 0u) && !self->detector.any_above;
    if (healthy && !self->healthy) {
        self->healthy_since_us = now_us;
    }
    self->healthy = healthy;
}

static bool healthy_for_long_enough(const guard_t *self, uint64_t now_us) {
    return self->healthy && ((now_us - self->healthy_since_us) >= self->config->reset_healthy_us);
}

static void while_waiting(guard_t *self, input_t missing, uint64_t now_us) {
    const guard_reason_t fault = (guard_reason_t)self->inputs.fault;
    const bool usable = (missing == INPUT_NONE) && (self->inputs.fault == 0u);
    if (latches_while_waiting(fault)) {
        trip(self, GUARD_STATE_STOPPED, fault, 0u);
    } else if (usable && self->detector.tripped) {
        trip(self, GUARD_STATE_STOPPED, GUARD_REASON_COLLISION, self->detector.joint + 1u);
    } else if ((self->stages == (uint32_t)STAGE_ALL) && healthy_for_long_enough(self, now_us)) {
        enter(self, GUARD_STATE_MONITORING);
    } else {
        /* go on waiting */
    }
}

static void while_stopped(guard_t *self, input_t missing, uint64_t now_us) {
    if (self->inputs.edge && (self->inputs.requested_trip == self->trip.number) &&
        healthy_for_long_enough(self, now_us)) {
        self->inputs.edge = false;
        enter(self, GUARD_STATE_WAITING);
        while_waiting(self, missing, now_us);
    }
}

static input_t step(guard_t *self, uint64_t now_us) {
    if (snapshot_is_complete(&self->inputs.snapshot)) {
        stages_run(self);
        if (!stages_complete(self)) {
            trip(self, GUARD_STATE_FAULT, GUARD_REASON_STAGE_MISSED, 0u);
        } else if (!stages_valid(self)) {
            trip(self, GUARD_STATE_FAULT, GUARD_REASON_STATE_CORRUPT, 0u);
        } else {
            /* the results may be used */
        }
    }
    const bool saturated = stages_saturated(self);
    const input_t missing = missing_input(self, now_us);
    track_health(self, missing, now_us);
    switch ((guard_state_t)self->state) {
    case GUARD_STATE_MONITORING:
        while_monitoring(self, missing, saturated);
        break;
    case GUARD_STATE_WAITING:
        while_waiting(self, missing, now_us);
        break;
    case GUARD_STATE_STOPPED:
        while_stopped(self, missing, now_us);
        break;
    case GUARD_STATE_UNINITIALISED:
    case GUARD_STATE_SELF_TEST:
    case GUARD_STATE_FAULT:
    default:
        break;
    }
    return missing;
}

/* --- the verdict -------------------------------------------------------------------------------------------------- */

static uint32_t category(const guard_t *self) {
    const guard_config_t *const config = self->config;
    if (self->state == (uint32_t)GUARD_STATE_FAULT) {
        return config->stop_fault;
    }
    const bool collision =
        (self->state == (uint32_t)GUARD_STATE_MONITORING) ||
        ((self->state == (uint32_t)GUARD_STATE_STOPPED) && (self->trip.reason == (uint32_t)GUARD_REASON_COLLISION));
    return collision ? config->stop_collision : config->stop_input;
}

static void tell_reason(const guard_t *self, input_t missing, guard_output_t *out) {
    switch ((guard_state_t)self->state) {
    case GUARD_STATE_MONITORING:
        out->reason = GUARD_REASON_NONE;
        out->joint = (uint8_t)(self->detector.joint + 1u);
        out->value_nm = self->detector.value_nm;
        out->threshold_nm = self->detector.threshold_nm;
        break;
    case GUARD_STATE_STOPPED:
    case GUARD_STATE_FAULT:
        out->reason = (guard_reason_t)self->trip.reason;
        out->joint = self->trip.joint;
        out->value_nm = self->trip.value_nm;
        out->threshold_nm = self->trip.threshold_nm;
        break;
    case GUARD_STATE_WAITING:
        if (self->inputs.fault != 0u) {
            out->reason = (guard_reason_t)self->inputs.fault;
            out->joint = self->inputs.fault_joint;
        } else {
            out->reason = waiting_reason[missing];
            out->joint = (uint8_t)((missing == INPUT_JOINTS) ? missing_joint(&self->inputs.snapshot) : 0u);
        }
        break;
    case GUARD_STATE_SELF_TEST:
        out->reason = GUARD_REASON_SELF_TEST;
        break;
    case GUARD_STATE_UNINITIALISED:
    default:
        out->reason = GUARD_REASON_UNINITIALISED;
        break;
    }
}

static void tell(const guard_t *self, input_t missing, guard_output_t *out) {
    const uint32_t joints = (self->joints < ROBOT_MAX_JOINTS) ? self->joints : ROBOT_MAX_JOINTS;
    out->state = (guard_state_t)self->state;
    out->permitted = self->state == (uint32_t)GUARD_STATE_MONITORING;
    out->fresh = self->stages != 0u;
    out->task = self->inputs.task_number;
    out->stop_category = (uint8_t)category(self);
    out->trip_number = self->trip.number;
    out->cycle = self->inputs.snapshot.cycle;
    out->smallest_singular = self->index.subspace.smallest;
    out->rank = self->index.subspace.rank;
    for (uint32_t i = 0; i < joints; ++i) {
        out->residual[i] = self->observer.residual[i];
        out->index[i] = self->index.value[i];
    }
    tell_reason(self, missing, out);
}

guard_status_t guard_init(guard_t *self, const guard_config_t *config) {
    *self = (guard_t){.inputs = {.request = true}};
    enter(self, GUARD_STATE_UNINITIALISED);
    report_init(&self->report);
    const guard_status_t status = config_check(config);
    if (status != GUARD_OK) {
        return status;
    }
    self->config = config;
    self->joints = config->robot.joint_count;
    (void)snapshot_init(&self->inputs.snapshot, self->joints);
    motion_init(&self->motion);
    observer_init(&self->observer);
    index_init(&self->index);
    detector_init(&self->detector);
    config_watch_start(&self->watch);
    enter(self, GUARD_STATE_SELF_TEST);
    return GUARD_OK;
}

void guard_tick(guard_t *self, uint64_t now_us, guard_output_t *out) {
    *out = (guard_output_t){0};
    if (self->config == 0) {
        report_tick(self, out);
        return;
    }
    input_t missing = INPUT_NONE;
    self->stages = 0;
    const guard_reason_t broken = supervise(self, now_us);
    const bool in_fault = self->state == (uint32_t)GUARD_STATE_FAULT;
    if (broken != GUARD_REASON_NONE) {
        if (!in_fault) {
            trip(self, GUARD_STATE_FAULT, broken, 0u);
        }
    } else if (self->state == (uint32_t)GUARD_STATE_SELF_TEST) {
        if (self_test(&self->index.subspace)) {
            enter(self, GUARD_STATE_WAITING);
        } else {
            trip(self, GUARD_STATE_FAULT, GUARD_REASON_SELF_TEST_FAILED, 0u);
        }
        missing = missing_input(self, now_us);
    } else if (!in_fault) {
        missing = step(self, now_us);
    } else {
        /* FAULT ends with guard_init only */
    }
    if (self->inputs.edge) { /* one that was not granted */
        count(&self->counters.resets_refused, 1u);
    }
    tell(self, missing, out);
    self->inputs.edge = false;
    self->inputs.fault = 0;
    self->inputs.fault_joint = 0;
    report_tick(self, out);
}

void guard_note_tick_time(guard_t *self, uint32_t tick_us) {
    self->report.tick_time_us = tick_us;
    self->report.worst_tick_time_us =
        (tick_us > self->report.worst_tick_time_us) ? tick_us : self->report.worst_tick_time_us;
    self->over_budget = self->over_budget || ((self->config != 0) && (tick_us > self->config->tick_budget_us));
}

void guard_trip(guard_t *self, guard_reason_t reason) {
    self->inputs.fault = (uint32_t)reason; /* before any input fault of the same tick */
    self->inputs.fault_joint = 0;
}
