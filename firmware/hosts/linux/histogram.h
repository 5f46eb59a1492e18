/* histogram: durations in whole microseconds, 0 to HISTOGRAM_LIMIT - 1, with one bin for longer ones. */
#ifndef TAUPERP_LINUX_HISTOGRAM_H
#define TAUPERP_LINUX_HISTOGRAM_H

#include <stdint.h>

#define HISTOGRAM_LIMIT 8192u

typedef struct {
    uint64_t count;
    uint64_t longest;
    uint32_t bin[HISTOGRAM_LIMIT + 1u];
} histogram_t;

void histogram_add(histogram_t *self, uint64_t duration_us);

/* The duration that `percent` (0 to 100) of the samples do not exceed. The longest sample if that is in the last bin. 0
 * without samples. */
uint64_t histogram_percentile(const histogram_t *self, uint32_t percent);

#endif
