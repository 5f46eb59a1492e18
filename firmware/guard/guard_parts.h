/* guard_parts: how the guard is divided. For the files of this folder only. */
#ifndef TAUPERP_GUARD_PARTS_H
#define TAUPERP_GUARD_PARTS_H

#include "guard.h"

static inline void count(uint16_t *counter, uint32_t more) {
    const uint32_t room = (uint32_t)UINT16_MAX - *counter;
    *counter = (uint16_t)(*counter + ((more < room) ? more : room));
}

/* guard_stages.c: one snapshot through the stages. */
void stages_init(guard_t *self);

/* Takes the snapshot, which must be complete, and runs every stage on it with the task in force. */
void stages_run(guard_t *self);

/* The same of any snapshot and task: what the self-test runs too. gap as observer_step's. */
void stages_step(guard_t *self, const task_config_t *task, const snapshot_t *snapshot, uint32_t gap,
                 vec3_t acceleration);

/* Every stage ran on the last snapshot. */
bool stages_complete(const guard_t *self);

/* Every result of this tick is a finite number, and the projection converged. */
bool stages_valid(const guard_t *self);

/* True if a fixed-point result did not fit since the last call. Updates guard_t.saturations. */
bool stages_saturated(guard_t *self);

/* guard_plausible.c: position against velocity, and torque readings that stand still. After motion_step of the same
 * snapshot; `fault` and `joint` tell the first joint that is wrong. Cost: about 15 products a joint. */
void plausibility_init(plausibility_t *self);
void plausibility_step(plausibility_t *self, const observer_config_t *gains, uint32_t joints, uint32_t gap,
                       const snapshot_t *snapshot, const motion_t *motion);

/* guard_rise.c: has a contact grown since the trip, on any joint? For 0.5 s each joint's largest index counts as the
 * first contact; later its smallest one does, and 1.5 times it plus one threshold, in 3 snapshots, is a second contact.
 * One step per evaluated snapshot while STOPPED; `joint` names it. Cost: one quotient a joint. */
void rise_start(rise_t *self, uint64_t now_us);
bool rise_step(rise_t *self, const detector_t *detector, uint32_t joints, uint64_t now_us);

/* guard_receive.c: notes a fault for the next tick; of several, the worse class and then the first one stays. */
void note_fault(guard_t *self, guard_reason_t reason, uint32_t joint);

/* The inputs that have a deadline, in the order in which they are reported missing. */
typedef enum { INPUT_NONE = 0, INPUT_SYNC = 1, INPUT_JOINTS = 2, INPUT_TASK = 3, INPUT_COUNT = 4 } input_t;

/* Why a permission ends. */
typedef struct {
    guard_reason_t reason; /* GUARD_REASON_NONE: it goes on */
    uint32_t joint;        /* 1 to n, or 0 */
    uint32_t category;
    num_t value_nm;
    num_t threshold_nm;
} guard_event_t;

/* guard_events.c: the deadlines, and what ends a permission. */

/* The first input that is past its deadline, or has not come yet. Looks at all of them, for the report's margin. */
input_t missing_input(guard_t *self, uint64_t now_us);

/* A deadline counts in cycles too, so that it holds whatever the clock does. False: the input is past it. */
bool joints_in_cycles(const guard_t *self);
bool task_in_cycles(const guard_t *self);

/* The first joint, 1 to n, whose reading of the current cycle is not in; 0 if none is missing. */
uint32_t missing_joint(const snapshot_t *snapshot);

/* The observer has run for its settling time, so that it sees what already leans on the arm. */
bool is_settled(const guard_t *self);

/* Every input was good and nothing above its limits for reset_healthy_us. */
bool healthy_for_long_enough(const guard_t *self, uint64_t now_us);

guard_event_t contact_event(const guard_t *self);
guard_event_t input_event(const guard_t *self, input_t missing, bool saturated);

/* guard_verdict.c: what this tick says, and the second opinion on it. */
void verdict_fill(const guard_t *self, input_t missing, uint64_t now_us, guard_output_t *out);

/* guard_supervise.c: the guard's supervision of itself. Returns GUARD_REASON_NONE, or why the guard cannot be trusted
 * any more: a reason of FAULT. Once per tick, before anything else. */
guard_reason_t supervise(guard_t *self, uint64_t now_us);

/* guard_report.c: fills the frames of `out` from its verdict and the state. */
void report_init(guard_report_t *self);
void report_tick(guard_t *guard, guard_output_t *out);

/* guard_self_test.c: one step per tick. */
typedef enum { SELF_TEST_FAILED = 0, SELF_TEST_RUNNING = 1, SELF_TEST_PASSED = 2 } self_test_t;

/* Known answers of the CRC, the E2E check, the projection and the motion pass, then of the whole chain: a push that
 * every stage must pass on to the detector, on one joint after the other. Leaves the stages as after stages_init. Cost:
 * at most one tick's. */
self_test_t self_test_step(guard_t *self);

#endif
