/* num_fixed: num_t as Q9.22, a product as Q19.44. Included by num.h only.
 *
 * Values stay within +-INT32_MAX. The range is symmetric, so that negation never overflows. A sum, product, quotient or
 * rounding that does not fit saturates and is counted. Use plain + and - only where a bound is known. No negative
 * number is shifted, because C leaves the result to the compiler.
 *
 * Errors, in steps of 2^-22 = 2.4e-7, measured over the whole range by tests/unit/test_num.c: product and quotient 0.5,
 * root 0.5, sine and cosine 0.52 for every angle. A number times num_inverse_root: 0.5 plus 3e-9 of the result. The
 * inverse root is a fixed number of Newton steps on 32 x 32 -> 64 bit products. Only num_div divides.
 *
 * Functions that are long or rarely called are in num_fixed.c, so that the flash holds them once. A call needs little
 * time compared with their content.
 */
#define NUM_FRACTION 22u
#define NUM(x)       ((num_t)(((x) * 4194304.0) + (((x) < 0) ? -0.5 : 0.5)))
#define NUM_NUMERIC  2u

#define NUM_FACTOR_MAX 268435455 /* largest factor of a product in a sum: one step below 64 */

/* 1 / sqrt(.) as mantissa * 2^(22 - shift). Its product with x is x * mantissa / 2^shift. */
typedef struct {
    uint32_t mantissa;
    uint32_t shift;
} num_inverse_t;

#define NUM_INVERSE_NONE ((num_inverse_t){.mantissa = 0u, .shift = 1u}) /* its product with any number is zero */

/* Never inlined: on these targets a call is cheap compared with its content, and flash is scarce. */
#define NUM_STEP static __attribute__((noinline))

/* The limit with the sign of a; counts a saturation. */
num_t num_limit(num_t a, uint32_t *saturations);

/* a / 2^22, to within +-most. Any a. */
num_t num_narrow_within(num_wide_t a, uint32_t *saturations, num_t most);

/* a / 2^shift. Precondition: shift 1 to 62, |a| at most 2^62. */
num_t num_rounded_within(int64_t a, uint32_t shift, uint32_t *saturations);

/* Rounds halves away from zero. Division by zero saturates with the sign of a (0 / 0 is positive). */
num_t num_div(num_t a, num_t b, uint32_t *saturations);

/* Rounded to nearest. A negative square counts as zero. A root above 511.99 saturates. */
num_t num_root(num_wide_t square);

static inline num_t num_abs(num_t a) {
    return (a >= 0) ? a : ((a < -INT32_MAX) ? INT32_MAX : -a);
}

/* a / 2^shift, rounded to nearest, halves up. Precondition: shift 1 to 31. */
static inline num_t num_reduced(num_t a, uint32_t shift) {
    const uint32_t offset = (uint32_t)1 << 31;
    const uint32_t twice = ((uint32_t)a + offset) >> (shift - 1u);
    return (num_t)((twice / 2u) + (twice % 2u) - (offset >> shift));
}

/* The same of 64 bits. Precondition: shift 1 to 62, |a| at most 2^62. */
static inline int64_t num_rounded(int64_t a, uint32_t shift) {
    const uint64_t offset = (uint64_t)1 << 63;
    const uint64_t half = (uint64_t)1 << (shift - 1u);
    return (int64_t)(((uint64_t)a + offset + half) >> shift) - (int64_t)(offset >> shift);
}

static inline num_t num_saturated(int64_t a, uint32_t *saturations) {
    if ((a > INT32_MAX) || (a < -INT32_MAX)) {
        return num_limit((a > 0) ? 1 : -1, saturations);
    }
    return (num_t)a;
}

static inline num_t num_from_int(int32_t a) {
    const int32_t held = (a > 511) ? 511 : ((a < -511) ? -511 : a);
    return held * 4194304;
}

static inline num_t num_add(num_t a, num_t b, uint32_t *saturations) {
    num_t sum = 0;
    const bool fits = !__builtin_add_overflow(a, b, &sum) && (sum >= -INT32_MAX);
    return fits ? sum : num_limit(a, saturations);
}

