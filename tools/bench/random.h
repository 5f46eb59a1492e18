/* random: the same seeded numbers on every target and in both numeric types. Marsaglia's xorshift32 (2003). */
#ifndef TAUPERP_BENCH_RANDOM_H
#define TAUPERP_BENCH_RANDOM_H

#include "num.h"

typedef struct {
    uint32_t word; /* never zero */
} random_t;

static inline uint32_t random_word(random_t *self) {
    self->word ^= self->word << 13;
    self->word ^= self->word >> 17;
    self->word ^= self->word << 5;
    return self->word;
}

/* 0 to below n, n below 2^16. */
static inline uint32_t random_below(random_t *self, uint32_t n) {
    return ((random_word(self) >> 16) * n) >> 16;
}

/* -1 to 1 in steps of 2^-15. */
static inline num_t random_unit(random_t *self) {
    uint32_t saturations = 0;
    const uint32_t bits = random_word(self) >> 16;
    const num_t high = num_mul(num_from_int((int32_t)(bits >> 8) - 128), NUM(1.0 / 128.0), &saturations);
    const num_t low = num_mul(num_from_int((int32_t)(bits & 0xFFu)), NUM(1.0 / 32768.0), &saturations);
    return high + low;
}

static inline num_t random_between(random_t *self, num_t low, num_t high) {
    uint32_t saturations = 0;
    const num_t half = num_mul(high - low, NUM(0.5), &saturations);
    return low + half + num_mul(half, random_unit(self), &saturations);
}

#endif
