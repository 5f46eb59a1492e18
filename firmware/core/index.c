#include "index.h"

#include "token.h"
#include "vec3.h"

enum { LINEAR = 0, ANGULAR = 3 }; /* first rows of the linear and the angular half of the Jacobian */

void index_init(index_t *self) {
    *self = (index_t){0};
}

/* The torque of joint i: three rows of the Jacobian from `first`, times v. */
static num_wide_t along_joint(const motion_t *motion, uint32_t first, uint32_t i, vec3_t v) {
    return num_wide(motion->jacobian[first][i], v.x) + num_wide(motion->jacobian[first + 1u][i], v.y) +
           num_wide(motion->jacobian[first + 2u][i], v.z);
}

/* column = the three rows of the Jacobian from `first`, times v. Entries from joint_count on stay zero. */
static __attribute__((noinline)) void vector_column(const motion_t *motion, uint32_t first, vec3_t v, num_t column[],
                                                    uint32_t *saturations) {
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        column[i] = num_narrow_factor(along_joint(motion, first, i, v), saturations);
    }
}

/* column = scale * row. */
static __attribute__((noinline)) void row_column(const num_t row[], num_t scale, num_t column[],
                                                 uint32_t *saturations) {
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        column[i] = num_mul(scale, row[i], saturations);
    }
}

/* Moments first, acceleration last: its column is often zero, and trailing zero columns cost nothing. */
static uint32_t payload_columns(index_t *self, num_t lever, const robot_t *robot, const motion_t *motion,
                                vec3_t sideways) {
    uint32_t *const sat = &self->saturations;
    for (uint32_t axis = 0; axis < 3u; ++axis) {
        row_column(motion->jacobian[ANGULAR + axis], lever, self->column[axis], sat);
    }
    vector_column(motion, LINEAR, vec3_unit(robot->gravity, sat), self->column[INDEX_FORCE_COLUMN], sat);
    vector_column(motion, LINEAR, sideways, self->column[INDEX_FORCE_COLUMN + 1u], sat);
    return INDEX_FORCE_COLUMN + 2u;
}

uint32_t index_order(const index_config_t *task, uint32_t component[INDEX_COMPONENTS]) {
    const uint32_t part[2] = {task->components & task->fast, task->components & ~task->fast};
    uint32_t count = 0;
    for (uint32_t p = 0; p < 2u; ++p) {
        for (uint32_t c = 0; c < INDEX_COMPONENTS; ++c) {
            if ((part[p] & (1u << c)) != 0u) {
                component[count] = c;
                ++count;
            }
        }
    }
    return count;
}

static vec3_t vec3_of(const num_t v[3]) {
    return (vec3_t){.x = v[0], .y = v[1], .z = v[2]};
}

static vec3_t into_base(const motion_t *motion, vec3_t v, uint32_t *saturations) {
    return (vec3_t){.x = vec3_dot(motion->tool_x, v, saturations),
                    .y = vec3_dot(motion->tool_y, v, saturations),
                    .z = vec3_dot(motion->tool_z, v, saturations)};
}

/* A force along `axis` at the point `arm` equals the same force at the end-effector point and the moment arm x axis. */
static void component_column(const motion_t *motion, bool is_force, vec3_t axis, vec3_t arm, num_t lever,
                             num_t column[], uint32_t *saturations) {
    if (is_force) {
        const vec3_t moment = vec3_cross(arm, axis, saturations);
        for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
            column[i] = num_narrow_factor(
                along_joint(motion, LINEAR, i, axis) + along_joint(motion, ANGULAR, i, moment), saturations);
        }
    } else {
        const vec3_t scaled = {.x = num_mul(lever, axis.x, saturations),
                               .y = num_mul(lever, axis.y, saturations),
                               .z = num_mul(lever, axis.z, saturations)};
        vector_column(motion, ANGULAR, scaled, column, saturations);
    }
}