static inline num_t num_subtract(num_t a, num_t b, uint32_t *saturations) {
    num_t difference = 0;
    const bool fits = !__builtin_sub_overflow(a, b, &difference) && (difference >= -INT32_MAX);
    return fits ? difference : num_limit(a, saturations);
}

static inline num_wide_t num_wide(num_t a, num_t b) {
    return (int64_t)a * b;
}
static inline num_wide_t num_widen(num_t a) {
    return (int64_t)a * 4194304;
}

static inline int32_t num_upper(int64_t a) {
    return (int32_t)((uint64_t)a >> 32);
}

/* Whether a is in -2^bits to 2^bits - 1. Precondition: bits 32 to 62. */
static inline bool num_is_short(int64_t a, uint32_t bits) {
    const uint32_t limit = (uint32_t)1 << (bits - 32u);
    return ((uint32_t)num_upper(a) + limit) < (2u * limit);
}

static inline num_t num_narrow(num_wide_t a, uint32_t *saturations) {
    return num_is_short(a, 52u) ? (num_t)num_rounded(a, NUM_FRACTION) /* within +-256 */
                                : num_narrow_within(a, saturations, INT32_MAX);
}

static inline num_t num_narrow_factor(num_wide_t a, uint32_t *saturations) {
    return num_is_short(a, 49u) ? (num_t)num_rounded(a, NUM_FRACTION) /* within +-32 */
                                : num_narrow_within(a, saturations, NUM_FACTOR_MAX);
}

static inline num_t num_factor(num_t a, uint32_t *saturations) {
    if ((a > NUM_FACTOR_MAX) || (a < -NUM_FACTOR_MAX)) {
        ++*saturations;
        return (a > 0) ? NUM_FACTOR_MAX : -NUM_FACTOR_MAX;
    }
    return a;
}

static inline num_t num_mul(num_t a, num_t b, uint32_t *saturations) {
    return num_narrow(num_wide(a, b), saturations);
}

/* 2^30 / sqrt(x / 2^32) for x from 2^30 on: the result is 2^30 to 2^31, error 3e-9. Newton's y <- y (3 - x y^2) / 2
 * from the best straight line: error 8.6 %, then 1e-2, 2e-4, 5e-8, and rounding. */
NUM_STEP uint32_t num_newton(uint32_t x) {
    uint32_t y = 2290076544u - (uint32_t)(((uint64_t)x * 1308569208u) >> 32);
    for (uint32_t i = 0; i < 4u; ++i) {
        const uint32_t square = (uint32_t)(((uint64_t)y * y) >> 31);       /* Q29 */
        const uint32_t product = (uint32_t)(((uint64_t)x * square) >> 32); /* Q29, near 1 */
        y = (uint32_t)(((uint64_t)y * (1610612736u - product)) >> 30);
    }
    return y;
}

/* Number of leading zero bits of x, rounded down to even. Precondition: x is not zero. */
static inline uint32_t num_leading(uint64_t a) {
    return (uint32_t)__builtin_clzll(a) & ~1u;
}

/* Zero or less counts as the smallest square, 2^-44. */
static inline num_inverse_t num_inverse_root(num_wide_t square) {
    const uint64_t x = (square > 0) ? (uint64_t)square : 1u;
    const uint32_t leading = num_leading(x);
    return (num_inverse_t){.mantissa = num_newton((uint32_t)((x << leading) >> 32)), .shift = 40u - (leading / 2u)};
}

static inline num_t num_times(num_t a, num_inverse_t inverse, uint32_t *saturations) {
    const int64_t product = (int64_t)a * inverse.mantissa;
    return (inverse.shift > 32u) ? num_reduced(num_upper(product), inverse.shift - 32u) /* the rest changes no bit */
                                 : num_rounded_within(product, inverse.shift, saturations);
}

static inline bool num_finite(num_t a) {
    (void)a;
    return true;
}

/* Left shift that brings `size` into 16 to 32: the most bits that still leave room for sums of squares. */
static inline int32_t num_headroom(num_t largest) {
    return (largest > 0) ? (__builtin_clz((uint32_t)largest) - 5) : 0;
}

