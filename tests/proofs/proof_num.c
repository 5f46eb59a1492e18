/* The fixed-point numbers over their whole range. num_stub.h relies on these proofs. */
#include "proof.h"

#include "num.h"
#include "scale.h"

static num_t any_number(void) {
    num_t a;
    ASSUME(a >= -INT32_MAX);
    return a;
}

static void is_number(num_t a) {
    HOLDS(a >= -INT32_MAX, "the result is within +-INT32_MAX");
}

void proof_num_sums(void) {
    num_t a, b; /* INT32_MIN too */
    int32_t any;
    uint32_t saturations;
    is_number(num_add(a, b, &saturations));
    is_number(num_subtract(a, b, &saturations));
    is_number(num_abs(a));
    HOLDS(num_abs(a) >= 0, "a size is not negative");
    is_number(num_from_int(any));
    (void)num_widen(a);
    (void)num_min(a, b);
    (void)num_max(a, b);
    HOLDS(num_finite(a), "a fixed-point number is finite");
    REACHED;
}

void proof_num_narrow(void) {
    int64_t a;
    uint32_t saturations;
    is_number(num_narrow(a, &saturations));
    uint32_t once = 0, again = 0;
    const num_t fast = num_narrow(a, &once);
    HOLDS((fast == num_narrow_within(a, &again, INT32_MAX)) && (once == again), "the short way has the same result");
    is_number(num_saturated(a, &saturations));
    REACHED;
}

static bool is_factor(num_t a) {
    return (a >= -NUM_FACTOR_MAX) && (a <= NUM_FACTOR_MAX);
}

void proof_num_factor(void) {
    int64_t sum;
    num_t a;
    uint32_t saturations;
    HOLDS(is_factor(num_narrow_factor(sum, &saturations)), "below 64");
    uint32_t once = 0, again = 0;
    const num_t fast = num_narrow_factor(sum, &once);
    HOLDS((fast == num_narrow_within(sum, &again, NUM_FACTOR_MAX)) && (once == again),
          "the short way has the same result");
    HOLDS(is_factor(num_factor(a, &saturations)), "below 64");
    REACHED;
}

void proof_num_rounded(void) {
    int64_t a;
    uint32_t shift;
    const int64_t limit = (int64_t)1 << 62;
    ASSUME((shift >= 1u) && (shift <= 62u) && (a >= -limit) && (a <= limit));
    (void)num_rounded(a, shift);
    REACHED;
}

void proof_num_reduced(void) {
    num_t a;
    int64_t product;
    uint32_t shift;
    const int64_t limit = (int64_t)1 << 62;
    ASSUME((shift >= 1u) && (shift <= 30u) && (product >= -limit) && (product <= limit));
    HOLDS(num_reduced(a, shift) == num_rounded(a, shift), "32 bits are rounded as 64 are");
    HOLDS(num_reduced(num_upper(product), shift) == num_rounded(product, 32u + shift), "the lower half changes no bit");
    HOLDS(num_reduced(a, 31u) == num_rounded(a, 31u), "the largest shift");
    REACHED;
}

void proof_num_wide(void) {
    num_t a, b;
    (void)num_wide(a, b);
    REACHED;
}

void proof_num_mul(void) {
    const num_t a = any_number();
    const num_t b = any_number();
    uint32_t saturations;
    const num_t product = num_mul(a, b, &saturations);
    is_number(product);
    HOLDS((a < 0) || (b < 0) || (product >= 0), "two factors >= 0 have a product >= 0");
    REACHED;
}

void proof_num_div(void) {
    const num_t a = any_number();
    const num_t b = any_number();
    uint32_t saturations;
    is_number(num_div(a, b, &saturations));
    REACHED;
}

/* What num_sizes.h and num_sums.h say of products and quotients. */
/* |a b| is at most |a| times the bound of |b|, which needs no proof; the rounding does. */
void proof_num_mul_bounds(void) {
    const num_t a = any_number();
    const int64_t one = (int64_t)1 << 22;
    const int64_t size = num_abs(a);
    int64_t product;
    uint32_t saturations;
    const num_t rounded = num_abs(num_narrow(product, &saturations));
    HOLDS((product > (size * one)) || (product < -(size * one)) || (rounded <= size), "a factor within 1");
    HOLDS((product > (size * (one / 2))) || (product < -(size * (one / 2))) || (rounded <= ((size / 2) + 1)),
          "a factor within 0.5");
    HOLDS((product > (4 * one * one)) || (product < -(4 * one * one)) || (rounded <= NUM(4)), "two factors within 2");
    HOLDS((product > (64 * one * one)) || (product < -(64 * one * one)) || (rounded <= NUM(64)),
          "two factors within 8");
    REACHED;
}

