/* guard_parts: the parts of the guard. For the files of this folder only. */
#ifndef TAUPERP_GUARD_PARTS_H
#define TAUPERP_GUARD_PARTS_H

#include "guard.h"

static inline void count(uint16_t *counter, uint32_t more) {
    const uint32_t room = (uint32_t)UINT16_MAX - *counter;
    *counter = (uint16_t)(*counter + ((more < room) ? more : room));
}

/* guard_stages.c: one snapshot through the stages. */
void stages_init(guard_t *self);

/* Takes the snapshot, which must be complete, and runs every stage on it with the active task. */
void stages_run(guard_t *self);

/* The same for any snapshot and task; the self-test uses it too. gap: as for observer_step. */
void stages_step(guard_t *self, const task_config_t *task, const snapshot_t *snapshot, uint32_t gap,
                 vec3_t acceleration);

/* True if every stage ran on the last snapshot. */
bool stages_complete(const guard_t *self);

/* True if every result of this tick is a finite number, and the projection converged. */
bool stages_valid(const guard_t *self);

/* True if a fixed-point result saturated since the last call. Updates guard_t.saturations. */
bool stages_saturated(guard_t *self);

/* guard_plausible.c: compares position with velocity, and detects frozen torque readings. Call it after motion_step of
 * the same snapshot. `fault` and `joint` report the first faulty joint. Cost: about 15 products per joint. */
void plausibility_init(plausibility_t *self);
void plausibility_step(plausibility_t *self, const observer_config_t *gains, uint32_t joints, uint32_t gap,
                       const snapshot_t *snapshot, const motion_t *motion);

/* guard_rise.c: whether a contact has grown since the trip, on any joint. For 0.5 s each joint's largest index counts
 * as the first contact, after that its smallest. 1.5 times this plus one threshold, in 3 snapshots, is a second
 * contact. One step per evaluated snapshot while STOPPED; `joint` names the joint. Cost: one quotient per joint. */
void rise_start(rise_t *self, uint64_t now_us);
bool rise_step(rise_t *self, const detector_t *detector, uint32_t joints, uint64_t now_us);

/* guard_receive.c: records a fault for the next tick. Of several, the worst class stays; within a class, the first. */
void note_fault(guard_t *self, guard_reason_t reason, uint32_t joint);

/* guard_events.c: the deadlines, and what ends a permission. */

/* The first input that is past its deadline or was never received. Checks all of them, for the report's margin. */
input_t missing_input(guard_t *self, uint64_t now_us);

/* False if the input is past its deadline in cycles. This check does not depend on the clock. */
bool joints_in_cycles(const guard_t *self);
bool task_in_cycles(const guard_t *self);

/* The first joint, 1 to n, whose reading of the current cycle is missing; 0 if none is. */
uint32_t missing_joint(const snapshot_t *snapshot);

/* True if the observer has run for its settling time: it then includes forces that already act on the arm. */
bool is_settled(const guard_t *self);

/* True if every input was good and nothing above its limits for reset_healthy_us. */
bool healthy_for_long_enough(const guard_t *self, uint64_t now_us);

/* The task in force needs a link for which its index is blind. */
bool is_blind(const guard_t *self);

guard_event_t contact_event(const guard_t *self);
guard_event_t input_event(const guard_t *self, input_t missing, bool saturated);

/* guard_contact.c: what the collision was. contact_step once per evaluated snapshot, contact_note_trip at each trip. */
void contact_init(guard_contact_t *self);
void contact_note_trip(guard_t *self, const guard_event_t *event);
void contact_step(guard_t *self);

/* guard_verdict.c: the output of this tick, and the second computation of the permission. */
void verdict_fill(const guard_t *self, input_t missing, uint64_t now_us, guard_output_t *out);

/* guard_opinion.c: the reason for which a channel ends the permission of both. */
guard_event_t opinion_event(const opinion_t *opinion);

/* guard_supervise.c: the guard's checks of itself. Returns GUARD_REASON_NONE, or the reason of a FAULT. Call it once
 * per tick, before anything else. */
guard_reason_t supervise(guard_t *self, uint64_t now_us);

/* guard_report.c: fills the frames of `out` from the verdict and the state. */
void report_init(guard_report_t *self);
void report_tick(guard_t *guard, guard_output_t *out);

/* guard_self_test.c: one step per tick. */
typedef enum { SELF_TEST_FAILED = 0, SELF_TEST_RUNNING = 1, SELF_TEST_PASSED = 2 } self_test_t;

/* Known answers of the CRC, the E2E check, the projection and the motion pass; then of the whole chain: a push on one
 * joint after the other, which every stage must pass on to the detector. Leaves the stages as after stages_init. Cost:
 * at most that of one tick. */
self_test_t self_test_step(guard_t *self);

#endif
