/* guard_parts: how guard.c is divided. For the files of this folder only. */
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