/* a * 2^shift. Precondition: shift -31 to 31. */
static inline num_t num_shift(num_t a, int32_t shift, uint32_t *saturations) {
    if (shift < 0) {
        return num_reduced(a, (uint32_t)-shift);
    }
    const num_t most = INT32_MAX >> shift;
    return ((a > most) || (a < -most)) ? num_limit(a, saturations) : (num_t)((uint32_t)a << shift);
}

/* a * unit, where |unit| is at most 1. */
static inline num_t num_unit_times(num_unit_t unit, num_t a) {
    return (num_t)num_rounded((int64_t)unit * a, 30u);
}

/* cosine * first + sine * second. A rotation keeps it in range unless an operand is at its limit. */
static inline num_t num_unit_turned(num_unit_t cosine, num_unit_t sine, num_t first, num_t second) {
    return (num_t)num_rounded(((int64_t)cosine * first) + ((int64_t)sine * second), 30u);
}

static inline num_t num_turned_first(num_unit_t cosine, num_unit_t sine, num_t first, num_t second,
                                     uint32_t *saturations) {
    return num_saturated(num_rounded(((int64_t)cosine * first) + ((int64_t)sine * second), 30u), saturations);
}

static inline num_t num_turned_second(num_unit_t cosine, num_unit_t sine, num_t first, num_t second,
                                      uint32_t *saturations) {
    return num_saturated(num_rounded(((int64_t)cosine * second) - ((int64_t)sine * first), 30u), saturations);
}

/* The rotation that turns the pair (first, second) onto the first axis; error 6e-9. The identity for (0, 0). */
static inline num_rotation_t num_rotation(num_t first, num_t second, uint32_t *saturations) {
    const num_wide_t square = num_wide(first, first) + num_wide(second, second);
    if (square == 0) {
        return (num_rotation_t){.cos = 1073741824, .sin = 0, .length = 0};
    }
    const num_inverse_t inverse = num_inverse_root(square);
    const num_unit_t cosine = (num_unit_t)num_rounded((int64_t)first * inverse.mantissa, inverse.shift - 8u);
    const num_unit_t sine = (num_unit_t)num_rounded((int64_t)second * inverse.mantissa, inverse.shift - 8u);
    return (num_rotation_t){
        .cos = cosine, .sin = sine, .length = num_turned_first(cosine, sine, first, second, saturations)};
}

/* size / 2^right * 2^left. */
static inline num_t num_rescaled(int64_t a, uint32_t right, uint32_t left) {
    const uint64_t size = (((uint64_t)((a < 0) ? -a : a)) >> right) << left;
    return (a < 0) ? -(num_t)size : (num_t)size;
}

/* The rotation for (first^2 - shift, first * second), except for its length. Precondition: sizes below 2^16. */
static inline num_rotation_t num_shifted_rotation(num_t first, num_t second, num_wide_t shift, uint32_t *saturations) {
    const int64_t along = num_wide(first, first) - shift;
    const int64_t across = num_wide(first, second);
    const int32_t excess = 36 - __builtin_clzll((uint64_t)((along < 0) ? -along : along) |
                                                (uint64_t)((across < 0) ? -across : across) | 1u); /* bits above 28 */
    const uint32_t right = (excess > 0) ? (uint32_t)excess : 0u;
    const uint32_t left = (excess < 0) ? (uint32_t)-excess : 0u;
    return num_rotation(num_rescaled(along, right, left), num_rescaled(across, right, left), saturations);
}

/* Cosine and sine of the angle of (along, across), in Q30; `across` as scaled by right, then left, to 30 bits. */
typedef struct {
    uint64_t across;
    uint32_t right;
    uint32_t left;
    uint32_t cos;
    uint32_t sin;
} num_double_angle_t;

