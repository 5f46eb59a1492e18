#include "detector.h"

#include "token.h"

void detector_init(detector_t *self) {
    *self = (detector_t){0};
}

/* A channel that the task watches. */
typedef struct {
    const num_t *value;
    const num_t *threshold;
    uint32_t channel;
} watched_t;

/* Returns their number. Without any, the first entry is channel 0. */
static uint32_t watched_channels(const detector_config_t *task, const bank_t *bank, watched_t watched[]) {
    uint32_t count = 0;
    watched[0] = (watched_t){.value = bank->channel[0].output, .threshold = task->threshold_nm[0], .channel = 0u};
    for (uint32_t c = 0; c < BANK_MAX_CHANNELS; ++c) {
        if ((task->channels & (1u << c)) != 0u) {
            watched[count] =
                (watched_t){.value = bank->channel[c].output, .threshold = task->threshold_nm[c], .channel = c};
            ++count;
        }
    }
    return count;
}

/* True if a / b > c / d, without a division. NaN is greater than every number. Precondition: b and d positive. */
NUM_STEP bool ratio_is_greater(num_t a, num_t b, num_t c, num_t d) {
    /* Uncovered in fixed: 1 branch, 1 condition. Every pattern of Q9.22 is a number. */
    return !(num_wide(a, d) <= num_wide(c, b)) && num_finite(c);
}

/* The channel of joint i that is nearest to its threshold, and how near. */
typedef struct {
    num_t size; /* |value| */
    num_t threshold;
} nearest_t;

NUM_STEP nearest_t look_at_joint(detector_t *self, const watched_t watched[], uint32_t count, uint32_t i) {
    num_t value = watched[0].value[i];
    nearest_t nearest = {.size = num_abs(value), .threshold = watched[0].threshold[i]};
    uint32_t channel = watched[0].channel;
    for (uint32_t k = 1; k < count; ++k) {
        const num_t other = watched[k].value[i];
        const num_t size = num_abs(other);
        const num_t threshold = watched[k].threshold[i];
        if (ratio_is_greater(size, threshold, nearest.size, nearest.threshold)) {
            value = other;
            nearest = (nearest_t){.size = size, .threshold = threshold};
            channel = watched[k].channel;
        }
    }
    self->value_nm[i] = value;
    self->threshold_nm[i] = nearest.threshold;
    self->channel[i] = (uint8_t)channel;
    return nearest;
}

void detector_step(detector_t *self, const detector_config_t *task, uint32_t joints, const bank_t *bank) {
    watched_t watched[BANK_MAX_CHANNELS];
    const uint32_t count = watched_channels(task, bank, watched);
    nearest_t worst = {NUM(0), NUM(1)};
    bool worst_full = false;
    uint32_t joint = 0;
    bool any_above = false;
    for (uint32_t i = 0; i < joints; ++i) {
        const nearest_t one = look_at_joint(self, watched, count, i);
        const bool above = !(one.size <= one.threshold); /* negated, so that NaN is above */
        const uint32_t before = self->above[i];
        const uint32_t ticks = above ? (before + ((before < UINT32_MAX) ? 1u : 0u)) : 0u;
        const bool full = above && (ticks >= task->debounce_ticks);
        const bool worse = ratio_is_greater(one.size, one.threshold, worst.size, worst.threshold);
        self->above[i] = ticks;
        if ((full && !worst_full) || ((full == worst_full) && worse)) {
            joint = i;
            worst = one;
        }
        worst_full = worst_full || full;
        any_above = any_above || above;
    }
    self->joint = joint;
    self->tripped = worst_full;
    self->any_above = any_above;
    self->token = token_next(bank->token, TOKEN_DETECTOR, 0u);
}
