#include "guard.h"

#include <stddef.h>

#include "guard_parts.h"
#include "guard_reason.h"

static void enter(guard_t *self, guard_state_t state) {
    self->state = (uint32_t)state;
    self->state_inverted = ~(uint32_t)state;
}

static void trip(guard_t *self, guard_state_t state, const guard_event_t *event) {
    self->trip = (guard_trip_t){.reason = (uint32_t)event->reason,
                                .number = (self->trip.number == UINT8_MAX) ? 1u : (uint8_t)(self->trip.number + 1u),
                                .joint = (uint8_t)event->joint,
                                .category = (uint8_t)event->category,
                                .channel = (uint8_t)event->channel,
                                .value_nm = event->value_nm,
                                .threshold_nm = event->threshold_nm};
    self->healthy = false;
    self->calm = false;
    rise_start(&self->rise, self->last_tick_us);
    contact_note_trip(self, event);
    self->inputs.request = true; /* both frames of the reset's edge must come after the trip */
    self->inputs.edge = (uint8_t)GUARD_CLEAR;
    count(&self->counters.trips, 1u);
    enter(self, state);
}

/* --- what this channel alone would do ----------------------------------------------------------------------------- */

static guard_event_t fault_of(const guard_t *self, guard_reason_t reason) {
    return (guard_event_t){.reason = reason, .category = self->config->stop_fault};
}

static void wish_fault(const guard_t *self, guard_finding_t *finding, guard_reason_t reason) {
    finding->wish = WISH_FAULT;
    finding->event = fault_of(self, reason);
}

static void wish_stop(guard_finding_t *finding, const guard_event_t *event) {
    if ((event->reason != GUARD_REASON_NONE) && (finding->wish == WISH_GO_ON)) {
        finding->wish = WISH_STOP;
        finding->event = *event;
    }
}

static bool is_touched(const guard_t *self) {
    return self->detector.any_above || (self->explained.excess != EXPLAINED_NOTHING);
}

/* An input that cannot be trusted comes first: an index computed from it has no meaning. */
static void while_monitoring(const guard_t *self, const guard_event_t *input, guard_finding_t *finding) {
    const guard_event_t contact = contact_event(self);
    wish_stop(finding, input);
    wish_stop(finding, &contact);
}

static void while_waiting(const guard_t *self, const guard_event_t *input, guard_finding_t *finding) {
    const guard_event_t contact = contact_event(self);
    if (reason_class(input->reason) == REASON_BOARD) {
        wish_stop(finding, input);
    } else if (input->reason == GUARD_REASON_NONE) {
        wish_stop(finding, &contact);
    } else {
        /* keep waiting */
    }
}

/* A blow may drive a sensor beyond its range for a moment. The reading is refused. If no good snapshot follows, the
 * joint deadline raises the category. The observer may have to restart. */
static bool is_passing(guard_reason_t reason) {
    return (reason == GUARD_REASON_INPUT_RANGE) || (reason == GUARD_REASON_IMPLAUSIBLE) ||
           (reason == GUARD_REASON_OBSERVER_RESTART);
}

/* Whether an event exceeds the current stop: a worse category, or a second collision while the arm may still move. */
static guard_event_t worse_event(const guard_t *self, const guard_event_t *input, bool rising) {
    guard_event_t contact = contact_event(self);
    const uint32_t second = self->config->stop_input;
    contact.category = (contact.category < second) ? contact.category : second;
    if (rising && self->detector.tripped) {
        contact.joint = self->rise.joint + 1u;
        contact.channel = self->detector.channel[self->rise.joint];
        contact.value_nm = self->detector.value_nm[self->rise.joint];
        contact.threshold_nm = self->detector.threshold_nm[self->rise.joint];
    } else if (!self->calm) {
        contact.reason = GUARD_REASON_NONE;
    } else {
        /* a contact after everything was good, or none */
    }
    if ((input->reason != GUARD_REASON_NONE) && !is_passing(input->reason) && (input->category < self->trip.category)) {
        return *input;
    }
    if (contact.category >= self->trip.category) {
        contact.reason = GUARD_REASON_NONE;
    }
    return contact;
}

static void while_stopped(guard_t *self, const guard_event_t *input, uint64_t now_us, guard_finding_t *finding) {
    const bool rising = self->evaluated && rise_step(&self->rise, &self->detector, self->joints, now_us);
    const guard_event_t worse = worse_event(self, input, rising);
    wish_stop(finding, &worse);
}