/* Precondition: `across` is not 0. */
static inline num_double_angle_t num_double_angle(uint64_t along, uint64_t across) {
    const int32_t excess = 34 - __builtin_clzll(along | across); /* bits above 30 */
    const uint32_t right = (excess > 0) ? (uint32_t)excess : 0u;
    const uint32_t left = (excess < 0) ? (uint32_t)-excess : 0u;
    const uint64_t x = (along >> right) << left;
    const uint64_t y = (across >> right) << left;
    const uint64_t square = (x * x) + (y * y);
    const uint32_t leading = num_leading(square);
    const uint32_t inverse = num_newton((uint32_t)((square << leading) >> 32));
    const uint32_t down = 32u - (leading / 2u);
    return (num_double_angle_t){.across = y,
                                .right = right,
                                .left = left,
                                .cos = (uint32_t)((x * inverse) >> down),
                                .sin = (uint32_t)((y * inverse) >> down)};
}

static inline uint64_t num_wide_size(num_wide_t a) {
    return (uint64_t)((a < 0) ? -a : a);
}

/* The smaller eigenvalue of the symmetric matrix [a, b; b, c], to about 30 bits of the largest entry. It uses the
 * tangent of the angle that diagonalises the matrix, from cosine and sine of the double angle. Preconditions: entries
 * below 2^16 in size; a and c not negative. The result is not negative. */
static inline num_wide_t num_smaller_eigenvalue(num_wide_t a, num_wide_t c, num_wide_t b) {
    const int64_t smaller = (a < c) ? a : c;
    const uint64_t twice = 2u * num_wide_size(b);
    if (twice == 0u) {
        return smaller;
    }
    const num_double_angle_t angle = num_double_angle(num_wide_size(a - c), twice);
    /* tan t = sin 2t / (1 + cos 2t), in Q30 */
    const uint32_t tangent = (uint32_t)(((uint64_t)angle.sin << 30) / (1073741824u + (uint64_t)angle.cos));
    const int64_t exchange = (int64_t)((((angle.across * tangent) >> 31) >> angle.left) << angle.right);
    return (exchange > smaller) ? 0 : (smaller - exchange);
}

/* a / 2^bits, rounded down. Precondition: a is not negative; bits below 63. */
static inline num_wide_t num_wide_share(num_wide_t a, uint32_t bits) {
    return (num_wide_t)((uint64_t)a >> bits);
}

static inline bool num_wide_finite(num_wide_t a) {
    (void)a;
    return true;
}

/* a * b in Q30. Precondition: both within +-2. */
static inline int32_t num_mul30(int32_t a, int32_t b) {
    return (int32_t)num_rounded((int64_t)a * b, 30u);
}

/* Reduction to a quarter turn with pi / 2 in Q50 (error 2e-13 at the largest angle, 326 quarters), then Taylor
 * polynomials on +-pi/4 in Q30 (truncation error 1.8e-9). */
static inline num_sincos_t num_sincos(num_t angle) {
    const int64_t scaled = (int64_t)angle * 268435456;                             /* Q50 */
    const int32_t quarter = (int32_t)num_rounded((int64_t)angle * 683565276, 52u); /* 2 / pi in Q30 */
    const int32_t x = (int32_t)num_rounded(scaled - ((int64_t)quarter * 1768559438007110), 20u);
    const int32_t xx = num_mul30(x, x);
    int32_t s = num_mul30(xx, 2959) - 213044;
    s = num_mul30(xx, s) + 8947849;
    s = num_mul30(xx, s) - 178956971;
    s = x + num_mul30(x, num_mul30(xx, s));
    int32_t c = num_mul30(xx, -296) + 26631;
    c = num_mul30(xx, c) - 1491308;
    c = num_mul30(xx, c) + 44739243;
    c = num_mul30(xx, c) - 536870912;
    c = 1073741824 + num_mul30(xx, c);
    const num_t sine = (num_t)num_rounded(s, 8u);
    const num_t cosine = (num_t)num_rounded(c, 8u);
    const bool swap = ((uint32_t)quarter & 1u) != 0u;
    const num_t first = swap ? cosine : sine;
    const num_t second = swap ? sine : cosine;
    return (num_sincos_t){.sin = (((uint32_t)quarter & 2u) != 0u) ? -first : first,
                          .cos = ((((uint32_t)quarter + 1u) & 2u) != 0u) ? -second : second};
}
