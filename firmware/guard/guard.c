#include "guard.h"

#include "guard_parts.h"
#include "guard_reason.h"

/* The inputs that have a deadline, in the order in which they are reported missing. */
typedef enum { INPUT_NONE = 0, INPUT_SYNC = 1, INPUT_JOINTS = 2, INPUT_TASK = 3, INPUT_COUNT = 4 } input_t;

static const guard_reason_t waiting_reason[INPUT_COUNT] = {GUARD_REASON_SETTLING, GUARD_REASON_WAITING_SYNC,
                                                           GUARD_REASON_WAITING_JOINT, GUARD_REASON_WAITING_TASK};
static const guard_reason_t timeout_reason[INPUT_COUNT] = {GUARD_REASON_NONE, GUARD_REASON_SYNC_TIMEOUT,
                                                           GUARD_REASON_JOINT_TIMEOUT, GUARD_REASON_TASK_TIMEOUT};

/* Why a permission ends. */
typedef struct {
    guard_reason_t reason; /* GUARD_REASON_NONE: it goes on */
    uint32_t joint;        /* 1 to n, or 0 */
    uint32_t category;
    num_t value_nm;
    num_t threshold_nm;
} event_t;

static void enter(guard_t *self, guard_state_t state) {
    self->state = (uint32_t)state;
    self->state_inverted = ~(uint32_t)state;
}

static void trip(guard_t *self, guard_state_t state, const event_t *event) {
    self->trip = (guard_trip_t){.reason = (uint32_t)event->reason,
                                .number = (self->trip.number == UINT8_MAX) ? 1u : (uint8_t)(self->trip.number + 1u),
                                .joint = (uint8_t)event->joint,
                                .category = (uint8_t)event->category,
                                .value_nm = event->value_nm,
                                .threshold_nm = event->threshold_nm};
    self->healthy = false;
    self->calm = false;
    rise_start(&self->rise, self->last_tick_us);
    self->inputs.request = true; /* both frames of the reset's edge come after the trip */
    self->inputs.edge = false;
    count(&self->counters.trips, 1u);
    enter(self, state);
}

static void fault(guard_t *self, guard_reason_t reason) {
    const event_t event = {.reason = reason, .category = self->config->stop_fault};
    trip(self, GUARD_STATE_FAULT, &event);
}

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

/* A deadline counts in cycles too, so that it holds whatever the clock does. False: `cycle` is past it. */
static bool in_cycles(const guard_t *self, uint16_t cycle, uint32_t deadline_us) {
    const uint32_t cycles = (uint16_t)(self->inputs.snapshot.cycle - cycle);
    return (cycles * self->config->period_us) <= deadline_us;
}

static bool joints_in_cycles(const guard_t *self) {
    return in_cycles(self, self->inputs.snapshot.taken_cycle, self->config->joint_deadline_us);
}

static bool task_in_cycles(const guard_t *self) {
    return in_cycles(self, self->inputs.task_cycle, self->config->task_deadline_us);
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
    if (!(joints && joints_in_cycles(self))) {
        return INPUT_JOINTS;
    }
    return (task && task_in_cycles(self)) ? INPUT_NONE : INPUT_TASK;
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

/* The observer has run for its settling time, so that it sees what already leans on the arm. */
static bool is_settled(const guard_t *self) {
    return ((uint64_t)self->settled_cycles * self->config->period_us) >= self->config->settling_us;
}

/* --- events: what ends a permission ------------------------------------------------------------------------------- */

static event_t contact_event(const guard_t *self) {
    const guard_config_t *const config = self->config;
    event_t event = {.reason = GUARD_REASON_NONE, .category = config->stop_collision};
    if (self->detector.tripped) {
        const uint32_t channel = self->detector.channel[self->detector.joint];
        const bool sudden = config->bank.channel[channel].of == (uint32_t)CHANNEL_SUDDEN;
        event.reason = sudden ? GUARD_REASON_SUDDEN : GUARD_REASON_COLLISION;
        event.joint = self->detector.joint + 1u;
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
        /* nothing touches the arm that the task does not explain */
    }
    return event;
}

static event_t input_event(const guard_t *self, input_t missing, bool saturated) {
    event_t event = {.reason = GUARD_REASON_NONE, .category = self->config->stop_input};
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
    } else if (saturated) {
        event.reason = GUARD_REASON_SATURATED;
    } else {
        /* every input is good */
    }
    return event;
}

/* An input that cannot be trusted comes first: an index of it means nothing. */
static event_t find_event(const guard_t *self, const event_t *input) {
    return (input->reason != GUARD_REASON_NONE) ? *input : contact_event(self);
}