static void evaluate(guard_t *self, guard_finding_t *finding) {
    stages_run(self);
    if (!stages_complete(self)) {
        wish_fault(self, finding, GUARD_REASON_STAGE_MISSED);
    } else if (!stages_valid(self)) {
        wish_fault(self, finding, GUARD_REASON_STATE_CORRUPT);
    } else {
        self->evaluated = true;
        contact_step(self);
        self->inputs.joints = (guard_input_t){.good_us = self->inputs.completed_us, .seen = true};
    }
}

static void look_at_inputs(guard_t *self, uint64_t now_us, guard_finding_t *finding) {
    if (snapshot_is_complete(&self->inputs.snapshot)) {
        evaluate(self, finding);
    }
    const bool saturated = stages_saturated(self);
    finding->saturated = saturated;
    finding->missing = missing_input(self, now_us);
    const guard_event_t input = input_event(self, finding->missing, saturated);
    finding->healthy = (input.reason == GUARD_REASON_NONE) && self->inputs.clocks_agree && !is_touched(self);
    switch ((guard_state_t)self->state) {
    case GUARD_STATE_MONITORING:
        while_monitoring(self, &input, finding);
        break;
    case GUARD_STATE_WAITING:
        while_waiting(self, &input, finding);
        break;
    case GUARD_STATE_STOPPED:
        while_stopped(self, &input, now_us, finding);
        break;
    /* Uncovered in both, 4 lines: 4 regions, 4 branches. guard_look handles the self-test and FAULT before it comes
     * here, and supervise refuses every other state. */
    case GUARD_STATE_UNINITIALISED:
    case GUARD_STATE_SELF_TEST:
    case GUARD_STATE_FAULT:
    default:
        break;
    }
}

static void test_self(guard_t *self, guard_finding_t *finding) {
    if (self->tested) {
        return; /* the other channel is not ready yet */
    }
    const self_test_t result = self_test_step(self);
    if (result == SELF_TEST_PASSED) {
        self->tested = true;
    } else if (result != SELF_TEST_RUNNING) {
        wish_fault(self, finding, GUARD_REASON_SELF_TEST_FAILED);
    } else {
        /* not through yet */
    }
}

void guard_look(guard_t *self, uint64_t now_us, guard_finding_t *finding) {
    *finding = (guard_finding_t){.wish = WISH_GO_ON};
    self->evaluated = false;
    const guard_reason_t broken = supervise(self, now_us);
    if (broken != GUARD_REASON_NONE) {
        wish_fault(self, finding, broken);
    } else if (self->state == (uint32_t)GUARD_STATE_SELF_TEST) {
        test_self(self, finding);
        finding->missing = missing_input(self, now_us);
    } else if (self->state != (uint32_t)GUARD_STATE_FAULT) {
        look_at_inputs(self, now_us, finding);
    } else {
        wish_fault(self, finding, (guard_reason_t)self->trip.reason);
    }
    finding->tested = self->tested;
    finding->fresh = self->evaluated;
}

/* --- the decision ------------------------------------------------------------------------------------------------- */

/* Keeps the time since when everything is good. */
static void track_health(guard_t *self, bool healthy, uint64_t now_us) {
    if (!self->healthy) {
        self->healthy_since_us = now_us;
    }
    self->healthy = healthy;
}

static bool is_reset(const guard_t *self) {
    return (self->inputs.edge == (uint8_t)GUARD_SET) && (self->inputs.requested_trip == self->trip.number);
}

static void leave_waiting(guard_t *self, bool fresh, uint64_t now_us) {
    const bool tripped = self->detector.tripped || self->explained.tripped;
    const bool acknowledged = self->acknowledged == (uint8_t)GUARD_SET;
    if (fresh && !tripped && healthy_for_long_enough(self, now_us) && (acknowledged || is_reset(self))) {
        self->inputs.edge = acknowledged ? self->inputs.edge : (uint8_t)GUARD_CLEAR;
        self->acknowledged = (uint8_t)GUARD_SET;
        enter(self, GUARD_STATE_MONITORING);
    }
}

static void leave_stopped(guard_t *self, bool fresh, uint64_t now_us) {
    self->calm = self->calm || healthy_for_long_enough(self, now_us);
    if (is_reset(self) && healthy_for_long_enough(self, now_us)) {
        self->inputs.edge = (uint8_t)GUARD_CLEAR;
        self->acknowledged = (uint8_t)GUARD_SET;
        enter(self, GUARD_STATE_WAITING);
        leave_waiting(self, fresh, now_us);
    }
}

