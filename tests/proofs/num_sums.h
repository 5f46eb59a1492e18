/* num_sums: num_sizes.h for code whose sums keep the rule of num.h: each product has a factor of at most 64. The stub
 * asserts the rule and leaves any product of that size, of which a sum may hold eight. */
#ifndef TAUPERP_NUM_SUMS_H
#define TAUPERP_NUM_SUMS_H

#include "num_sizes.h"

static inline bool sum_is_factor(num_t a) {
    const int32_t most = (int32_t)1 << 28; /* 64 */
    return (a >= -most) && (a <= most);
}

/* 2^28 times a number below 2^31 is below 2^59. */
static inline num_wide_t sum_product(num_t a, num_t b) {
    HOLDS(sum_is_factor(a) || sum_is_factor(b), "one factor of a product in a sum is at most 64");
    return stub_product(59u);
}

/* Instead of sum_product, for the sum of three squares: factors below 256 (proofs.toml). */
num_wide_t sum_square(num_t a, num_t b) {
    HOLDS(stub_both(a, b, 30u), "the factors are below 256");
    return stub_product(60u);
}

static inline num_t sum_mul(num_t a, num_t b, uint32_t *saturations) {
    const num_t result = stub_sized_mul(a, b, saturations);
    ASSUME((num_abs(a) > NUM(8)) || (num_abs(b) > NUM(8)) || (num_abs(result) <= NUM(64)));
    return result;
}

#undef num_mul
#undef num_wide
#define num_mul(a, b, saturations) sum_mul((a), (b), (saturations))
#define num_wide(a, b)             sum_product((a), (b))

#endif
