#include "locate.h"

#include "vec3.h"

#define DEAREST 511.0 /* no cost is larger */

enum { COLUMNS = 6, HALVINGS = 9 };

void locate_init(locate_t *self) {
    *self = (locate_t){.sigma = NUM(LOCATE_NOISE_NM)};
}

void locate_begin(locate_t *self, uint32_t joints, uint32_t ticks, const num_t threshold[]) {
    uint32_t held = 0;
    num_t largest = NUM(LOCATE_NOISES * LOCATE_NOISE_NM);
    for (uint32_t i = 0; i < joints; ++i) {
        largest = num_max(largest, threshold[i]);
    }
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        const num_t least = largest / LOCATE_HEAVIEST;
        self->weight[i] = (i < joints) ? num_div(largest, num_max(threshold[i], least), &held) : NUM(1);
        self->change[i] = NUM(0);
    }
    self->sigma = largest / LOCATE_NOISES;
    self->part = NUM(1) / (num_t)ticks;
    self->best = NUM(DEAREST);
    self->second = NUM(DEAREST);
    self->best_link = 0;
    self->steps = ticks + joints;
    self->link = 0;
    self->force_n = (vec3_t){NUM(0), NUM(0), NUM(0)};
}

/* ln x within 0.01, for x from 1 to 512. A larger x counts as 512 to 1024: a column with a large weight. */
static num_t logarithm(num_t x, uint32_t *held) {
    num_t rest = x;
    num_t twos = NUM(0);
    /* Uncovered in fixed: 1 branch, 1 condition. x is at most 512, so the rest is below 2 before the halvings end. */
    for (uint32_t h = 0; (h < (uint32_t)HALVINGS) && (rest >= NUM(2)); ++h) {
        rest = rest / 2;
        twos = twos + NUM(1);
    }
    const num_t f = num_min(num_max(rest - NUM(1), NUM(0)), NUM(1));
    const num_t bend = num_mul(num_mul(NUM(0.3425), f, held), NUM(1) - f, held);
    return num_mul(NUM(0.693147), twos + f + bend, held);
}

/* The columns of a force along each axis, then of a moment about each. Only an arm that reaches further than 4 m has
 * columns that num_factor limits. */
static void make_columns(const motion_t *motion, const lever_config_t *shape, const num_t weight[],
                         num_t column[][ROBOT_MAX_JOINTS], uint32_t *held) {
    const vec3_t none = {NUM(0), NUM(0), NUM(0)};
    const vec3_t arm = lever_arm(motion, shape, held);
    for (uint32_t axis = 0; axis < 3u; ++axis) {
        const vec3_t unit = {.x = (axis == 0u) ? NUM(1) : NUM(0),
                             .y = (axis == 1u) ? NUM(1) : NUM(0),
                             .z = (axis == 2u) ? NUM(1) : NUM(0)};
        const num_t half = shape->half_m[lever_link(motion)];
        const vec3_t moment = {
            .x = num_mul(half, unit.x, held), .y = num_mul(half, unit.y, held), .z = num_mul(half, unit.z, held)};
        lever_torque(motion, arm, unit, none, column[axis], held);
        lever_torque(motion, arm, none, moment, column[axis + 3u], held);
    }
    for (uint32_t c = 0; c < (uint32_t)COLUMNS; ++c) {
        for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
            column[c][i] = num_factor(num_mul(column[c][i], weight[i], held), held);
        }
    }
}

static num_t dot(const num_t a[], const num_t b[], uint32_t *held) {
    num_wide_t sum = num_widen(NUM(0));
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        sum += num_wide(a[i], b[i]);
    }
    return num_narrow(sum, held);
}

/* One link. `change` is weighted and scaled to a largest entry of 1; `size` is that entry before, Nm. */
static void look(locate_t *self, const lever_config_t *shape, const motion_t *motion, const num_t change[],
                 num_t size) {
    uint32_t held = 0; /* a saturated cost is larger than every other: this saturation is not a fault */
    num_t column[COLUMNS][ROBOT_MAX_JOINTS];
    num_t rest[ROBOT_MAX_JOINTS];
    make_columns(motion, shape, self->weight, column, &held);
    soft_step(&self->soft, COLUMNS, (const num_t(*)[ROBOT_MAX_JOINTS])column, NUM(LOCATE_SOFT));
    soft_reject(&self->soft, change, rest, 0u, rest);
    const num_t noises = num_min(num_div(size, self->sigma, &held), NUM(1.0 / LOCATE_SHARE));
    const num_t square = num_mul(num_mul(noises, NUM(0.5 / LOCATE_SCALE), &held), noises, &held);
    num_t cost = num_mul(square, dot(change, rest, &held), &held);
    for (uint32_t c = 0; c < self->soft.columns; ++c) {
        const num_t ratio = num_mul(self->soft.triangle[c][c], NUM(1.0 / LOCATE_SOFT), &held);
        cost = num_add(cost, num_mul(logarithm(ratio, &held), NUM(1.0 / LOCATE_SCALE), &held), &held);
    }
    if (cost < self->best) {
        num_t force[3];
        for (uint32_t axis = 0; axis < 3u; ++axis) {
            const num_t part = num_mul(dot(column[axis], rest, &held), NUM(1.0 / LOCATE_SOFT), &held);
            force[axis] = num_mul(num_mul(part, NUM(1.0 / LOCATE_SOFT), &held), size, &held);
        }
        self->force_n = (vec3_t){.x = -force[0], .y = -force[1], .z = -force[2]}; /* r balances the force */
        self->second = self->best;
        self->best = cost;
        self->best_link = lever_link(motion) + 1u;
    } else {
        self->second = num_min(self->second, cost);
    }
}

