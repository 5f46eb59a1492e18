/* num_stub: the contracts of the functions of num.h, for harnesses of code that calls them. proof_num.c shows that
 * the functions themselves fulfil the contracts. A value is any number within +-INT32_MAX; a product is bounded by the
 * sizes of its factors, so that CBMC decides whether a sum of products fits. */
#ifndef TAUPERP_NUM_STUB_H
#define TAUPERP_NUM_STUB_H

#include "num.h"
#include "proof.h"

/* |a| is at most 2^stub_bits(a). */
static inline uint32_t stub_bits(num_t a) {
    const uint32_t size = (a < 0) ? (0u - (uint32_t)a) : (uint32_t)a;
    if (size <= (1u << 22)) {
        return 22u;
    }
    if (size <= (1u << 26)) {
        return 26u;
    }
    if (size <= (1u << 28)) {
        return 28u;
    }
    return (size <= (1u << 29)) ? 29u : 31u;
}

static inline num_t stub_number(uint32_t *saturations) {
    num_t result;
    bool saturated;
    ASSUME(result >= -INT32_MAX);
    *saturations += saturated ? 1u : 0u;
    return result;
}

/* A factor within +-1 does not increase the size, and two factors >= 0 have a product >= 0. */
static inline num_t stub_mul(num_t a, num_t b, uint32_t *saturations) {
    const num_t result = stub_number(saturations);
    ASSUME((num_abs(a) > NUM(1)) || (num_abs(result) <= num_abs(b)));
    ASSUME((num_abs(b) > NUM(1)) || (num_abs(result) <= num_abs(a)));
    ASSUME((a < 0) || (b < 0) || (result >= 0));
    return result;
}

static inline num_wide_t stub_wide(num_t a, num_t b) {
    int64_t result;
    const int64_t bound = (int64_t)1 << (stub_bits(a) + stub_bits(b));
    ASSUME((result >= -bound) && (result <= bound));
    return result;
}

static inline num_t stub_root(num_wide_t square) {
    num_t result;
    (void)square;
    ASSUME(result >= 0);
    return result;
}

static inline num_t stub_within(int32_t bound) {
    num_t result;
    ASSUME((result >= -bound) && (result <= bound));
    return result;
}

static inline num_t stub_limited(uint32_t *saturations) {
    bool saturated;
    *saturations += saturated ? 1u : 0u;
    return stub_within(NUM_FACTOR_MAX);
}

static inline num_inverse_t stub_inverse(num_wide_t square) {
    num_inverse_t result;
    (void)square;
    ASSUME((result.mantissa >= (1u << 30)) && (result.mantissa <= (1u << 31)));
    ASSUME((result.shift >= 9u) && (result.shift <= 40u));
    return result;
}

static inline num_rotation_t stub_rotation(num_t first, num_t second, uint32_t *saturations) {
    (void)first;
    (void)second;
    return (num_rotation_t){
        .cos = stub_within(1073741830), .sin = stub_within(1073741830), .length = stub_number(saturations)};
}

/* Not a multiple of a rotation's cosine or sine, but any number, INT32_MIN too. */
static inline num_t stub_turned(num_unit_t cosine, num_unit_t sine) {
    num_t result;
    HOLDS((cosine >= -1073741830) && (cosine <= 1073741830), "a cosine");
    HOLDS((sine >= -1073741830) && (sine <= 1073741830), "a sine");
    return result;
}

static inline num_wide_t stub_eigenvalue(num_wide_t a, num_wide_t c) {
    int64_t result;
    const int64_t smaller = (a < c) ? a : c;
    ASSUME((result >= 0) && (result <= smaller));
    return result;
}

#define num_mul(a, b, saturations)                    stub_mul((a), (b), (saturations))
#define num_div(a, b, saturations)                    ((void)((a) + (num_wide_t)(b)), stub_number(saturations))
#define num_narrow(a, saturations)                    ((void)(a), stub_number(saturations))
#define num_narrow_factor(a, saturations)             ((void)(a), stub_limited(saturations))
#define num_wide(a, b)                                stub_wide((a), (b))
#define num_root(square)                              stub_root(square)
#define num_inverse_root(square)                      stub_inverse(square)
#define num_times(a, inverse, saturations)            ((void)(a), (void)(inverse), stub_number(saturations))
#define num_shift(a, shift, saturations)              ((void)(a), stub_shift(shift), stub_number(saturations))
#define num_rotation(first, second, s)                stub_rotation((first), (second), (s))
#define num_shifted_rotation(first, second, shift, s) ((void)(shift), stub_rotation((first), (second), (s)))
#define num_smaller_eigenvalue(a, c, b)               ((void)(b), stub_eigenvalue((a), (c)))
#define num_sincos(angle)                             ((void)(angle), (num_sincos_t){.sin = stub_within(4194305), .cos = stub_within(4194305)})
#define num_unit_times(unit, a)                       ((void)(a), stub_turned((unit), 0))
#define num_unit_turned(cosine, sine, a, b)           ((void)(a), (void)(b), stub_turned((cosine), (sine)))
#define num_turned_first(c, s, a, b, sat)             ((void)(c), (void)(s), (void)(a), (void)(b), stub_number(sat))
#define num_turned_second(c, s, a, b, sat)            ((void)(c), (void)(s), (void)(a), (void)(b), stub_number(sat))

static inline void stub_shift(int32_t shift) {
    HOLDS((shift >= -31) && (shift <= 31), "shift of num_shift");
}

#endif
