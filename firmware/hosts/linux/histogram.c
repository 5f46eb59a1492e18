#include "histogram.h"

void histogram_add(histogram_t *self, uint64_t duration_us) {
    self->count++;
    if (duration_us > self->longest) {
        self->longest = duration_us;
    }
    self->bin[(duration_us < HISTOGRAM_LIMIT) ? duration_us : HISTOGRAM_LIMIT]++;
}

uint64_t histogram_percentile(const histogram_t *self, uint32_t percent) {
    uint64_t below = 0;
    for (uint32_t i = 0; (i < HISTOGRAM_LIMIT) && (self->count > 0u); i++) {
        below += self->bin[i];
        if ((below * 100u) >= (self->count * percent)) {
            return i;
        }
    }
    return self->longest;
}
