#include "observer.h"

#include "token.h"

void observer_init(observer_t *self) {
    *self = (observer_t){0};
}

/* Weight of the first sample in the mean torque over a gap, indexed by gap - 1. Samples at both ends: one half. Means
 * over one cycle each: the weight that is exact for a torque that changes linearly. */
static const num_t share_instant[OBSERVER_MAX_GAP] = {NUM(0.5), NUM(0.5), NUM(0.5), NUM(0.5)};
static const num_t share_interval[OBSERVER_MAX_GAP] = {NUM(0), NUM(0.25), NUM(0.333333333), NUM(0.375)};

static num_t drift_of(observer_t *self, const motion_t *motion, uint32_t joint) {
    return num_subtract(motion->coriolis[joint], motion->gravity[joint], &self->saturations);
}

static void remember(observer_t *self, uint32_t joint, const motion_t *motion, num_t drift, num_t torque) {
    self->momentum[joint] = motion->momentum[joint];
    self->drift[joint] = drift;
    self->torque[joint] = torque;
}

static void start(observer_t *self, uint32_t joints, const motion_t *motion, const num_t torque[]) {
    for (uint32_t i = 0; i < joints; ++i) {
        self->residual[i] = NUM(0);
        self->update[i] = NUM(0);
        remember(self, i, motion, drift_of(self, motion, i), torque[i]);
    }
    self->decay = NUM(0);
    self->gain = NUM(1);
    self->gap = 0;
    self->started = true;
}

void observer_step(observer_t *self, const observer_config_t *config, uint32_t joints, const motion_t *motion,
                   const num_t torque[], uint32_t gap) {
    self->token = token_next(motion->token, TOKEN_OBSERVER, token_bits(torque, joints));
    if ((!self->started) || (gap < 1u) || (gap > OBSERVER_MAX_GAP)) {
        start(self, joints, motion, torque);
        return;
    }
    uint32_t *const sat = &self->saturations;
    const num_t decay = config->decay[gap - 1u];
    const num_t gain = config->gain[gap - 1u];
    const num_t momentum_gain = config->momentum_gain[gap - 1u];
    const bool interval = config->torque_sample == (uint32_t)TORQUE_INTERVAL;
    const num_t share = (interval ? share_interval : share_instant)[gap - 1u];
    for (uint32_t i = 0; i < joints; ++i) {
        const num_t change = num_subtract(motion->momentum[i], self->momentum[i], sat);
        const num_t drift = drift_of(self, motion, i);
        const num_t mean =
            num_narrow(num_widen(torque[i]) + num_wide(share, num_subtract(self->torque[i], torque[i], sat)) +
                           num_wide(NUM(0.5), num_add(self->drift[i], drift, sat)),
                       sat);
        self->update[i] = num_narrow(num_wide(gain, mean) - num_wide(momentum_gain, change), sat);
        self->residual[i] = num_narrow(
            num_wide(decay, self->residual[i]) + num_wide(gain, mean) - num_wide(momentum_gain, change), sat);
        remember(self, i, motion, drift, torque[i]);
    }
    self->decay = decay;
    self->gain = gain;
    self->gap = gap;
}