static void act(guard_t *self, const guard_finding_t *finding, uint64_t now_us) {
    if (self->state == (uint32_t)GUARD_STATE_FAULT) {
        return; /* FAULT ends with guard_init only */
    }
    track_health(self, finding->healthy, now_us);
    if (finding->wish == WISH_FAULT) {
        trip(self, GUARD_STATE_FAULT, &finding->event);
    } else if (finding->wish == WISH_STOP) {
        trip(self, GUARD_STATE_STOPPED, &finding->event);
    } else if (self->state == (uint32_t)GUARD_STATE_WAITING) {
        leave_waiting(self, finding->fresh, now_us);
    } else if (self->state == (uint32_t)GUARD_STATE_STOPPED) {
        leave_stopped(self, finding->fresh, now_us);
    } else if (finding->tested && (self->state == (uint32_t)GUARD_STATE_SELF_TEST)) {
        stages_init(self);
        enter(self, GUARD_STATE_WAITING);
    } else {
        /* stay */
    }
}

/* What both channels find together. */
static guard_finding_t joined(guard_t *self, const guard_finding_t *finding, const opinion_t *own,
                              const opinion_t *other) {
    guard_finding_t both = *finding;
    both.healthy = finding->healthy && other->healthy;
    both.tested = finding->tested && other->tested;
    both.fresh = finding->fresh && other->fresh;
    const bool agree = agree_step(&self->agree, own, other);
    if (opinion_worse(self->second ? other : own, self->second ? own : other) == other) {
        both.wish = (wish_t)other->wish;
        both.event = opinion_event(other);
    }
    if (!agree && (both.wish != WISH_FAULT)) {
        wish_fault(self, &both, GUARD_REASON_CHANNELS_DISAGREE);
    }
    return both;
}

static void settle(guard_t *self, uint64_t now_us, const guard_finding_t *finding, guard_output_t *out) {
    const bool testing = self->state == (uint32_t)GUARD_STATE_SELF_TEST;
    act(self, finding, now_us);
    if (self->inputs.edge == (uint8_t)GUARD_SET) { /* a request that was not granted */
        count(&self->counters.resets_refused, 1u);
    }
    verdict_fill(self, finding->missing, now_us, out);
    self->inputs.edge = (uint8_t)GUARD_CLEAR;
    if (!testing) { /* frames received during the self-test are for the first tick after it */
        self->inputs.fault = 0;
    }
}

void guard_decide(guard_t *self, uint64_t now_us, const guard_finding_t *finding, const opinion_t *own,
                  const opinion_t *other, guard_output_t *out) {
    const guard_finding_t both = joined(self, finding, own, other);
    settle(self, now_us, &both, out);
}

/* --- the interface ------------------------------------------------------------------------------------------------ */

void guard_refuse(guard_t *self) {
    *self = (guard_t){.inputs = {.request = true, .task_number_inverted = ~(uint32_t)TASK_INVALID},
                      .task_inverted = ~(uint32_t)TASK_INVALID,
                      .restarts = 1u,
                      .company = GUARD_ALONE};
    enter(self, GUARD_STATE_UNINITIALISED);
    report_init(&self->report);
}

guard_status_t guard_init(guard_t *self, const guard_config_t *config) {
    guard_refuse(self);
    const guard_status_t status = config_check(config);
    if (status != GUARD_OK) {
        return status;
    }
    self->config = config;
    self->joints = config->robot.joint_count;
    (void)snapshot_init(&self->inputs.snapshot, self->joints);
    stages_init(self);
    config_watch_start(&self->watch, config);
    enter(self, GUARD_STATE_SELF_TEST);
    return GUARD_OK;
}

void guard_note_start(guard_t *self, guard_start_t cause, uint32_t restarts, guard_variant_t variant) {
    self->start_cause = (uint8_t)cause;
    self->restarts = (uint8_t)((restarts < UINT8_MAX) ? restarts : UINT8_MAX);
    self->variant = (uint8_t)variant;
}

void guard_say(guard_t *self, guard_output_t *out) {
    report_tick(self, out);
}

void guard_tick(guard_t *self, uint64_t now_us, guard_output_t *out) {
    *out = (guard_output_t){.withheld = true};
    if (self->config != NULL) {
        guard_finding_t finding;
        guard_look(self, now_us, &finding);
        settle(self, now_us, &finding, out);
    }
    guard_say(self, out);
}

void guard_note_tick_time(guard_t *self, uint32_t tick_us) {
    self->report.tick_time_us = tick_us;
    self->report.worst_tick_time_us =
        (tick_us > self->report.worst_tick_time_us) ? tick_us : self->report.worst_tick_time_us;
    self->over_budget = self->over_budget || ((self->config != NULL) && (tick_us > self->config->tick_budget_us));
}

void guard_trip(guard_t *self, guard_reason_t reason) {
    note_fault(self, reason, 0u);
}
