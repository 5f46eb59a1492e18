/* square_fixed.h over every square and inner product. */
#include "square_any.h"

static bool has_30_bits(uint32_t x, uint32_t y) {
    return (x < (1u << 30)) && (y < (1u << 30)) && ((x | y) >= (1u << 29));
}

void proof_square_of(void) {
    int64_t a;
    ASSUME((a >= 0) && (a < ((int64_t)1 << 62)));
    HOLDS(is_square(square_of(a)), "31 bits, or zero");
    REACHED;
}

void proof_square_comparisons(void) {
    const square_t a = any_square();
    const square_t b = any_square();
    int64_t along;
    uint32_t bits;
    ASSUME((bits < 63u) && (along > INT64_MIN));
    HOLDS(square_share(square_size(a), bits) <= a.bits, "a share is not larger");
    HOLDS(!(square_is_longer(a, b) && square_is_longer(b, a)), "one of two is longer");
    (void)square_is_orthogonal(along, a, b, bits);
    REACHED;
}

void proof_square_near_length(void) {
    uint32_t x, y;
    ASSUME(has_30_bits(x, y));
    const uint32_t length = square_near_length(x, y);
    HOLDS((length >= (1u << 29)) && (length <= (3u << 29)), "no less than the larger has, and below 1.5 times 2^30");
    REACHED;
}

/* Instead of square_near_length. */
uint32_t stub_near_length(uint32_t x, uint32_t y) {
    uint32_t length;
    HOLDS(has_30_bits(x, y), "the precondition of square_near_length");
    ASSUME((length >= (1u << 29)) && (length <= (3u << 29)));
    return length;
}

void proof_square_half_tangent(void) {
    uint32_t x, y;
    ASSUME(has_30_bits(x, y) && (y > 0u));
    HOLDS(square_half_tangent(x, y) <= (1u << 31), "at most an eighth of a turn");
    REACHED;
}

/* Instead of square_half_tangent. */
uint32_t stub_half_tangent(uint32_t x, uint32_t y) {
    uint32_t tangent;
    HOLDS(has_30_bits(x, y) && (y > 0u), "the precondition of square_half_tangent");
    ASSUME(tangent <= (1u << 31));
    return tangent;
}

/* Instead of num_newton: what enumerate_newton.c shows of it. */
uint32_t stub_newton_of_turn(uint32_t x) {
    uint32_t y;
    HOLDS(x >= (1u << 30), "the precondition of num_newton");
    ASSUME((y >= (1u << 30)) && (y <= (1u << 31)));
    return y;
}

void proof_square_orthogonalise(void) {
    square_t longer = any_square();
    square_t shorter = any_square();
    int64_t along;
    ASSUME(!square_is_longer(shorter, longer) && (along > INT64_MIN));
    const num_rotation_t by = square_orthogonalise(&longer, &shorter, along);
    HOLDS(is_square(longer) && is_square(shorter), "two squares");
    HOLDS((by.cos >= (1 << 29)) && (by.cos <= (1 << 30)), "the cosine");
    HOLDS((by.sin >= -(1 << 30)) && (by.sin <= (1 << 30)), "the sine");
    REACHED;
}
