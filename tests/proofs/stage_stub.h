/* stage_stub: the stages as stubs with any result, for harnesses of the code that calls them. */
#ifndef TAUPERP_STAGE_STUB_H
#define TAUPERP_STAGE_STUB_H

#include "guard_parts.h"
#include "proof.h"

static void stage(void *self, uint32_t size) {
    HOLDS(__CPROVER_w_ok(self, size), "the stage is writable");
    __CPROVER_havoc_slice(self, size);
}

void motion_init(motion_t *self) {
    stage(self, sizeof(*self));
}

void motion_step(motion_t *self, const robot_t *robot, const num_t q[], const num_t qd[]) {
    HOLDS(__CPROVER_r_ok(q, robot->joint_count * sizeof(*q)) && __CPROVER_r_ok(qd, sizeof(*qd)),
          "the readings are readable");
    stage(self, sizeof(*self));
}

void observer_init(observer_t *self) {
    stage(self, sizeof(*self));
}

void observer_step(observer_t *self, const observer_config_t *config, uint32_t joints, const motion_t *motion,
                   const num_t torque[], uint32_t gap) {
    HOLDS(__CPROVER_r_ok(config, sizeof(*config)) && __CPROVER_r_ok(motion, sizeof(*motion)), "settings");
    HOLDS(__CPROVER_r_ok(torque, joints * sizeof(*torque)), "the readings are readable");
    (void)gap;
    stage(self, sizeof(*self));
}

void acceleration_init(acceleration_t *self) {
    stage(self, sizeof(*self));
}

void acceleration_step(acceleration_t *self, const acceleration_config_t *config, const observer_config_t *gains,
                       const observer_t *observer, const robot_t *robot, const motion_t *motion, const num_t velocity[],
                       vec3_t commanded, num_t mass_max_kg) {
    stage(self, sizeof(*self));
}

void regressor_init(regressor_t *self) {
    stage(self, sizeof(*self));
}

void regressor_step(regressor_t *self, const regressor_config_t *config, const observer_config_t *gains,
                    const robot_t *robot, const motion_t *motion, const observer_t *observer,
                    const acceleration_t *acceleration, const num_t velocity[]) {
    stage(self, sizeof(*self));
}

void index_init(index_t *self) {
    stage(self, sizeof(*self));
    ASSUME(self->columns <= SUBSPACE_MAX_COLUMNS);
}

void index_step(index_t *self, const subspace_config_t *config, const index_config_t *task, const robot_t *robot,
                const motion_t *motion, const observer_t *observer, const acceleration_t *acceleration,
                const regressor_t *regressor) {
    stage(self, sizeof(*self));
    ASSUME(self->columns <= SUBSPACE_MAX_COLUMNS);
}

void explained_init(explained_t *self) {
    stage(self, sizeof(*self));
}

void explained_step(explained_t *self, const explained_config_t *limits, const subspace_config_t *config,
                    uint32_t debounce_ticks, const robot_t *robot, const observer_t *observer,
                    const acceleration_t *acceleration, const index_config_t *task, const index_t *index) {
    stage(self, sizeof(*self));
}

void bank_init(bank_t *self) {
    stage(self, sizeof(*self));
}

void bank_step(bank_t *self, const bank_config_t *config, uint32_t joints, uint32_t gap, const num_t unexplained[],
               const num_t sudden[], uint32_t token) {
    stage(self, sizeof(*self));
}

void detector_init(detector_t *self) {
    stage(self, sizeof(*self));
}

void detector_step(detector_t *self, const detector_config_t *task, uint32_t joints, const bank_t *bank) {
    HOLDS(__CPROVER_r_ok(task, sizeof(*task)), "the task's row is readable");
    stage(self, sizeof(*self));
}

void sight_init(sight_t *self, uint32_t joints) {
    (void)joints;
    stage(self, sizeof(*self));
}

void sight_step(sight_t *self, const sight_config_t *config, const lever_config_t *shape, uint32_t joints,
                motion_t *motion, index_t *index, const bank_config_t *bank, const detector_config_t *task,
                uint32_t token) {
    HOLDS(__CPROVER_r_ok(task, sizeof(*task)), "the task's row is there");
    stage(self, sizeof(*self));
    stage(motion, sizeof(*motion));
    stage(index, sizeof(*index));
    ASSUME(index->columns <= SUBSPACE_MAX_COLUMNS);
}

#endif
