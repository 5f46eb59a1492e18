#include "detector.h"

#include "token.h"

void detector_init(detector_t *self) {
    *self = (detector_t){0};
}

/* True if a / b > c / d, without a division. NaN and infinity count as greater. Precondition: b and d positive. */
static bool ratio_is_greater(num_t a, num_t b, num_t c, num_t d) {
    /* Uncovered in fixed: 1 region, 3 branches, 2 conditions. Every pattern of Q9.22 is a number. */
    return (num_wide(a, d) > num_wide(c, b)) || (!num_finite(a) && num_finite(c));
}

/* Selects the channel that is nearest to its threshold at joint i. True if it is above. */
static bool look_at_joint(detector_t *self, const detector_config_t *task, const bank_t *bank, uint32_t i) {
    bool found = false;
    for (uint32_t c = 0; (c < BANK_MAX_CHANNELS) && ((task->channels >> c) != 0u); ++c) {
        const bool watched = (task->channels & (1u << c)) != 0u;
        const num_t value = bank->channel[c].output[i];
        const num_t threshold = task->threshold_nm[c][i];
        if (watched && (!found || ratio_is_greater(num_abs(value), threshold, num_abs(self->value_nm[i]),
                                                   self->threshold_nm[i]))) {
            self->value_nm[i] = value;
            self->threshold_nm[i] = threshold;
            self->channel[i] = (uint8_t)c;
            found = true;
        }
    }
    return !(num_abs(self->value_nm[i]) <= self->threshold_nm[i]); /* negated, so that NaN is above */
}

void detector_step(detector_t *self, const detector_config_t *task, uint32_t joints, const bank_t *bank) {
    bool worst_full = false;
    self->tripped = false;
    self->any_above = false;
    self->joint = 0;
    for (uint32_t i = 0; i < joints; ++i) {
        const bool above = look_at_joint(self, task, bank, i);
        if (above) {
            self->above[i] += (self->above[i] < UINT32_MAX) ? 1u : 0u;
        } else {
            self->above[i] = 0;
        }
        const bool full = above && (self->above[i] >= task->debounce_ticks);
        const uint32_t worst = self->joint;
        const bool worse = ratio_is_greater(num_abs(self->value_nm[i]), self->threshold_nm[i],
                                            num_abs(self->value_nm[worst]), self->threshold_nm[worst]);
        if ((full && !worst_full) || ((full == worst_full) && worse)) {
            self->joint = i;
        }
        worst_full = worst_full || full;
        self->any_above = self->any_above || above;
    }
    self->tripped = worst_full;
    self->token = token_next(bank->token, TOKEN_DETECTOR, 0u);
}
