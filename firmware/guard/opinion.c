#include "opinion.h"

#include "values.h"

static bool is_near(int32_t a, int32_t b, int32_t bound) {
    const int64_t difference = (int64_t)a - b;
    return (difference <= bound) && (difference >= -bound);
}

static bool residuals_agree(const opinion_t *own, const opinion_t *other) {
    bool agree = true;
    for (uint32_t i = 0; i < OPINION_MAX_JOINTS; ++i) {
        agree = agree && is_near(own->residual[i], other->residual[i], AGREE_RESIDUAL);
    }
    return agree;
}

static bool indexes_agree(const opinion_t *own, const opinion_t *other) {
    bool agree = true;
    for (uint32_t c = 0; c < OPINION_MAX_CHANNELS; ++c) {
        for (uint32_t i = 0; i < OPINION_MAX_JOINTS; ++i) {
            agree = agree && is_near(own->index[c][i], other->index[c][i], AGREE_INDEX);
        }
    }
    return agree;
}

/* Decided by whole numbers alone, so there is no rounding to allow for. A channel in FAULT is no contradiction: the
 * other one follows. */
static bool facts_agree(const opinion_t *own, const opinion_t *other) {
    const bool state = (own->state == other->state) || (other->wish == (uint8_t)WISH_FAULT);
    return state && (own->trip_number == other->trip_number) && (own->joints == other->joints) &&
           (own->channels == other->channels) && (own->hard == other->hard) && (own->cycle == other->cycle) &&
           (own->task == other->task);
}

/* False: the ranks have differed for too long. */
static bool ranks_agree(agree_t *self, const opinion_t *own, const opinion_t *other) {
    const uint32_t period_us = own->period_us;
    if (own->hard && (own->rank != other->rank)) {
        self->rank_us += (self->rank_us < AGREE_RANK_MAX_US) ? period_us : 0u;
        self->wait_us = AGREE_RANK_US;
    } else {
        self->rank_us = 0;
        self->wait_us -= (self->wait_us < period_us) ? self->wait_us : period_us;
    }
    return self->rank_us < AGREE_RANK_MAX_US;
}

bool agree_step(agree_t *self, const opinion_t *own, const opinion_t *other) {
    const bool measured = own->state > (uint8_t)GUARD_STATE_SELF_TEST; /* not the self-test's own push */
    const bool ranks = ranks_agree(self, own, other);
    if (own->saturated || other->saturated) {
        self->wait_us = AGREE_RANK_US;
    }
    const bool indexes = (self->wait_us > 0u) || indexes_agree(own, other);
    const bool numbers = residuals_agree(own, other) && indexes && (own->fresh == other->fresh);
    if (numbers || !measured) {
        self->apart = 0;
    } else {
        self->apart += (self->apart <= AGREE_TICKS) ? 1u : 0u;
    }
    return facts_agree(own, other) && ranks && (self->apart <= AGREE_TICKS);
}

const opinion_t *opinion_worse(const opinion_t *first, const opinion_t *second) {
    const bool stop = (first->wish == (uint8_t)WISH_STOP) && (second->wish == (uint8_t)WISH_STOP);
    const bool worse = (second->wish < first->wish) || (stop && (second->category < first->category));
    return worse ? second : first;
}