/* The mean change, weighted and scaled to a largest entry of 1, against the next link. */
static void search(locate_t *self, const lever_config_t *shape, uint32_t joints, motion_t *motion) {
    uint32_t held = 0;
    num_t change[ROBOT_MAX_JOINTS] = {NUM(0)};
    num_t size = NUM(0);
    for (uint32_t i = 0; i < joints; ++i) {
        change[i] = num_mul(self->change[i], self->weight[i], &held);
        size = num_max(size, num_abs(change[i]));
    }
    if (size >= self->sigma) {
        for (uint32_t i = 0; i < joints; ++i) {
            change[i] = num_div(change[i], size, &held);
        }
        look(self, shape, motion, change, size);
    }
    motion->watched = ((motion->watched + 1u) < joints) ? (motion->watched + 1u) : 0u;
}

/* Torque on joint i that is as before the contact: what the task explained then, with the columns of now, and the rest.
 */
static __attribute__((noinline)) num_t expected(const locate_t *self, const index_t *index, uint32_t i, num_t rest,
                                                uint32_t *held) {
    num_t sum = rest;
    for (uint32_t c = 0; c < index->columns; ++c) { /* one by one: both factors have the whole range */
        sum = num_add(sum, num_mul(index->column[c][i], self->load[c], held), held);
    }
    return sum;
}

static __attribute__((noinline)) void approach(num_t *mean, num_t value) {
    uint32_t held = 0;
    *mean = num_add(*mean, num_subtract(value, *mean, &held) / LOCATE_SLOW, &held);
}

/* One joint or one coefficient in each tick. */
static void learn(locate_t *self, uint32_t joints, const observer_t *observer, const index_t *index,
                  const explained_t *explained) {
    uint32_t held = 0;
    const uint32_t k = self->next;
    if (k < joints) {
        approach(&self->before[k], num_subtract(observer->residual[k], expected(self, index, k, NUM(0), &held), &held));
    } else if (k >= ROBOT_MAX_JOINTS) {
        approach(&self->load[k - ROBOT_MAX_JOINTS], explained->coefficient[k - ROBOT_MAX_JOINTS]);
    } else {
        /* a joint that the arm does not have */
    }
    self->next = ((k + 1u) < (ROBOT_MAX_JOINTS + SUBSPACE_MAX_COLUMNS)) ? (k + 1u) : 0u;
}

/* Adds this tick's change to the mean. The sum is over `update`, which is y times the gain. */
static void add(locate_t *self, uint32_t joints, const observer_t *observer, const index_t *index) {
    uint32_t held = 0;
    for (uint32_t i = 0; i < joints; ++i) {
        const num_t known = num_mul(expected(self, index, i, self->before[i], &held), observer->gain, &held);
        const num_t more = num_mul(num_subtract(observer->update[i], known, &held), self->part, &held);
        const num_t sum = num_add(self->change[i], more, &held);
        const bool complete = self->steps == (joints + 1u);
        self->change[i] = complete ? num_div(sum, observer->gain, &held) : sum;
    }
}

bool locate_step(locate_t *self, const lever_config_t *shape, uint32_t joints, motion_t *motion,
                 const observer_t *observer, const index_t *index, const explained_t *explained, bool calm) {
    uint32_t held = 0;
    if (self->steps == 0u) {
        if (calm) {
            learn(self, joints, observer, index, explained);
        }
        return false;
    }
    if (self->steps > joints) {
        add(self, joints, observer, index);
    } else {
        search(self, shape, joints, motion);
    }
    --self->steps;
    if (self->steps == 0u) {
        const bool explains = self->best < NUM(LOCATE_WORST);
        const bool leads = num_subtract(self->second, self->best, &held) > NUM(LOCATE_LEAD);
        self->link = (explains && leads) ? self->best_link : 0u;
    }
    return self->steps == 0u;
}
