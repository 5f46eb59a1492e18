#include "observer.h"

void observer_init(observer_t *self) {
    *self = (observer_t){0};
}

static void remember(observer_t *self, uint32_t joint, const motion_t *motion, num_t torque) {
    self->momentum[joint] = motion->momentum[joint];
    self->drift[joint] = motion->coriolis[joint] - motion->gravity[joint];
    self->torque[joint] = torque;
}

static void start(observer_t *self, uint32_t joints, const motion_t *motion, const num_t torque[]) {
    for (uint32_t i = 0; i < joints; ++i) {
        self->residual[i] = NUM(0);
        remember(self, i, motion, torque[i]);
    }
    self->decay = NUM(0);
    self->started = true;
}

void observer_step(observer_t *self, const observer_config_t *config, uint32_t joints, const motion_t *motion,
                   const num_t torque[], uint32_t gap) {
    if ((!self->started) || (gap < 1u) || (gap > CONFIG_MAX_GAP)) {
        start(self, joints, motion, torque);
        return;
    }
    uint32_t *const sat = &self->saturations;
    const num_t decay = config->decay[gap - 1u];
    const num_t gain = config->gain[gap - 1u];
    const num_t momentum_gain = config->momentum_gain[gap - 1u];
    const bool interval = (config->torque_sample == (uint32_t)TORQUE_INTERVAL) && (gap == 1u);
    for (uint32_t i = 0; i < joints; ++i) {
        const num_t change = motion->momentum[i] - self->momentum[i];
        const num_t before = interval ? torque[i] : self->torque[i];
        const num_t twice = before + torque[i] + self->drift[i] + motion->coriolis[i] - motion->gravity[i];
        const num_t mean = num_mul(twice, NUM(0.5), sat);
        self->residual[i] = num_narrow(
            num_wide(decay, self->residual[i]) + num_wide(gain, mean) - num_wide(momentum_gain, change), sat);
        remember(self, i, motion, torque[i]);
    }
    self->decay = decay;
}