/* --- states ------------------------------------------------------------------------------------------------------- */

static bool is_touched(const guard_t *self) {
    return self->detector.any_above || (self->explained.excess != EXPLAINED_NOTHING);
}

/* Every input is good and nothing above its limits; keeps the time since when. */
static void track_health(guard_t *self, const event_t *input, uint64_t now_us) {
    const bool healthy = (input->reason == GUARD_REASON_NONE) && self->inputs.clocks_agree && !is_touched(self);
    if (healthy && !self->healthy) {
        self->healthy_since_us = now_us;
    }
    self->healthy = healthy;
}

static bool healthy_for_long_enough(const guard_t *self, uint64_t now_us) {
    return self->healthy && ((now_us - self->healthy_since_us) >= self->config->reset_healthy_us);
}

static bool is_reset(const guard_t *self) {
    return self->inputs.edge && (self->inputs.requested_trip == self->trip.number);
}

static void while_monitoring(guard_t *self, const event_t *input) {
    const event_t event = find_event(self, input);
    if (event.reason != GUARD_REASON_NONE) {
        trip(self, GUARD_STATE_STOPPED, &event);
    }
}

static void while_waiting(guard_t *self, const event_t *input, uint64_t now_us) {
    const event_t contact = contact_event(self);
    if (reason_class(input->reason) == REASON_BOARD) {
        trip(self, GUARD_STATE_STOPPED, input);
    } else if ((input->reason == GUARD_REASON_NONE) && (contact.reason != GUARD_REASON_NONE)) {
        trip(self, GUARD_STATE_STOPPED, &contact);
    } else if (self->evaluated && healthy_for_long_enough(self, now_us) && (self->acknowledged || is_reset(self))) {
        self->inputs.edge = self->inputs.edge && self->acknowledged;
        self->acknowledged = true;
        enter(self, GUARD_STATE_MONITORING);
    } else {
        /* go on waiting */
    }
}

/* A blow may drive a sensor beyond its range for a moment. The reading is refused, so that the joint deadline raises
 * the category if no good snapshot follows; the observer may have to start again. */
static bool is_passing(guard_reason_t reason) {
    return (reason == GUARD_REASON_INPUT_RANGE) || (reason == GUARD_REASON_IMPLAUSIBLE) ||
           (reason == GUARD_REASON_OBSERVER_RESTART);
}

/* What a stop of this category does not cover: a worse category, or a second collision while the arm may still move. */
static event_t worse_event(const guard_t *self, const event_t *input, bool rising) {
    event_t contact = contact_event(self);
    if (contact.reason != GUARD_REASON_NONE) {
        const uint32_t second = self->config->stop_input;
        contact.category = (contact.category < second) ? contact.category : second;
        if (rising && self->detector.tripped) {
            contact.joint = self->rise.joint + 1u;
            contact.value_nm = self->detector.value_nm[self->rise.joint];
            contact.threshold_nm = self->detector.threshold_nm[self->rise.joint];
        } else if (!self->calm) {
            contact.reason = GUARD_REASON_NONE;
        } else {
            /* a contact after everything was good */
        }
    }
    if ((input->reason != GUARD_REASON_NONE) && !is_passing(input->reason) && (input->category < self->trip.category)) {
        return *input;
    }
    if ((contact.reason != GUARD_REASON_NONE) && (contact.category < self->trip.category)) {
        return contact;
    }
    return (event_t){.reason = GUARD_REASON_NONE};
}

static void while_stopped(guard_t *self, const event_t *input, uint64_t now_us) {
    self->calm = self->calm || healthy_for_long_enough(self, now_us);
    const bool rising = self->evaluated && rise_step(&self->rise, &self->detector, self->joints, now_us);
    const event_t worse = worse_event(self, input, rising);
    if (worse.reason != GUARD_REASON_NONE) {
        trip(self, GUARD_STATE_STOPPED, &worse);
    } else if (is_reset(self) && healthy_for_long_enough(self, now_us)) {
        self->inputs.edge = false;
        self->acknowledged = true;
        enter(self, GUARD_STATE_WAITING);
        while_waiting(self, input, now_us);
    } else {
        /* stay */
    }
}

static void evaluate(guard_t *self) {
    stages_run(self);
    if (!stages_complete(self)) {
        fault(self, GUARD_REASON_STAGE_MISSED);
    } else if (!stages_valid(self)) {
        fault(self, GUARD_REASON_STATE_CORRUPT);
    } else {
        self->evaluated = true;
        self->inputs.joints = (guard_input_t){.good_us = self->inputs.completed_us, .seen = true};
    }
}

