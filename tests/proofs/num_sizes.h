/* num_sizes: num_stub.h with closer contracts, for harnesses with sums of many products: a product by one of six sizes,
 * whose upper bits are the sign, a quotient of two numbers, the root of a small square. proof_num.c and
 * enumerate_newton.c show them. */
#ifndef TAUPERP_NUM_SIZES_H
#define TAUPERP_NUM_SIZES_H

#include "num_stub.h"

/* The last size whose headroom was computed, and the headroom. */
static num_t headroom_size;
static int32_t headroom;

static inline int32_t stub_headroom(num_t size) {
    headroom_size = size;
    headroom = (num_headroom)(size);
    return headroom;
}

static inline num_t stub_saturated(int32_t bound, uint32_t *saturations) {
    bool saturated;
    *saturations += saturated ? 1u : 0u;
    return stub_within(bound);
}

/* A number up to a size, shifted by the headroom of that size, is at most 32: proof_num_headroom. */
static inline num_t stub_shifted(num_t a, int32_t shift, uint32_t *saturations) {
    const bool made_room = (shift == headroom) && (num_abs(a) <= headroom_size);
    stub_shift(shift);
    return stub_saturated(made_room ? NUM(32) : INT32_MAX, saturations);
}

/* |a| is below 2^bits. */
static inline bool stub_below(num_t a, uint32_t bits) {
    const int32_t most = (int32_t)1 << bits;
    return (a > -most) && (a < most);
}

static inline bool stub_either(num_t a, num_t b, uint32_t bits) {
    return stub_below(a, bits) || stub_below(b, bits);
}

static inline bool stub_both(num_t a, num_t b, uint32_t bits) {
    return stub_below(a, bits) && stub_below(b, bits);
}

/* A factor within +-1 does not increase the size, and two factors >= 0 have a product >= 0. */
static inline num_t stub_sized_mul(num_t a, num_t b, uint32_t *saturations) {
    const num_t result = stub_number(saturations);
    ASSUME((num_abs(a) > NUM(1)) || (num_abs(result) <= num_abs(b)));
    ASSUME((num_abs(b) > NUM(1)) || (num_abs(result) <= num_abs(a)));
    ASSUME((num_abs(b) > NUM(0.5)) || (num_abs(result) <= ((num_abs(a) / 2) + 1)));
    ASSUME((num_abs(a) > NUM(0.5)) || (num_abs(result) <= ((num_abs(b) / 2) + 1)));
    ASSUME((num_abs(a) > NUM(2)) || (num_abs(b) > NUM(2)) || (num_abs(result) <= NUM(4)));
    ASSUME((a < 0) || (b < 0) || (result >= 0));
    return result;
}

static inline num_t stub_sized_div(num_t a, num_t b, uint32_t *saturations) {
    const num_t result = stub_number(saturations);
    ASSUME((num_abs(a) > num_abs(b)) || (b == 0) || (num_abs(result) <= NUM(1)));
    return result;
}

/* Any number from -2^bits to 2^bits - 1: its upper bits are the sign, which CBMC decides fast. */
static inline num_wide_t stub_product(uint32_t bits) {
    int64_t any;
    return any >> (63u - bits);
}

/* Two factors below 2^m and 2^n have a product below 2^(m + n), and INT32_MAX^2 is below 2^62. */
static inline num_wide_t stub_sized(num_t a, num_t b) {
    const int32_t scaled = (int32_t)1 << 27; /* an entry after the shift by num_headroom */
    if (stub_either(a, b, 23u) || stub_both(a, b, 27u)) {
        return stub_product(54u);
    }
    if ((a >= -scaled) && (a <= scaled) && (b >= -scaled) && (b <= scaled)) {
        return stub_product(55u);
    }
    if (stub_both(a, b, 29u)) {
        return stub_product(58u);
    }
    if (stub_either(a, b, 28u)) {
        return stub_product(59u);
    }
    return stub_both(a, b, 30u) ? stub_product(60u) : stub_product(62u);
}

static inline num_wide_t stub_sized_wide(num_t a, num_t b) {
    const num_wide_t result = stub_sized(a, b);
    ASSUME((a != b) || (result >= 0));
    return result;
}

static inline num_t stub_sized_root(num_wide_t square) {
    num_t result;
    ASSUME((result >= 0) && ((result <= (((int32_t)1 << 29) + 2)) || (square > ((int64_t)1 << 58))));
    return result;
}

#undef num_mul
#undef num_div
#undef num_wide
#undef num_root
#undef num_shift
#define num_mul(a, b, saturations)       stub_sized_mul((a), (b), (saturations))
#define num_div(a, b, saturations)       stub_sized_div((a), (b), (saturations))
#define num_wide(a, b)                   stub_sized_wide((a), (b))
#define num_root(square)                 stub_sized_root(square)
#define num_headroom(size)               stub_headroom(size)
#define num_shift(a, shift, saturations) stub_shifted((a), (shift), (saturations))

#endif