void proof_num_div_bounds(void) {
    const num_t a = any_number();
    const num_t b = any_number();
    uint32_t saturations;
    HOLDS((num_abs(a) > num_abs(b)) || (b == 0) || (num_abs(num_div(a, b, &saturations)) <= NUM(1)),
          "a quotient within 1");
    REACHED;
}

void proof_num_leading(void) {
    uint64_t a;
    ASSUME(a != 0u);
    const uint32_t leading = num_leading(a);
    HOLDS((leading <= 62u) && ((leading % 2u) == 0u), "an even number of bits");
    HOLDS((a << leading) >= ((uint64_t)1 << 62), "the first or second bit is set");
    REACHED;
}

void proof_num_newton(void) {
    uint32_t x;
    ASSUME(x >= (1u << 30));
    (void)num_newton(x);
    REACHED;
}

/* Instead of num_newton: what enumerate_newton.c shows of it. proofs.toml says where it is called. */
uint32_t stub_newton(uint32_t x) {
    uint32_t y;
    HOLDS(x >= (1u << 30), "the precondition of num_newton");
    ASSUME((y >= (1u << 30)) && (y <= (1u << 31)));
    return y;
}

/* Any square. enumerate_newton.c shows that the sum of Heron's step fits. */
void proof_num_root(void) {
    int64_t square;
    HOLDS(num_root(square) >= 0, "a root is not negative");
    REACHED;
}

/* Cosine and sine below 2 in Q30, which the next one needs. */
static const uint32_t two = 1u << 31;

/* `across` is scaled down, or up without a loss. */
static bool is_scaled(const num_double_angle_t *angle, uint64_t across) {
    return (angle->across < (1u << 30)) && (((angle->across >> angle->left) << angle->right) <= across);
}

void proof_num_double_angle(void) {
    uint64_t along, across;
    ASSUME((across != 0u) && (along < ((uint64_t)1 << 63)) && (across < ((uint64_t)1 << 63)));
    const num_double_angle_t angle = num_double_angle(along, across);
    HOLDS((angle.cos < two) && (angle.sin < two), "cosine and sine are below 2");
    HOLDS(is_scaled(&angle, across), "30 bits");
    REACHED;
}

/* Instead of num_double_angle. */
num_double_angle_t stub_double_angle(uint64_t along, uint64_t across) {
    num_double_angle_t angle;
    const int32_t excess = 34 - __builtin_clzll(along | across);
    HOLDS((across != 0u) && (along < ((uint64_t)1 << 63)) && (across < ((uint64_t)1 << 63)),
          "the precondition of num_double_angle");
    ASSUME((angle.cos < two) && (angle.sin < two));
    ASSUME((angle.right == ((excess > 0) ? (uint32_t)excess : 0u)) &&
           (angle.left == ((excess < 0) ? (uint32_t)-excess : 0u)));
    ASSUME(is_scaled(&angle, across));
    return angle;
}

/* Any squares, and a product of two numbers: below 2^62. */
void proof_num_smaller_eigenvalue(void) {
    int64_t a, b, c;
    const int64_t most = (int64_t)1 << 62;
    ASSUME((a >= 0) && (c >= 0) && (b > -most) && (b < most));
    const int64_t value = num_smaller_eigenvalue(a, c, b);
    HOLDS((value >= 0) && (value <= ((a < c) ? a : c)), "not negative, and not above the smaller entry");
    REACHED;
}

void proof_num_headroom(void) {
    num_t a;
    const int32_t headroom = num_headroom(a);
    HOLDS((headroom >= -4) && (headroom <= 26), "num_shift accepts the shift");
    num_t entry;
    uint32_t saturations;
    ASSUME((a >= 0) && (entry >= -a) && (entry <= a));
    const num_t shifted = num_shift(entry, headroom, &saturations);
    HOLDS((shifted >= -NUM(32)) && (shifted <= NUM(32)), "a shifted entry is below 32");
    REACHED;
}

