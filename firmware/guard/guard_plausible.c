#include "guard_parts.h"

/* Bounds, above the errors of real arms: steps of encoder and wire, 4 mrad/s of velocity noise, samples that are late
 * by one or two cycles.
 *
 * The error of one joint is e+ = decay e + (moved - mean velocity x time). It decays with the observer's gain K, so a
 * velocity that is wrong by v causes an error of v/K. With K = 50 1/s the bound allows 0.05 rad/s.
 */
#define JUMP_RAD         NUM(0.0015) /* 12 steps of the position signal */
#define VELOCITY_RAD_S   NUM(0.05)
#define LATE_CYCLES      NUM(2.5) /* real logs repeat and omit rows: up to 5.5 ms at 1 kHz */
#define LATE_S           NUM(0.003)
#define FROZEN_SNAPSHOTS 10u
#define FROZEN_NM        NUM(0.5) /* friction keeps a real reading constant for up to 0.42 Nm of gravity torque */

void plausibility_init(plausibility_t *self) {
    *self = (plausibility_t){0};
}

static void remember(plausibility_t *self, uint32_t i, const snapshot_t *snapshot) {
    self->position[i] = snapshot->position[i];
    self->velocity[i] = snapshot->velocity[i];
    self->torque[i] = snapshot->torque[i];
}

static void start(plausibility_t *self, uint32_t joints, const snapshot_t *snapshot, const motion_t *motion) {
    for (uint32_t i = 0; i < joints; ++i) {
        remember(self, i, snapshot);
        self->error_rad[i] = NUM(0);
        self->held_nm[i] = motion->gravity[i];
        self->same[i] = 0;
    }
    self->started = true;
}

/* Values of one step, the same for every joint. */
typedef struct {
    num_t decay;
    num_t half;  /* half of the step's length, s */
    num_t late;  /* LATE_CYCLES of the step plus LATE_S, s */
    num_t bound; /* bound for a joint at rest, rad */
} step_t;

/* gain / momentum_gain is the length of a step in s; 1 / momentum_gain of one cycle is about 1/K. */
static step_t step_of(const observer_config_t *gains, uint32_t gap) {
    uint32_t held = 0;
    const num_t span = num_div(gains->gain[gap - 1u], gains->momentum_gain[gap - 1u], &held);
    const num_t memory = num_div(NUM(1), gains->momentum_gain[0], &held);
    return (step_t){.decay = gains->decay[gap - 1u],
                    .half = num_mul(span, NUM(0.5), &held),
                    .late = num_add(num_mul(span, LATE_CYCLES, &held), LATE_S, &held),
                    .bound = num_add(JUMP_RAD, num_mul(VELOCITY_RAD_S, memory, &held), &held)};
}

static bool agrees(plausibility_t *self, uint32_t i, const snapshot_t *snapshot, const step_t *step) {
    uint32_t held = 0;
    const num_t sum = num_add(self->velocity[i], snapshot->velocity[i], &held);
    const num_t moved = num_subtract(snapshot->position[i], self->position[i], &held);
    self->error_rad[i] =
        num_narrow(num_wide(step->decay, self->error_rad[i]) + num_widen(moved) - num_wide(step->half, sum), &held);
    const num_t fastest = num_max(num_abs(self->velocity[i]), num_abs(snapshot->velocity[i]));
    const num_t bound = num_narrow(num_widen(step->bound) + num_wide(step->late, fastest), &held);
    return num_abs(self->error_rad[i]) <= bound;
}

/* True if a reading has not changed by one bit for a while, although the gravity torque has changed by more than a few
 * steps. Only a dead channel does that. */
static bool is_frozen(plausibility_t *self, uint32_t i, const snapshot_t *snapshot, const motion_t *motion) {
    uint32_t held = 0;
    if (snapshot->torque[i] != self->torque[i]) {
        self->same[i] = 0;
        self->held_nm[i] = motion->gravity[i];
        return false;
    }
    self->same[i] = (uint8_t)((self->same[i] < UINT8_MAX) ? (self->same[i] + 1u) : self->same[i]);
    const num_t change = num_abs(num_subtract(motion->gravity[i], self->held_nm[i], &held));
    return (self->same[i] >= FROZEN_SNAPSHOTS) && (change >= FROZEN_NM);
}

void plausibility_step(plausibility_t *self, const observer_config_t *gains, uint32_t joints, uint32_t gap,
                       const snapshot_t *snapshot, const motion_t *motion) {
    self->fault = 0;
    if (!self->started || (gap < 1u) || (gap > CONFIG_MAX_GAP)) {
        start(self, joints, snapshot, motion);
        return;
    }
    const step_t step = step_of(gains, gap);
    for (uint32_t i = 0; i < joints; ++i) {
        const bool plausible = agrees(self, i, snapshot, &step);
        const bool frozen = is_frozen(self, i, snapshot, motion);
        if ((self->fault == 0u) && (!plausible || frozen)) {
            self->fault = plausible ? (uint32_t)GUARD_REASON_FROZEN : (uint32_t)GUARD_REASON_IMPLAUSIBLE;
            self->joint = i;
        }
        remember(self, i, snapshot);
    }
}
