/* firmware/guard/guard.c: one tick of any guard, at any time, with any input and any result of the stages. */
#include "proof.h"

#include "e2e.c"
#include "guard.c"
#include "guard_any.h"
#include "guard_contact.c"
#include "guard_events.c"
#include "guard_reason.c"
#include "guard_supervise.c"
#include "guard_verdict.c"
#include "opinion.c"
#include "snapshot.c"
#include "values.c"

/* Stubs with any effect that the real function can have, as other harnesses show. */
bool config_watch_step(const config_watch_t *self, const guard_config_t *config, uint32_t active, uint32_t other) {
    bool intact;
    (void)self;
    (void)config;
    HOLDS((active < TASK_COUNT) && (other < TASK_COUNT), "rows of the block");
    return intact;
}

static void set_any_results(guard_t *self) {
    guard_t any;
    self->detector = any.detector;
    self->explained = any.explained;
    self->plausibility = any.plausibility;
    self->index = any.index;
    self->observer = any.observer;
    ASSUME(guard_is_sound(self));
}

void stages_init(guard_t *self) {
    set_any_results(self);
}

static bool stages_ran;

void stages_run(guard_t *self) {
    guard_t any;
    ASSUME(any.task < (uint32_t)TASK_COUNT);
    (void)snapshot_take(&self->inputs.snapshot);
    self->task = any.task;
    self->task_inverted = ~any.task;
    self->task_cycles = any.task_cycles;
    self->settled_cycles = any.settled_cycles;
    set_any_results(self);
    stages_ran = true;
}

bool stages_complete(const guard_t *self) {
    bool complete;
    (void)self;
    return complete;
}

bool stages_valid(const guard_t *self) {
    bool valid;
    (void)self;
    return valid;
}

bool stages_saturated(guard_t *self) {
    bool saturated;
    (void)self;
    return saturated;
}

self_test_t self_test_step(guard_t *self) {
    self_test_t result;
    set_any_results(self);
    return result;
}

void rise_start(rise_t *self, uint64_t now_us) {
    *self = (rise_t){.begun_us = now_us};
}

bool rise_step(rise_t *self, const detector_t *detector, uint32_t joints, uint64_t now_us) {
    rise_t any;
    bool rising;
    (void)detector;
    (void)now_us;
    ASSUME((any.joint < joints) && (any.snapshots <= 3u));
    *self = any;
    return rising;
}

void report_tick(guard_t *guard, guard_output_t *out) {
    guard_report_t any;
    (void)out;
    guard->report = any;
}

void report_init(guard_report_t *self) {
    guard_report_t any;
    *self = any;
}

void locate_init(locate_t *self) {
    locate_t any;
    *self = any;
}

void locate_begin(locate_t *self, uint32_t joints, uint32_t ticks, const num_t threshold[]) {
    locate_t any;
    HOLDS((joints >= 1u) && (joints <= ROBOT_JOINTS), "the joints of the arm");
    HOLDS((ticks >= 1u) && (ticks <= (uint32_t)INT32_MAX), "a time of at least one tick");
    HOLDS(__CPROVER_r_ok(threshold, joints * sizeof(*threshold)), "a threshold of each joint");
    *self = any;
}

bool locate_step(locate_t *self, const lever_config_t *shape, uint32_t joints, motion_t *motion,
                 const observer_t *observer, const index_t *index, const explained_t *explained, bool calm) {
    locate_t any;
    bool done;
    uint32_t watched;
    HOLDS((joints >= 1u) && (joints <= ROBOT_JOINTS) && (index->columns <= SUBSPACE_MAX_COLUMNS), "an arm and a task");
    HOLDS(__CPROVER_r_ok(shape, sizeof(*shape)) && __CPROVER_r_ok(observer, sizeof(*observer)), "shape and observer");
    HOLDS(__CPROVER_r_ok(explained, sizeof(*explained)), "the coefficients");
    (void)calm;
    *self = any;
    motion->watched = watched;
    return done;
}

void note_fault(guard_t *self, guard_reason_t reason, uint32_t joint) {
    uint32_t any;
    (void)reason;
    (void)joint;
    ASSUME(any != (uint32_t)GUARD_REASON_NONE); /* proof_reasons */
    self->inputs.fault = any;
}

void config_watch_start(config_watch_t *self, const guard_config_t *config) {
    config_watch_t any;
    (void)config;
    *self = any;
}

guard_status_t config_check(const guard_config_t *config) {
    guard_status_t status;
    ASSUME((status != GUARD_OK) ||
           ((config->robot.joint_count >= 1u) && (config->robot.joint_count <= ROBOT_MAX_JOINTS)));
    return status;
}

