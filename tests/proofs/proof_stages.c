/* firmware/guard/guard_stages.c: any guard with a complete snapshot. The stages are stubs with any result.
 */
#include "num_stub.h"

#include "guard_any.h"
#include "guard_stages.c"
#include "sensor.c"
#include "snapshot.c"
#include "stage_stub.h"

void contact_init(guard_contact_t *self) {
    stage(self, sizeof(*self));
}

void plausibility_init(plausibility_t *self) {
    stage(self, sizeof(*self));
}

void plausibility_step(plausibility_t *self, const observer_config_t *gains, uint32_t joints, uint32_t gap,
                       const snapshot_t *snapshot, const motion_t *motion) {
    stage(self, sizeof(*self));
}

void proof_stages_run(void) {
    guard_t guard;
    any_guard(&guard);
    ASSUME(snapshot_is_complete(&guard.inputs.snapshot));
    stages_run(&guard);
    HOLDS(guard.task < (uint32_t)TASK_COUNT, "a task of the block");
    HOLDS(!snapshot_is_complete(&guard.inputs.snapshot), "the snapshot is evaluated");
    REACHED;
}

/* projection.c */
uint32_t projection_saturations(const projection_t *self) {
    uint32_t saturations;
    (void)self;
    return saturations;
}

void proof_stages_judge(void) {
    guard_t guard;
    any_guard(&guard);
    (void)stages_complete(&guard);
    (void)stages_valid(&guard);
    (void)stages_saturated(&guard);
    stages_init(&guard);
    REACHED;
}
