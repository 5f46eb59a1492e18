/* firmware/guard/guard_events.c, guard_verdict.c, guard_supervise.c: with any guard, at any time. */
#include "proof.h"

#include "e2e.c"
#include "guard_any.h"
#include "guard_events.c"
#include "guard_reason.c"
#include "guard_supervise.c"
#include "guard_verdict.c"
#include "snapshot.c"
#include "values.c"

/* proof_config.c proves the contract of this stub. */
bool config_watch_step(const config_watch_t *self, const guard_config_t *config, uint32_t active, uint32_t other) {
    bool intact;
    (void)self;
    (void)config;
    HOLDS((active < TASK_COUNT) && (other < TASK_COUNT), "rows of the block");
    return intact;
}

void proof_missing_input(void) {
    guard_t guard;
    uint64_t now_us;
    any_guard(&guard);
    const input_t missing = missing_input(&guard, now_us);
    HOLDS((missing >= INPUT_NONE) && (missing < INPUT_COUNT), "a known input");
    HOLDS((missing != INPUT_NONE) || ((now_us - guard.inputs.sync.good_us) <= guard.config->sync_deadline_us),
          "an old Sync is missing");
    HOLDS((missing != INPUT_NONE) || ((now_us - guard.inputs.joints.good_us) <= guard.config->joint_deadline_us),
          "an old snapshot is missing");
    HOLDS((missing != INPUT_NONE) || ((now_us - guard.inputs.task.good_us) <= guard.config->task_deadline_us),
          "an old task is missing");
    HOLDS(missing_joint(&guard.inputs.snapshot) <= ROBOT_MAX_JOINTS, "a joint or zero");
    REACHED;
}

void proof_events(void) {
    guard_t guard;
    uint64_t now_us;
    bool saturated;
    input_t missing;
    any_guard(&guard);
    ASSUME((missing >= INPUT_NONE) && (missing < INPUT_COUNT));
    (void)input_event(&guard, missing, saturated);
    (void)contact_event(&guard);
    (void)is_settled(&guard);
    (void)healthy_for_long_enough(&guard, now_us);
    REACHED;
}

void proof_verdict(void) {
    guard_t guard;
    guard_output_t out;
    uint64_t now_us;
    input_t missing;
    any_guard(&guard);
    ASSUME((missing >= INPUT_NONE) && (missing < INPUT_COUNT));
    verdict_fill(&guard, missing, now_us, &out);
    HOLDS(!out.permitted || (guard.state == (uint32_t)GUARD_STATE_MONITORING), "permission implies MONITORING");
    /* The inverted copy permits only on its own checks. */
    const guard_inputs_t *const in = &guard.inputs;
    HOLDS(out.withheld || (in->sync.seen && ((now_us - in->sync.good_us) <= any_block.sync_deadline_us)),
          "Sync is fresh");
    HOLDS(out.withheld || (in->joints.seen && ((now_us - in->joints.good_us) <= any_block.joint_deadline_us)),
          "the evaluated snapshot is fresh");
    HOLDS(out.withheld || (in->task.seen && ((now_us - in->task.good_us) <= any_block.task_deadline_us)),
          "the task is fresh");
    HOLDS(out.withheld || ((in->fault == 0u) && !guard.detector.tripped && !guard.explained.tripped), "nothing trips");
    HOLDS(out.withheld || (guard.acknowledged == (uint8_t)GUARD_SET), "a reset was received since the start");
    REACHED;
}

/* No assumption on the state, because guard_supervise is the check of the state. */
void proof_supervise(void) {
    guard_t guard;
    guard_config_t block;
    uint64_t now_us;
    assume_block(&block);
    guard.config = &block;
    ASSUME(guard.joints < 32u);
    const uint64_t before_us = guard.last_tick_us;
    const bool ticked = guard.ticked;
    const guard_reason_t reason = supervise(&guard, now_us);
    if (reason == GUARD_REASON_NONE) {
        HOLDS(guard.state == ~guard.state_inverted, "the state is the inverse of its copy");
        HOLDS(guard.joints == block.robot.joint_count, "loops run over the block's joints");
        HOLDS(!ticked || (now_us >= before_us), "time does not run backwards");
        HOLDS(!ticked || ((now_us - before_us) <= block.tick_deadline_us), "the tick is not late");
        HOLDS(snapshot_is_valid(&guard.inputs.snapshot), "the snapshot is valid");
    }
    REACHED;
}