/* proof_guard_opinion.c */
guard_event_t opinion_event(const opinion_t *opinion) {
    guard_event_t event;
    event.reason = (guard_reason_t)opinion->reason;
    event.joint = opinion->joint;
    event.category = opinion->category;
    return event;
}

void proof_tick(void) {
    guard_t guard;
    guard_output_t out;
    uint64_t now_us;
    any_guard(&guard);
    guard_tick(&guard, now_us, &out);
    HOLDS(guard_is_sound(&guard), "the guard stays sound");
    REACHED;
}

/* Permission implies MONITORING, every input fresh, the last complete snapshot evaluated, and no trip latched. */
void proof_permission(void) {
    guard_t guard;
    guard_output_t out;
    uint64_t now_us;
    any_guard(&guard);
    const bool complete = snapshot_is_complete(&guard.inputs.snapshot);
    const uint32_t fault = guard.inputs.fault;
    const uint32_t before = guard.state;
    stages_ran = false;
    guard_tick(&guard, now_us, &out);
    if (out.permitted) {
        const guard_inputs_t *const in = &guard.inputs;
        HOLDS(guard.state == (uint32_t)GUARD_STATE_MONITORING, "MONITORING");
        HOLDS((before == (uint32_t)GUARD_STATE_MONITORING) || (before == (uint32_t)GUARD_STATE_WAITING) ||
                  (before == (uint32_t)GUARD_STATE_STOPPED),
              "from a state that has passed the self-test");
        HOLDS(in->sync.seen && ((now_us - in->sync.good_us) <= any_block.sync_deadline_us), "Sync is fresh");
        HOLDS(in->joints.seen && ((now_us - in->joints.good_us) <= any_block.joint_deadline_us),
              "the evaluated snapshot is fresh");
        HOLDS(in->task.seen && ((now_us - in->task.good_us) <= any_block.task_deadline_us), "the task is fresh");
        HOLDS(!complete || (stages_ran && guard.evaluated), "a complete snapshot was evaluated in this tick");
        HOLDS(complete || !out.fresh, "a snapshot marked as fresh is fresh");
        HOLDS(fault == 0u, "no fault was noted");
        HOLDS(!guard.detector.tripped && !guard.explained.tripped, "nothing trips");
        HOLDS(guard.plausibility.fault == 0u, "the readings are plausible");
    }
    REACHED;
}

void proof_permission_needs_a_settled_observer(void) {
    guard_t guard;
    guard_output_t out;
    uint64_t now_us;
    any_guard(&guard);
    ASSUME(any_block.period_us == 1000u); /* one product for CBMC: the comparison is the same at every period */
    guard_tick(&guard, now_us, &out);
    HOLDS(!out.permitted || is_settled(&guard), "the observer has settled");
    REACHED;
}

/* A trip latches: STOPPED is left only by a GuardReset that names the trip, as an edge, after good inputs; FAULT never.
 */
void proof_trip_latches(void) {
    guard_t guard;
    guard_output_t out;
    uint64_t now_us;
    any_guard(&guard);
    const uint32_t before = guard.state;
    const bool edge = guard.inputs.edge == (uint8_t)GUARD_SET;
    const uint8_t requested = guard.inputs.requested_trip;
    const uint8_t number = guard.trip.number;
    const uint32_t fault = guard.inputs.fault;
    guard_tick(&guard, now_us, &out);
    HOLDS((before != (uint32_t)GUARD_STATE_FAULT) || (guard.state == before), "FAULT is not left");
    HOLDS((before != (uint32_t)GUARD_STATE_FAULT) || !out.permitted, "FAULT permits nothing");
    if ((before == (uint32_t)GUARD_STATE_STOPPED) && (guard.state != before)) {
        const bool failed = guard.state == (uint32_t)GUARD_STATE_FAULT;
        HOLDS(failed || (edge && (requested == number)), "only by a reset that names the trip");
        HOLDS(failed || (fault == 0u), "only without a fault");
        HOLDS(failed || ((now_us - guard.healthy_since_us) >= any_block.reset_healthy_us), "only after good inputs");
    }
    if ((before != (uint32_t)GUARD_STATE_MONITORING) && (guard.state == (uint32_t)GUARD_STATE_MONITORING)) {
        HOLDS(guard.acknowledged == (uint8_t)GUARD_SET, "no permission without a reset since the start");
    }
    HOLDS(guard.inputs.edge == (uint8_t)GUARD_CLEAR, "an edge is for one tick");
    REACHED;
}