static input_t step(guard_t *self, uint64_t now_us) {
    if (snapshot_is_complete(&self->inputs.snapshot)) {
        evaluate(self);
    }
    const bool saturated = stages_saturated(self);
    const input_t missing = missing_input(self, now_us);
    const event_t input = input_event(self, missing, saturated);
    track_health(self, &input, now_us);
    switch ((guard_state_t)self->state) {
    case GUARD_STATE_MONITORING:
        while_monitoring(self, &input);
        break;
    case GUARD_STATE_WAITING:
        while_waiting(self, &input, now_us);
        break;
    case GUARD_STATE_STOPPED:
        while_stopped(self, &input, now_us);
        break;
    case GUARD_STATE_UNINITIALISED:
    case GUARD_STATE_SELF_TEST:
    case GUARD_STATE_FAULT:
    default:
        break;
    }
    return missing;
}

static void test_self(guard_t *self) {
    switch (self_test_step(self)) {
    case SELF_TEST_PASSED:
        stages_init(self);
        enter(self, GUARD_STATE_WAITING);
        break;
    case SELF_TEST_RUNNING:
        break;
    case SELF_TEST_FAILED:
    default:
        fault(self, GUARD_REASON_SELF_TEST_FAILED);
        break;
    }
}

/* --- the verdict -------------------------------------------------------------------------------------------------- */

static uint32_t category(const guard_t *self) {
    const guard_config_t *const config = self->config;
    switch ((guard_state_t)self->state) {
    case GUARD_STATE_MONITORING:
        return config->stop_collision;
    case GUARD_STATE_STOPPED:
    case GUARD_STATE_FAULT:
        return self->trip.category;
    case GUARD_STATE_UNINITIALISED:
    case GUARD_STATE_SELF_TEST:
    case GUARD_STATE_WAITING:
    default:
        return config->stop_input;
    }
}

static bool is_older(const guard_input_t *input, uint32_t deadline_us, uint64_t now_us) {
    return !input->seen || (input->good_us > now_us) || ((now_us - input->good_us) > deadline_us);
}

/* The second opinion, from which the inverted copy of the permission comes. It does not look at the state's own word
 * but at its copy, and at what a permission rests on. True: no permission. */
static bool is_withheld(const guard_t *self, uint64_t now_us) {
    const guard_config_t *const config = self->config;
    const bool other_state = self->state_inverted != ~(uint32_t)GUARD_STATE_MONITORING;
    const bool old = is_older(&self->inputs.sync, config->sync_deadline_us, now_us) ||
                     is_older(&self->inputs.joints, config->joint_deadline_us, now_us) ||
                     is_older(&self->inputs.task, config->task_deadline_us, now_us) || !joints_in_cycles(self) ||
                     !task_in_cycles(self);
    const bool unfit =
        !is_settled(self) || !self->acknowledged || (self->inputs.fault != 0u) || (self->plausibility.fault != 0u);
    return other_state || old || unfit || self->detector.tripped || self->explained.tripped;
}

static void tell_waiting(const guard_t *self, input_t missing, uint64_t now_us, guard_output_t *out) {
    const bool restarted =
        (self->start_cause != (uint8_t)GUARD_START_POWER_ON) && (self->start_cause != (uint8_t)GUARD_START_COMMANDED);
    if (self->inputs.fault != 0u) {
        out->reason = (guard_reason_t)self->inputs.fault;
        out->joint = self->inputs.fault_joint;
    } else if (missing != INPUT_NONE) {
        out->reason = waiting_reason[missing];
        out->joint = (uint8_t)((missing == INPUT_JOINTS) ? missing_joint(&self->inputs.snapshot) : 0u);
    } else if (self->plausibility.fault != 0u) {
        out->reason = (guard_reason_t)self->plausibility.fault;
        out->joint = (uint8_t)(self->plausibility.joint + 1u);
    } else if (healthy_for_long_enough(self, now_us) && !self->acknowledged) {
        out->reason = restarted ? GUARD_REASON_RESTARTED : GUARD_REASON_AWAITING_RESET;
    } else {
        out->reason = GUARD_REASON_SETTLING;
    }
}