static uint32_t contact_columns(index_t *self, num_t lever, const index_config_t *task, const motion_t *motion) {
    uint32_t *const sat = &self->saturations;
    uint32_t component[INDEX_COMPONENTS];
    const uint32_t count = index_order(task, component);
    const vec3_t arm = into_base(motion, vec3_of(task->point), sat);
    for (uint32_t c = 0; c < count; ++c) {
        const uint32_t number = component[c];
        const bool is_force = number < (uint32_t)ANGULAR;
        if (task->frame == (uint32_t)FRAME_TIP) {
            row_column(motion->jacobian[number], is_force ? NUM(1) : lever, self->column[c], sat);
        } else {
            const vec3_t own = vec3_of(task->axis[number % 3u]);
            const vec3_t axis = (task->frame == (uint32_t)FRAME_TOOL) ? into_base(motion, own, sat) : own;
            component_column(motion, is_force, axis, arm, lever, self->column[c], sat);
        }
    }
    return count;
}

static uint32_t count_of(uint32_t bits) {
    uint32_t count = 0;
    for (uint32_t rest = bits & INDEX_ALL_COMPONENTS; rest != 0u; rest &= rest - 1u) {
        ++count;
    }
    return count;
}

/* The filtered output of the regressor, multiplied by the factor that the bank expects. */
static uint32_t regressor_columns(index_t *self, const observer_t *observer, const regressor_t *regressor,
                                  num_t torque[]) {
    for (uint32_t c = 0; c < REGRESSOR_COLUMNS; ++c) {
        for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
            /* soft.h needs entries below 64; a larger column belongs to no payload of this arm */
            self->column[c][i] = num_min(num_max(regressor->column[c][i], -NUM(60)), NUM(60));
        }
    }
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        torque[i] = num_mul(observer->gain, regressor->torque[i], &self->saturations);
    }
    return REGRESSOR_COLUMNS;
}

void index_step(index_t *self, const subspace_config_t *config, const index_config_t *task, const robot_t *robot,
                const motion_t *motion, const observer_t *observer, const acceleration_t *acceleration,
                const regressor_t *regressor) {
    const bool project_first = config->order == (uint32_t)ORDER_PROJECT_FIRST;
    const bool soft = config->projector == (uint32_t)PROJECTOR_SOFT;
    const num_t *torque = project_first ? observer->update : observer->residual;
    num_t filtered[ROBOT_MAX_JOINTS];
    num_t tolerance = config->tolerance;
    self->token = token_next(regressor->token, TOKEN_INDEX, 0u);
    self->kind = task->kind;
    self->columns = 0;
    if (task->kind == (uint32_t)INDEX_PAYLOAD) {
        const num_t trust = soft ? acceleration->trust : NUM(1);
        const vec3_t sideways = {.x = num_mul(trust, acceleration->sideways.x, &self->saturations),
                                 .y = num_mul(trust, acceleration->sideways.y, &self->saturations),
                                 .z = num_mul(trust, acceleration->sideways.z, &self->saturations)};
        self->columns = payload_columns(self, config->lever_m, robot, motion, sideways);
    } else if (task->kind == (uint32_t)INDEX_CONTACT) {
        self->columns = contact_columns(self, config->lever_m, task, motion);
    } else if (task->kind == (uint32_t)INDEX_REGRESSOR) {
        self->columns = regressor_columns(self, observer, regressor, filtered);
        torque = filtered;
        tolerance = tolerance * REGRESSOR_TOLERANCE;
    } else {
        /* INDEX_RESIDUAL: nothing is explained */
    }
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        self->sudden[i] = NUM(0);
    }
    const num_t(*const column)[ROBOT_MAX_JOINTS] = (const num_t(*)[ROBOT_MAX_JOINTS])self->column;
    if (soft) {
        projection_soft(&self->projection, robot->joint_count, self->columns, column, tolerance, torque,
                        self->unexplained, count_of(task->components & task->fast), self->sudden);
    } else {
        projection_hard(&self->projection, robot->joint_count, self->columns, column, tolerance, torque,
                        self->unexplained);
    }
    self->smallest = self->projection.smallest;
    self->rank = self->projection.rank;
    self->converged = self->projection.converged;
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        self->explained[i] = num_subtract(torque[i], self->unexplained[i], &self->saturations);
    }
}

void index_reject(index_t *self, const num_t torque[], num_t unexplained[]) {
    projection_reject(&self->projection, torque, unexplained);
}
