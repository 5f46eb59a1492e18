/* firmware/guard/guard_self_test.c: any guard, at any step, with any result of the stages. */
#include "num_stub.h"

#include "crc32.c"
#include "e2e.c"
#include "guard_any.h"
#include "guard_self_test.c"
#include "protocol.c"
#include "stage_stub.h"

void projection_init(projection_t *self) {
    stage(self, sizeof(*self));
}

static void project(projection_t *self, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], const num_t tau[],
                    num_t rejected[]) {
    HOLDS(__CPROVER_r_ok(column, k * sizeof(column[0])), "the columns are readable");
    HOLDS(__CPROVER_r_ok(tau, ROBOT_MAX_JOINTS * sizeof(*tau)), "the torque is readable");
    stage(self, sizeof(*self));
    stage(rejected, ROBOT_MAX_JOINTS * sizeof(*rejected));
}

void projection_hard(projection_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS],
                     num_t tolerance, const num_t tau[], num_t rejected[]) {
    project(self, k, column, tau, rejected);
}

void projection_soft(projection_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t s,
                     const num_t tau[], num_t rejected[], uint32_t first, num_t first_rejected[]) {
    HOLDS((s >= NUM(SOFT_MIN)) && (s <= NUM(1)), "a softness");
    project(self, k, column, tau, rejected);
}

/* guard_stages.c */
void stages_init(guard_t *self) {
    index_init(&self->index);
    detector_init(&self->detector);
}

void stages_step(guard_t *self, const task_config_t *task, const snapshot_t *snapshot, uint32_t gap,
                 vec3_t acceleration) {
    HOLDS(gap <= CONFIG_MAX_GAP, "the observer has constants for the gap");
    HOLDS(__CPROVER_r_ok(task, sizeof(*task)) && __CPROVER_r_ok(snapshot, sizeof(*snapshot)), "task and snapshot");
    observer_init(&self->observer);
    detector_init(&self->detector);
}

void proof_self_test(void) {
    guard_t guard;
    any_guard(&guard);
    for (uint32_t g = 0; g < OBSERVER_MAX_GAP; ++g) {
        ASSUME((any_block.observer.decay[g] > NUM(0)) && (any_block.observer.decay[g] < NUM(1)));
        ASSUME((any_block.observer.gain[g] > NUM(0)) && (any_block.observer.gain[g] < NUM(1)));
    }
    ASSUME((guard.self_test_step < 100000u) && (guard.self_test_remaining >= NUM(0)) &&
           (guard.self_test_remaining <= NUM(2)));
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        ASSUME(any_block.robot.joint[i].torque_max_nm >= NUM(0));
    }
    const self_test_t result = self_test_step(&guard);
    HOLDS((result >= SELF_TEST_FAILED) && (result <= SELF_TEST_PASSED), "an answer");
    REACHED;
}