static void tell_reason(const guard_t *self, input_t missing, uint64_t now_us, guard_output_t *out) {
    switch ((guard_state_t)self->state) {
    case GUARD_STATE_MONITORING:
        out->reason = GUARD_REASON_NONE;
        out->joint = (uint8_t)(self->detector.joint + 1u);
        out->value_nm = self->detector.value_nm[self->detector.joint];
        out->threshold_nm = self->detector.threshold_nm[self->detector.joint];
        break;
    case GUARD_STATE_STOPPED:
    case GUARD_STATE_FAULT:
        out->reason = (guard_reason_t)self->trip.reason;
        out->joint = self->trip.joint;
        out->value_nm = self->trip.value_nm;
        out->threshold_nm = self->trip.threshold_nm;
        break;
    case GUARD_STATE_WAITING:
        tell_waiting(self, missing, now_us, out);
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

static void tell(const guard_t *self, input_t missing, uint64_t now_us, guard_output_t *out) {
    const uint32_t joints = (self->joints < ROBOT_MAX_JOINTS) ? self->joints : ROBOT_MAX_JOINTS;
    out->state = (guard_state_t)self->state;
    out->permitted = self->state == (uint32_t)GUARD_STATE_MONITORING;
    out->withheld = is_withheld(self, now_us);
    out->fresh = self->evaluated;
    out->task = (uint8_t)self->task;
    out->stop_category = (uint8_t)category(self);
    out->trip_number = self->trip.number;
    out->cycle = self->inputs.snapshot.cycle;
    out->channel = self->detector.channel[self->detector.joint];
    out->smallest_singular = self->index.smallest;
    out->rank = self->index.rank;
    const bool measured = self->state > (uint32_t)GUARD_STATE_SELF_TEST; /* not the self-test's own push */
    for (uint32_t i = 0; measured && (i < joints); ++i) {
        out->residual[i] = self->observer.residual[i];
        out->index[i] = self->detector.value_nm[i];
        out->threshold[i] = self->detector.threshold_nm[i];
    }
    tell_reason(self, missing, now_us, out);
}

guard_status_t guard_init(guard_t *self, const guard_config_t *config) {
    *self = (guard_t){.inputs = {.request = true}, .restarts = 1u};
    enter(self, GUARD_STATE_UNINITIALISED);
    report_init(&self->report);
    const guard_status_t status = config_check(config);
    if (status != GUARD_OK) {
        return status;
    }
    self->config = config;
    self->joints = config->robot.joint_count;
    (void)snapshot_init(&self->inputs.snapshot, self->joints);
    stages_init(self);
    config_watch_start(&self->watch);
    enter(self, GUARD_STATE_SELF_TEST);
    return GUARD_OK;
}

void guard_note_start(guard_t *self, guard_start_t cause, uint32_t restarts, guard_variant_t variant) {
    self->start_cause = (uint8_t)cause;
    self->restarts = (uint8_t)((restarts < UINT8_MAX) ? restarts : UINT8_MAX);
    self->variant = (uint8_t)variant;
}

void guard_tick(guard_t *self, uint64_t now_us, guard_output_t *out) {
    *out = (guard_output_t){.withheld = true};
    if (self->config == 0) {
        report_tick(self, out);
        return;
    }
    input_t missing = INPUT_NONE;
    self->evaluated = false;
    const guard_reason_t broken = supervise(self, now_us);
    const bool testing = self->state == (uint32_t)GUARD_STATE_SELF_TEST;
    const bool in_fault = self->state == (uint32_t)GUARD_STATE_FAULT;
    if (broken != GUARD_REASON_NONE) {
        if (!in_fault) {
            fault(self, broken);
        }
    } else if (testing) {
        test_self(self);
        missing = missing_input(self, now_us);
    } else if (!in_fault) {
        missing = step(self, now_us);
    } else {
        /* FAULT ends with guard_init only */
    }
    if (self->inputs.edge) { /* one that was not granted */
        count(&self->counters.resets_refused, 1u);
    }
    tell(self, missing, now_us, out);
    self->inputs.edge = false;
    if (!testing) { /* what comes in during the self-test is for the first tick behind it */
        self->inputs.fault = 0;
        self->inputs.fault_joint = 0;
    }
    report_tick(self, out);
}

void guard_note_tick_time(guard_t *self, uint32_t tick_us) {
    self->report.tick_time_us = tick_us;
    self->report.worst_tick_time_us =
        (tick_us > self->report.worst_tick_time_us) ? tick_us : self->report.worst_tick_time_us;
    self->over_budget = self->over_budget || ((self->config != 0) && (tick_us > self->config->tick_budget_us));
}

void guard_trip(guard_t *self, guard_reason_t reason) {
    note_fault(self, reason, 0u);
}
