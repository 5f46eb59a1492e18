/* length_stub: num_sizes.h with closer contracts for code that divides a vector by a length:
 *   - a root of a sum of squares is at least the size of each number that was squared. num_root rounds to nearest;
 *   - a number times the inverse root of a product of two positive factors, of which the larger one is at most twice
 * the smaller one, and at least the number, is at most sqrt(2) but for rounding. enumerate_newton.c shows that a number
 *     times the inverse root of its square is at most 1 but for rounding.
 * Precondition of the harness: every square since the last root is in the sum under the next one. */
#ifndef TAUPERP_LENGTH_STUB_H
#define TAUPERP_LENGTH_STUB_H

#include "num_sizes.h"

/* Largest entry of a vector, and a product of two such: after the shift by num_headroom it is at most 32. */
#ifndef LENGTH_ENTRY
#define LENGTH_ENTRY     ((int32_t)1 << 27)
#define LENGTH_PRODUCT() stub_product(55u)
#endif

static num_t largest;                     /* of the squared numbers since the last root */
static num_t smaller, larger;             /* size of the factors of the last product */
static num_t under_smaller, under_larger; /* the same, under the inverse root */

static inline num_wide_t length_wide(num_t a, num_t b) {
    const num_t first = num_abs(a);
    const num_t second = num_abs(b);
    if (a == b) {
        largest = num_max(largest, first);
    }
    smaller = num_min(first, second);
    larger = num_max(first, second);
    const num_wide_t result = (larger <= LENGTH_ENTRY) ? LENGTH_PRODUCT() : stub_sized(a, b);
    ASSUME((a != b) || (result >= 0));
    return result;
}

static inline num_t length_root(num_wide_t square) {
    const num_t result = stub_sized_root(square);
    ASSUME(result >= largest);
    largest = 0;
    return result;
}

static inline num_inverse_t length_inverse(num_wide_t square) {
    under_smaller = smaller;
    under_larger = larger;
    return stub_inverse(square);
}

static inline num_t length_times(num_t a, num_inverse_t inverse, uint32_t *saturations) {
    const num_t result = stub_number(saturations);
    const bool close = ((under_larger / 2) <= under_smaller) && (num_abs(a) <= under_larger);
    ASSUME((inverse.mantissa != 0u) || (result == 0));
    ASSUME(!close || stub_below(result, 23u));
    return result;
}

#undef num_wide
#undef num_root
#undef num_inverse_root
#undef num_times
#define num_wide(a, b)                     length_wide((a), (b))
#define num_root(square)                   length_root(square)
#define num_inverse_root(square)           length_inverse(square)
#define num_times(a, inverse, saturations) length_times((a), (inverse), (saturations))

#endif