void proof_num_shift(void) {
    num_t a; /* INT32_MIN too */
    int32_t shift;
    uint32_t saturations;
    ASSUME((shift >= -31) && (shift <= 31));
    const num_t shifted = num_shift(a, shift, &saturations);
    is_number(shifted);
    HOLDS(((a < 0) || (shifted >= 0)) && ((a > 0) || (shifted <= 0)), "a shift keeps the sign");
    REACHED;
}

void proof_num_unit(void) {
    const num_t a = any_number();
    const num_t b = any_number();
    num_unit_t cosine, sine;
    uint32_t saturations;
    const int32_t one = 1073741830; /* 1 plus the tolerance of 6e-9 of a rotation */
    ASSUME((cosine >= -one) && (cosine <= one) && (sine >= -one) && (sine <= one));
    (void)num_unit_times(cosine, a);
    (void)num_unit_turned(cosine, sine, a, b);
    is_number(num_turned_first(cosine, sine, a, b, &saturations));
    is_number(num_turned_second(cosine, sine, a, b, &saturations));
    REACHED;
}

void proof_num_rescaled(void) {
    int64_t a;
    uint32_t right, left;
    ASSUME((a > INT64_MIN) && (right <= 36u) && (left <= 28u) && ((right == 0u) || (left == 0u)));
    const uint64_t size = (uint64_t)((a < 0) ? -a : a);
    ASSUME(((size >> right) << left) < ((uint64_t)1 << 28));
    (void)num_rescaled(a, right, left);
    REACHED;
}

void proof_num_times(void) {
    num_inverse_t inverse;
    uint32_t saturations;
    ASSUME((inverse.mantissa >= (1u << 30)) && (inverse.mantissa <= (1u << 31)));
    ASSUME((inverse.shift >= 9u) && (inverse.shift <= 40u));
    is_number(num_times(any_number(), inverse, &saturations));
    REACHED;
}

void proof_num_inverse_root(void) {
    int64_t square;
    const num_inverse_t inverse = num_inverse_root(square);
    HOLDS((inverse.shift >= 9u) && (inverse.shift <= 40u), "num_times accepts the shift");
    HOLDS((inverse.mantissa >= (1u << 30)) && (inverse.mantissa <= (1u << 31)), "num_times accepts the mantissa");
    REACHED;
}

void proof_num_wide_parts(void) {
    int64_t a;
    uint32_t bits;
    ASSUME((bits <= 63u) && (a > INT64_MIN));
    (void)num_wide_share(a, bits);
    (void)num_wide_size(a);
    HOLDS(num_wide_finite(a), "a fixed-point sum is finite");
    REACHED;
}

void proof_num_rotation(void) {
    const num_t first = any_number();
    const num_t second = any_number();
    uint32_t saturations;
    is_number(num_rotation(first, second, &saturations).length);
    REACHED;
}

/* Instead of num_rotation in the next harness (proofs.toml). */
num_rotation_t stub_rotation(num_t first, num_t second, uint32_t *saturations) {
    num_rotation_t rotation;
    HOLDS((first >= -INT32_MAX) && (second >= -INT32_MAX) && (saturations != NULL), "the pair that num_rotation takes");
    return rotation;
}

/* Any pair, and any square as the shift. */
void proof_num_shifted_rotation(void) {
    const num_t first = any_number();
    const num_t second = any_number();
    int64_t shift;
    uint32_t saturations;
    ASSUME(shift >= 0);
    (void)num_shifted_rotation(first, second, shift, &saturations);
    REACHED;
}

void proof_num_mul30(void) {
    int32_t a, b;
    (void)num_mul30(a, b);
    REACHED;
}

void proof_num_sincos(void) {
    const num_t angle = any_number();
    (void)num_sincos(angle);
    REACHED;
}

void proof_scale(void) {
    int32_t raw;
    scale_t scale;
    ASSUME((raw >= -32768) && (raw <= 65535));
    ASSUME((scale.multiplier > 0) && (scale.shift >= 1u) && (scale.shift <= 62u));
    ASSUME((scale.per_unit >= 1) && (scale.per_unit <= 65536));
    (void)scale_to_num(raw, scale);
    REACHED;
}

void proof_scale_to_raw(void) {
    const num_t value = any_number();
    int32_t min, max;
    scale_t scale;
    ASSUME((scale.per_unit >= 1) && (scale.per_unit <= 1000000));
    ASSUME(min <= max);
    const int32_t raw = scale_to_raw(value, scale, min, max);
    HOLDS((raw >= min) && (raw <= max), "the raw value is held within its range");
    REACHED;
}
