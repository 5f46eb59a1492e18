#include "index.h"

#include "token.h"
#include "vec3.h"

enum { LINEAR = 0, ANGULAR = 3 }; /* first rows of the Jacobian's two halves */

void index_init(index_t *self) {
    *self = (index_t){0};
}

/* column <- Jv^T force, zero behind the last joint as the Jacobian is. */
static __attribute__((noinline)) void force_column(const motion_t *motion, vec3_t force, num_t column[],
                                                   uint32_t *saturations) {
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        column[i] = num_narrow(num_wide(motion->jacobian[LINEAR][i], force.x) +
                                   num_wide(motion->jacobian[LINEAR + 1][i], force.y) +
                                   num_wide(motion->jacobian[LINEAR + 2][i], force.z),
                               saturations);
    }
}

/* column <- scale row. */
static __attribute__((noinline)) void row_column(const num_t row[], num_t scale, num_t column[],
                                                 uint32_t *saturations) {
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        column[i] = num_mul(scale, row[i], saturations);
    }
}

/* Moments first, and the acceleration last: its column is often zero, and there the projection finds out at no cost. */
static uint32_t payload_columns(index_t *self, num_t lever, const robot_t *robot, const motion_t *motion,
                                vec3_t sideways) {
    uint32_t *const sat = &self->saturations;
    for (uint32_t axis = 0; axis < 3u; ++axis) {
        row_column(motion->jacobian[ANGULAR + axis], lever, self->column[axis], sat);
    }
    force_column(motion, vec3_unit(robot->gravity, sat), self->column[INDEX_FORCE_COLUMN], sat);
    force_column(motion, sideways, self->column[INDEX_FORCE_COLUMN + 1u], sat);
    return INDEX_FORCE_COLUMN + 2u;
}

/* Each chosen row of the Jacobian, force and moment of one axis beside each other. */
static uint32_t contact_columns(index_t *self, num_t lever, uint32_t components, const motion_t *motion) {
    uint32_t count = 0;
    for (uint32_t component = 0; component < INDEX_COMPONENTS; ++component) {
        if ((components & (1u << component)) != 0u) {
            row_column(motion->jacobian[component], (component < (uint32_t)ANGULAR) ? NUM(1) : lever,
                       self->column[count], &self->saturations);
            ++count;
        }
    }
    return count;
}

void index_step(index_t *self, const subspace_config_t *config, const index_config_t *task, const robot_t *robot,
                const motion_t *motion, const observer_t *observer, const acceleration_t *acceleration) {
    const bool project_first = config->order == (uint32_t)ORDER_PROJECT_FIRST;
    const num_t *const torque = project_first ? observer->update : observer->residual;
    self->token = token_next(acceleration->token, TOKEN_INDEX, 0u);
    self->kind = task->kind;
    self->columns = 0;
    if (task->kind == (uint32_t)INDEX_PAYLOAD) {
        self->columns = payload_columns(self, config->lever_m, robot, motion, acceleration->sideways);
    } else if (task->kind == (uint32_t)INDEX_CONTACT) {
        self->columns = contact_columns(self, config->lever_m, task->components, motion);
    } else {
        /* nothing is explained */
    }
    subspace_step(&self->subspace, robot->joint_count, self->columns, (const num_t(*)[ROBOT_MAX_JOINTS])self->column,
                  config->tolerance);
    subspace_reject(&self->subspace, torque, self->unexplained);
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        self->explained[i] = num_subtract(torque[i], self->unexplained[i], &self->saturations);
    }
}
