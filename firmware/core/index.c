#include "index.h"

#include "vec3.h"

enum { LINEAR = 0, ANGULAR = 3 }; /* first rows of the Jacobian's two halves */

void index_init(index_t *self) {
    *self = (index_t){0};
}

/* Zero of zero. */
static vec3_t unit(vec3_t v, uint32_t *saturations) {
    const num_wide_t square = num_wide(v.x, v.x) + num_wide(v.y, v.y) + num_wide(v.z, v.z);
    if (!(square > num_widen(NUM(0)))) {
        return v;
    }
    const num_inverse_t inverse = num_inverse_root(square);
    return (vec3_t){.x = num_times(v.x, inverse, saturations),
                    .y = num_times(v.y, inverse, saturations),
                    .z = num_times(v.z, inverse, saturations)};
}

/* The part of v across a unit vector, all of it across zero. */
static vec3_t across(vec3_t v, vec3_t direction, uint32_t *saturations) {
    const num_t along = vec3_dot(v, direction, saturations);
    return (vec3_t){.x = num_subtract(v.x, num_mul(along, direction.x, saturations), saturations),
                    .y = num_subtract(v.y, num_mul(along, direction.y, saturations), saturations),
                    .z = num_subtract(v.z, num_mul(along, direction.z, saturations), saturations)};
}

/* How much of a column's last value stays, and how much of the new one comes in. */
typedef struct {
    num_t keep, gain;
} blend_t;

/* column <- keep column + Jv^T force, zero behind the last joint as the Jacobian is. */
static __attribute__((noinline)) void force_column(const motion_t *motion, vec3_t force, num_t keep, num_t column[],
                                                   uint32_t *saturations) {
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        column[i] = num_narrow(num_wide(keep, column[i]) + num_wide(motion->jacobian[LINEAR][i], force.x) +
                                   num_wide(motion->jacobian[LINEAR + 1][i], force.y) +
                                   num_wide(motion->jacobian[LINEAR + 2][i], force.z),
                               saturations);
    }
}

/* column <- keep column + scale row. */
static __attribute__((noinline)) void row_column(const num_t row[], num_t scale, num_t keep, num_t column[],
                                                 uint32_t *saturations) {
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        column[i] = num_narrow(num_wide(keep, column[i]) + num_wide(scale, row[i]), saturations);
    }
}

static vec3_t scaled(vec3_t v, num_t scale, uint32_t *saturations) {
    return (vec3_t){.x = num_mul(scale, v.x, saturations),
                    .y = num_mul(scale, v.y, saturations),
                    .z = num_mul(scale, v.z, saturations)};
}

/* The columns that the task explains; their number is returned. The acceleration's, which is often zero, is the last
 * one: so the projection finds out at no cost. */
NUM_STEP uint32_t update_basis(index_t *self, const subspace_config_t *config, index_kind_t kind, const robot_t *robot,
                               const motion_t *motion, vec3_t acceleration, blend_t blend) {
    uint32_t *const sat = &self->saturations;
    const num_t lever = num_mul(blend.gain, config->lever_m, sat);
    num_t(*column)[ROBOT_MAX_JOINTS] = self->column;
    if (kind == INDEX_PAYLOAD) {
        const vec3_t down = unit(robot->gravity, sat);
        const vec3_t sideways = across(acceleration, down, sat);
        for (uint32_t axis = 0; axis < 3u; ++axis) {
            row_column(motion->jacobian[ANGULAR + axis], lever, blend.keep, column[axis], sat);
        }
        force_column(motion, scaled(down, blend.gain, sat), blend.keep, column[3], sat);
        force_column(motion, scaled(sideways, blend.gain, sat), blend.keep, column[4], sat);
        return 5;
    }
    if (kind == INDEX_CONTACT) {
        for (uint32_t axis = 0; axis < 3u; ++axis) {
            row_column(motion->jacobian[LINEAR + axis], blend.gain, blend.keep, column[axis], sat);
            row_column(motion->jacobian[ANGULAR + axis], lever, blend.keep, column[3u + axis], sat);
        }
        return 6;
    }
    return 0;
}

/* The observer's low-pass on the columns, as an average over the time that this basis has been in force. The sample at
 * which the observer starts (decay 0) has no part in r, and so none in the average. */
static blend_t filtered(index_t *self, num_t decay) {
    const num_t share = NUM(1) - decay;
    self->weight = (decay > NUM(0)) ? (num_mul(decay, self->weight, &self->saturations) + share) : NUM(0);
    const num_t gain = (self->weight > share) ? num_div(share, self->weight, &self->saturations) : NUM(1);
    return (blend_t){.keep = NUM(1) - gain, .gain = gain};
}

/* What the old task explains of r starts to fade, by its basis of the last tick; the rest of r is the new task's. */
NUM_STEP void hand_over(index_t *self, const num_t residual[]) {
    num_t unexplained[ROBOT_JOINTS];
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        unexplained[i] = num_subtract(residual[i], self->fading[i], &self->saturations);
    }
    subspace_reject(&self->subspace, unexplained, unexplained);
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        self->fading[i] = num_subtract(residual[i], unexplained[i], &self->saturations);
    }
    self->weight = NUM(0);
}

void index_step(index_t *self, const subspace_config_t *config, index_kind_t kind, const robot_t *robot,
                const motion_t *motion, const observer_t *observer, vec3_t acceleration) {
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        self->fading[i] = num_mul(observer->decay, self->fading[i], &self->saturations);
    }
    if ((self->kind != (uint32_t)kind) && (self->kind != (uint32_t)INDEX_OFF)) {
        hand_over(self, observer->residual);
    }
    self->kind = (uint32_t)kind;

    const blend_t instantaneous = {.keep = NUM(0), .gain = NUM(1)};
    const blend_t blend = (config->basis == (uint32_t)BASIS_FILTERED) ? filtered(self, observer->decay) : instantaneous;
    const uint32_t count = update_basis(self, config, kind, robot, motion, acceleration, blend);
    subspace_step(&self->subspace, robot->joint_count, count, (const num_t(*)[ROBOT_MAX_JOINTS])self->column,
                  config->tolerance);
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        self->value[i] = num_subtract(observer->residual[i], self->fading[i], &self->saturations);
    }
    subspace_reject(&self->subspace, self->value, self->value);
}
