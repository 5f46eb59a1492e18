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

static void force_column(const motion_t *motion, vec3_t direction, num_t column[], uint32_t *saturations) {
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) { /* zero behind the last joint, as the Jacobian is */
        column[i] = num_narrow(num_wide(motion->jacobian[LINEAR][i], direction.x) +
                                   num_wide(motion->jacobian[LINEAR + 1][i], direction.y) +
                                   num_wide(motion->jacobian[LINEAR + 2][i], direction.z),
                               saturations);
    }
}

static void scaled_column(const num_t row[], num_t scale, num_t column[], uint32_t *saturations) {
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        column[i] = num_mul(scale, row[i], saturations);
    }
}

/* The columns that the task explains at this instant; their number is returned. */
static uint32_t instantaneous_basis(index_t *self, const subspace_config_t *config, index_kind_t kind,
                                    const robot_t *robot, const motion_t *motion, vec3_t acceleration,
                                    num_t column[][ROBOT_MAX_JOINTS]) {
    uint32_t *const sat = &self->saturations;
    uint32_t count = 0;
    if (kind == INDEX_PAYLOAD) {
        const vec3_t down = unit(robot->gravity, sat);
        force_column(motion, down, column[0], sat);
        force_column(motion, across(acceleration, down, sat), column[1], sat);
        count = 2;
    } else if (kind == INDEX_CONTACT) {
        for (count = 0; count < 3u; ++count) {
            scaled_column(motion->jacobian[LINEAR + count], NUM(1), column[count], sat);
        }
    } else {
        return 0;
    }
    for (uint32_t axis = 0; axis < 3u; ++axis) {
        scaled_column(motion->jacobian[ANGULAR + axis], config->lever_m, column[count], sat);
        ++count;
    }
    return count;
}

/* The observer's low-pass on the columns, as an average over the time that this basis has been in force. The sample at
 * which the observer starts (decay 0) has no part in r, and so none in the average. */
static uint32_t filtered_basis(index_t *self, const subspace_config_t *config, index_kind_t kind, const robot_t *robot,
                               const motion_t *motion, vec3_t acceleration, num_t decay) {
    num_t column[SUBSPACE_MAX_COLUMNS][ROBOT_MAX_JOINTS];
    const uint32_t count = instantaneous_basis(self, config, kind, robot, motion, acceleration, column);
    const num_t share = NUM(1) - decay;
    self->weight = (decay > NUM(0)) ? (num_mul(decay, self->weight, &self->saturations) + share) : NUM(0);
    const num_t gain = (self->weight > share) ? num_div(share, self->weight, &self->saturations) : NUM(1);
    for (uint32_t c = 0; c < count; ++c) {
        for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
            const num_wide_t before = num_wide(NUM(1) - gain, self->column[c][i]);
            self->column[c][i] = num_narrow(before + num_wide(gain, column[c][i]), &self->saturations);
        }
    }
    return count;
}

/* What the old task explains of r starts to fade, by its basis of the last tick; the rest of r is the new task's. */
static void hand_over(index_t *self, uint32_t joints, const num_t residual[]) {
    num_t unexplained[ROBOT_MAX_JOINTS] = {NUM(0)};
    for (uint32_t i = 0; i < joints; ++i) {
        unexplained[i] = num_subtract(residual[i], self->fading[i], &self->saturations);
    }
    subspace_reject(&self->subspace, unexplained, unexplained);
    for (uint32_t i = 0; i < joints; ++i) {
        self->fading[i] = num_subtract(residual[i], unexplained[i], &self->saturations);
    }
    self->weight = NUM(0);
}

void index_step(index_t *self, const subspace_config_t *config, index_kind_t kind, const robot_t *robot,
                const motion_t *motion, const observer_t *observer, vec3_t acceleration) {
    const uint32_t joints = robot->joint_count;
    for (uint32_t i = 0; i < joints; ++i) {
        self->fading[i] = num_mul(observer->decay, self->fading[i], &self->saturations);
    }
    if ((self->kind != (uint32_t)kind) && (self->kind != (uint32_t)INDEX_OFF)) {
        hand_over(self, joints, observer->residual);
    }
    self->kind = (uint32_t)kind;

    uint32_t count;
    if (config->basis == (uint32_t)BASIS_FILTERED) {
        count = filtered_basis(self, config, kind, robot, motion, acceleration, observer->decay);
    } else {
        count = instantaneous_basis(self, config, kind, robot, motion, acceleration, self->column);
    }
    subspace_step(&self->subspace, joints, count, (const num_t(*)[ROBOT_MAX_JOINTS])self->column, config->tolerance);
    for (uint32_t i = 0; i < joints; ++i) {
        self->value[i] = num_subtract(observer->residual[i], self->fading[i], &self->saturations);
    }
    subspace_reject(&self->subspace, self->value, self->value);
}
