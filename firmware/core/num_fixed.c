#include "num.h"

#ifdef TAUPERP_FIXED

num_t num_limit(num_t a, uint32_t *saturations) {
    ++*saturations;
    return (a > 0) ? INT32_MAX : -INT32_MAX;
}

num_t num_narrow_within(num_wide_t a, uint32_t *saturations, num_t most) {
    const int64_t limit = (int64_t)most * 4194304;
    if ((a > limit) || (a < -limit)) {
        ++*saturations;
        return (a > 0) ? most : -most;
    }
    return (num_t)num_rounded(a, NUM_FRACTION);
}

num_t num_rounded_within(int64_t a, uint32_t shift, uint32_t *saturations) {
    return num_saturated(num_rounded(a, shift), saturations);
}

num_t num_div(num_t a, num_t b, uint32_t *saturations) {
    const uint32_t divisor = (uint32_t)num_abs(b);
    const bool negative = (a < 0) != (b < 0);
    if (divisor == 0u) {
        ++*saturations;
        return (a < 0) ? -INT32_MAX : INT32_MAX;
    }
    const uint64_t quotient = (((uint64_t)num_abs(a) << NUM_FRACTION) + (divisor / 2u)) / divisor;
    return num_saturated(negative ? -(int64_t)quotient : (int64_t)quotient, saturations);
}

num_t num_root(num_wide_t square) {
    if (square <= 0) {
        return 0;
    }
    const uint64_t x = (uint64_t)square;
    const uint32_t leading = num_leading(x);
    const uint32_t top = (uint32_t)((x << leading) >> 32);
    uint64_t root = ((uint64_t)top * num_newton(top)) >> (30u + (leading / 2u));
    if (root > 0x1000000u) { /* above 24 bits the root may be inexact: one step of Heron's method on 32 bits */
        const int32_t error = (int32_t)((int64_t)(x - (root * root)) / 128);
        const int32_t half = (int32_t)(root / 128u);
        root = (uint64_t)((int64_t)root + ((error + ((error < 0) ? -half : half)) / (2 * half)));
    }
    if ((root * root) > x) {
        --root;
    } else if ((x - (root * root)) > (2u * root)) {
        ++root;
    } else {
        /* root is the floor */
    }
    root += ((x - (root * root)) > root) ? 1u : 0u;
    return (root > (uint64_t)INT32_MAX) ? INT32_MAX : (num_t)root;
}

#endif
