#include "locate.h"

#include "vec3.h"

enum { COLUMNS = 6, HALVINGS = 9 };

void locate_init(locate_t *self) {
    *self = (locate_t){0};
}

void locate_begin(locate_t *self, uint32_t joints) {
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        self->cost[i] = NUM(0);
        self->largest[i] = NUM(0);
    }
    self->steps = LOCATE_PASSES * joints;
    self->link = 0;
    self->force_n = (vec3_t){NUM(0), NUM(0), NUM(0)};
}

/* ln x within 0.01, for x from 1 to 512. */
static num_t logarithm(num_t x, uint32_t *held) {
    num_t rest = x;
    num_t twos = NUM(0);
    /* Uncovered in both: 1 branch, 1 condition. x is at most 512, so the rest is below 2 before the halvings end. */
    for (uint32_t h = 0; (h < (uint32_t)HALVINGS) && (rest >= NUM(2)); ++h) {
        rest = rest / 2;
        twos = twos + NUM(1);
    }
    const num_t f = num_min(num_max(rest - NUM(1), NUM(0)), NUM(1));
    const num_t bend = num_mul(num_mul(NUM(0.3425), f, held), NUM(1) - f, held);
    return num_mul(NUM(0.693147), twos + f + bend, held);
}

/* The columns of a force along each axis, then of a moment about each. */
static void make_columns(const motion_t *motion, const lever_config_t *shape, num_t column[][ROBOT_MAX_JOINTS],
                         uint32_t *held) {
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
}

static num_t dot(const num_t a[], const num_t b[], uint32_t *held) {
    num_wide_t sum = num_widen(NUM(0));
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        sum += num_wide(a[i], b[i]);
    }
    return num_narrow(sum, held);
}

/* One link. `change` is scaled to a largest entry of 1; `size` is that entry before, Nm. */
static void look(locate_t *self, const lever_config_t *shape, const motion_t *motion, const num_t change[],
                 num_t size) {
    uint32_t held = 0; /* a saturated cost is larger than every other: this saturation is not a fault */
    const uint32_t link = lever_link(motion);
    num_t column[COLUMNS][ROBOT_MAX_JOINTS];
    num_t rest[ROBOT_MAX_JOINTS];
    make_columns(motion, shape, column, &held);
    soft_step(&self->soft, COLUMNS, (const num_t(*)[ROBOT_MAX_JOINTS])column, NUM(LOCATE_SOFT));
    soft_reject(&self->soft, change, rest, 0u, rest);
    const num_t noises = num_min(num_div(size, NUM(LOCATE_NOISE_NM), &held), NUM(1.0 / LOCATE_SHARE));
    const num_t square = num_mul(num_mul(noises, NUM(0.5 / LOCATE_SCALE), &held), noises, &held);
    num_t cost = num_mul(square, dot(change, rest, &held), &held);
    for (uint32_t c = 0; c < self->soft.columns; ++c) {
        const num_t ratio = num_mul(self->soft.triangle[c][c], NUM(1.0 / LOCATE_SOFT), &held);
        cost = num_add(cost, num_mul(logarithm(ratio, &held), NUM(1.0 / LOCATE_SCALE), &held), &held);
    }
    self->cost[link] = num_add(self->cost[link], num_mul(cost, NUM(1.0 / LOCATE_PASSES), &held), &held);
    if (size >= self->largest[link]) {
        self->largest[link] = size;
        for (uint32_t axis = 0; axis < 3u; ++axis) {
            const num_t part = num_mul(dot(column[axis], rest, &held), NUM(1.0 / LOCATE_SOFT), &held);
            self->force[link][axis] = num_mul(num_mul(part, NUM(1.0 / LOCATE_SOFT), &held), size, &held);
        }
    }
}

/* The answer: r balances the force, which is on the robot. */
static void decide(locate_t *self, uint32_t joints) {
    uint32_t held = 0;
    uint32_t best = 0;
    for (uint32_t i = 1; i < joints; ++i) {
        best = (self->cost[i] < self->cost[best]) ? i : best;
    }
    bool ahead = self->cost[best] < NUM(LOCATE_WORST);
    for (uint32_t i = 0; i < joints; ++i) {
        ahead = ahead && ((i == best) || (num_subtract(self->cost[i], self->cost[best], &held) > NUM(LOCATE_LEAD)));
    }
    self->link = ahead ? (best + 1u) : 0u;
    self->force_n = (vec3_t){.x = -self->force[best][0], .y = -self->force[best][1], .z = -self->force[best][2]};
}

bool locate_step(locate_t *self, const lever_config_t *shape, uint32_t joints, motion_t *motion, const num_t residual[],
                 bool calm) {
    uint32_t held = 0;
    if (self->steps == 0u) {
        for (uint32_t i = 0; calm && (i < joints); ++i) {
            self->before[i] = num_add(self->before[i], num_subtract(residual[i], self->before[i], &held) / 128, &held);
        }
        return false;
    }
    num_t change[ROBOT_MAX_JOINTS] = {NUM(0)};
    num_t size = NUM(0);
    for (uint32_t i = 0; i < joints; ++i) {
        change[i] = num_subtract(residual[i], self->before[i], &held);
        size = num_max(size, num_abs(change[i]));
    }
    if (size >= NUM(LOCATE_NOISE_NM)) {
        for (uint32_t i = 0; i < joints; ++i) {
            change[i] = num_div(change[i], size, &held);
        }
        look(self, shape, motion, change, size);
    }
    motion->watched = ((motion->watched + 1u) < joints) ? (motion->watched + 1u) : 0u;
    --self->steps;
    if (self->steps == 0u) {
        decide(self, joints);
    }
    return self->steps == 0u;
}
