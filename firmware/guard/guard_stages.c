#include "guard_parts.h"

void stages_run(guard_t *self) {
    const guard_config_t *const config = self->config;
    const robot_t *const robot = &config->robot;
    snapshot_t *const snapshot = &self->inputs.snapshot;
    const task_config_t *const task = &config->task[self->inputs.task_number];
    const uint32_t gap = snapshot_take(snapshot);

    motion_step(&self->motion, robot, snapshot->position, snapshot->velocity);
    self->stages |= STAGE_MOTION;
    sensor_correct(&config->sensor, robot->joint_count, snapshot->velocity, snapshot->torque, snapshot->torque);
    observer_step(&self->observer, &config->observer, robot->joint_count, &self->motion, snapshot->torque, gap);
    self->stages |= STAGE_OBSERVER;
    if (self->inputs.task_number != (uint8_t)TASK_INVALID) {
        index_step(&self->index, &config->subspace, (index_kind_t)task->index, robot, &self->motion, &self->observer,
                   self->inputs.acceleration);
        self->stages |= STAGE_INDEX;
        detector_step(&self->detector, task, robot->joint_count, self->index.value);
        self->stages |= STAGE_DETECTOR;
    }
}

bool stages_valid(const guard_t *self) {
    bool holds = (self->index.kind == (uint32_t)INDEX_OFF) || self->index.subspace.converged;
    for (uint32_t i = 0; i < self->joints; ++i) {
        holds = holds && num_finite(self->observer.residual[i]) && num_finite(self->index.value[i]);
    }
    return holds;
}

bool stages_complete(const guard_t *self) {
    const bool with_task = self->inputs.task_number != (uint8_t)TASK_INVALID;
    return self->stages == (with_task ? (uint32_t)STAGE_ALL : (uint32_t)(STAGE_MOTION | STAGE_OBSERVER));
}

bool stages_saturated(guard_t *self) {
    const uint32_t sum = self->motion.saturations + self->observer.saturations + self->index.saturations +
                         self->index.subspace.saturations;
    const bool grew = sum != self->saturations;
    self->saturations = sum;
    return grew;
}