/* The contract of contact_note_trip, which proof_contact_note_trip proves free of undefined behaviour: it changes the
 * record of the contact and the search of the blind links, and nothing else. */
void stub_note_trip(guard_t *self, const guard_event_t *event) {
    guard_contact_t contact;
    sight_t sight;
    HOLDS(__CPROVER_r_ok(event, sizeof(*event)) && (self->config->period_us >= CONFIG_PERIOD_MIN_US), "a valid block");
    self->contact = contact;
    self->sight.axis = sight.axis;
    self->sight.seen = sight.seen;
}

void proof_contact_note_trip(void) {
    guard_t guard;
    guard_event_t event;
    any_guard(&guard);
    contact_note_trip(&guard, &event);
    HOLDS(guard_is_sound(&guard), "the guard stays sound");
    REACHED;
}

/* One of two channels: it permits only what both want, and a disagreement is FAULT. */
void proof_decide(void) {
    guard_t guard;
    guard_finding_t finding;
    opinion_t own, other;
    guard_output_t out;
    uint64_t now_us;
    any_guard(&guard);
    ASSUME((finding.wish >= WISH_FAULT) && (finding.wish <= WISH_GO_ON) && (other.wish <= (uint8_t)WISH_GO_ON));
    ASSUME((finding.missing >= INPUT_NONE) && (finding.missing < INPUT_COUNT));
    ASSUME(own.wish == (uint8_t)finding.wish); /* proof_tell */
    const uint32_t before = guard.state;
    const bool edge = guard.inputs.edge == (uint8_t)GUARD_SET;
    const uint8_t requested = guard.inputs.requested_trip;
    const uint8_t number = guard.trip.number;
    guard_decide(&guard, now_us, &finding, &own, &other, &out);
    HOLDS(!out.permitted || (guard.state == (uint32_t)GUARD_STATE_MONITORING), "permission implies MONITORING");
    HOLDS(!out.permitted || ((finding.wish == WISH_GO_ON) && (other.wish == (uint8_t)WISH_GO_ON)), "both continue");
    HOLDS(!out.permitted || ((own.trip_number == other.trip_number) && (own.task == other.task)), "both agree");
    HOLDS((own.trip_number == other.trip_number) || (guard.state == (uint32_t)GUARD_STATE_FAULT),
          "a disagreement is FAULT");
    HOLDS((before != (uint32_t)GUARD_STATE_FAULT) || (guard.state == before), "FAULT is not left");
    if ((before != (uint32_t)GUARD_STATE_MONITORING) && (guard.state == (uint32_t)GUARD_STATE_MONITORING)) {
        HOLDS(finding.fresh && other.fresh && finding.healthy && other.healthy, "only if both are ready");
        HOLDS(guard.acknowledged == (uint8_t)GUARD_SET, "no permission without a reset since the start");
    }
    if ((before == (uint32_t)GUARD_STATE_STOPPED) && (guard.state != before)) {
        HOLDS((guard.state == (uint32_t)GUARD_STATE_FAULT) || (edge && (requested == number)),
              "only by a reset that names the trip");
    }
    HOLDS(guard_is_sound(&guard), "the guard stays sound");
    REACHED;
}

void proof_guard_init(void) {
    guard_t guard;
    guard_config_t block;
    guard_output_t out;
    uint64_t now_us;
    const guard_status_t status = guard_init(&guard, &block);
    if (status != GUARD_OK) {
        guard_tick(&guard, now_us, &out);
        HOLDS(!out.permitted && out.withheld, "without a block there is no permission");
        HOLDS(guard.config == 0, "a refused block is not used");
    } else {
        HOLDS(guard.state == (uint32_t)GUARD_STATE_SELF_TEST, "a guard begins with its self-test");
        HOLDS(guard.acknowledged == (uint8_t)GUARD_CLEAR, "the first permission needs a reset");
    }
    REACHED;
}

void proof_notes(void) {
    guard_t guard;
    guard_start_t cause;
    guard_variant_t variant;
    guard_reason_t reason;
    uint32_t restarts, tick_us;
    any_guard(&guard);
    guard_note_start(&guard, cause, restarts, variant);
    guard_note_tick_time(&guard, tick_us);
    HOLDS((tick_us <= any_block.tick_budget_us) || guard.over_budget, "a tick over its budget is noted");
    guard_trip(&guard, reason);
    REACHED;
}

void proof_contact_init(void) {
    guard_contact_t contact;
    contact_init(&contact);
    HOLDS((contact.kind == (uint8_t)CONTACT_CLASS_UNKNOWN) && !contact.touching, "no contact yet");
    REACHED;
}
