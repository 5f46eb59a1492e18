/* num_fixed: num_t as Q9.22, a product as Q19.44. Included by num.h only.
 *
 * Values stay within +-INT32_MAX (symmetric, so that a sign can always be changed); a sum, product, quotient or
 * rounding that does not fit is held there and counted. Plain + and - are for where a bound is at hand. Everything is
 * defined C: no negative number is shifted, which the language leaves to the compiler.
 *
 * Errors, in steps of 2^-22 = 2.4e-7 and measured over the whole range by tests/unit/test_num.c: product and quotient
 * 0.5, root 0.5, sine and cosine 0.52 for every angle, a number times num_inverse_root 0.5 plus 3e-9 of the result.
 * The inverse root is Newton's iteration on 32 x 32 -> 64 bit products, a fixed number of times: only num_div divides.
 */
#define NUM_FRACTION 22u
#define NUM(x)       ((num_t)(((x) * 4194304.0) + (((x) < 0) ? -0.5 : 0.5)))
#define NUM_NUMERIC  2u

/* 1 / sqrt(.) as mantissa * 2^(22 - shift), so that x times it is x * mantissa / 2^shift. */
typedef struct {
    uint32_t mantissa;
    uint32_t shift;
} num_inverse_t;

typedef uint32_t num_angle_t; /* a small one: 2^-bits */
#define NUM_ANGLE(bits) (bits)

static inline num_t num_abs(num_t a) {
    return (a >= 0) ? a : ((a < -INT32_MAX) ? INT32_MAX : -a);
}

/* a / 2^shift to the nearest, halves up; shift 1 to 62, |a| at most 2^62. */
static inline int64_t num_rounded(int64_t a, uint32_t shift) {
    const uint64_t offset = (uint64_t)1 << 63;
    const uint64_t half = (uint64_t)1 << (shift - 1u);
    return (int64_t)(((uint64_t)a + offset + half) >> shift) - (int64_t)(offset >> shift);
}

static inline num_t num_saturated(int64_t a, uint32_t *saturations) {
    if ((a > INT32_MAX) || (a < -INT32_MAX)) {
        ++*saturations;
        return (a > 0) ? INT32_MAX : -INT32_MAX;
    }
    return (num_t)a;
}

static inline num_t num_from_int(int32_t a) {
    const int32_t held = (a > 511) ? 511 : ((a < -511) ? -511 : a);
    return held * 4194304;
}

static inline num_t num_add(num_t a, num_t b, uint32_t *saturations) {
    return num_saturated((int64_t)a + b, saturations);
}

static inline num_t num_subtract(num_t a, num_t b, uint32_t *saturations) {
    return num_saturated((int64_t)a - b, saturations);
}

static inline num_wide_t num_wide(num_t a, num_t b) {
    return (int64_t)a * b;
}
static inline num_wide_t num_widen(num_t a) {
    return (int64_t)a * 4194304;
}

static inline num_t num_narrow(num_wide_t a, uint32_t *saturations) {
    const int64_t limit = (int64_t)INT32_MAX * 4194304;
    if ((a > limit) || (a < -limit)) {
        ++*saturations;
        return (a > 0) ? INT32_MAX : -INT32_MAX;
    }
    return (num_t)num_rounded(a, NUM_FRACTION);
}

static inline num_t num_mul(num_t a, num_t b, uint32_t *saturations) {
    return num_narrow(num_wide(a, b), saturations);
}

/* Halves away from zero. Division by zero saturates with the sign of a (0 / 0 is positive). */
static inline num_t num_div(num_t a, num_t b, uint32_t *saturations) {
    const uint32_t divisor = (uint32_t)num_abs(b);
    const bool negative = (a < 0) != (b < 0);
    if (divisor == 0u) {
        ++*saturations;
        return (a < 0) ? -INT32_MAX : INT32_MAX;
    }
    const uint64_t quotient = (((uint64_t)num_abs(a) << NUM_FRACTION) + (divisor / 2u)) / divisor;
    return num_saturated(negative ? -(int64_t)quotient : (int64_t)quotient, saturations);
}

/* 2^30 / sqrt(x / 2^32) for x from 2^30 on, so from 2^30 to 2^31; within 3e-9. Newton's y <- y (3 - x y^2) / 2 from
 * the best straight line (8.6 %): 1e-2, 2e-4, 5e-8, and then the rounding. */
static inline uint32_t num_newton(uint32_t x) {
    uint32_t y = 2290076544u - (uint32_t)(((uint64_t)x * 1308569208u) >> 32);
    for (uint32_t i = 0; i < 4u; ++i) {
        const uint32_t square = (uint32_t)(((uint64_t)y * y) >> 31);       /* Q29 */
        const uint32_t product = (uint32_t)(((uint64_t)x * square) >> 32); /* Q29, near 1 */
        y = (uint32_t)(((uint64_t)y * (1610612736u - product)) >> 30);
    }
    return y;
}

/* The even number of zero bits in front of a number that is not zero. */
static inline uint32_t num_leading(uint64_t a) {
    return (uint32_t)__builtin_clzll(a) & ~1u;
}

/* To the nearest. A negative square counts as zero; a root above 511.99 is held there. */
static inline num_t num_root(num_wide_t square) {
    if (square <= 0) {
        return 0;
    }
    const uint64_t x = (uint64_t)square;
    const uint32_t leading = num_leading(x);
    const uint32_t top = (uint32_t)((x << leading) >> 32);
    uint64_t root = ((uint64_t)top * num_newton(top)) >> (30u + (leading / 2u));
    if (root > 0x1000000u) { /* 24 bits and more are not all exact yet: one step of Heron's, on 32 bits */
        const int32_t error = (int32_t)((int64_t)(x - (root * root)) / 128);
        const int32_t half = (int32_t)(root / 128u);
        root = (uint64_t)((int64_t)root + ((error + ((error < 0) ? -half : half)) / (2 * half)));
    }
    if ((root * root) > x) {
        --root;
    } else if ((x - (root * root)) > (2u * root)) {
        ++root;
    } else {
        /* it is the floor */
    }
    root += ((x - (root * root)) > root) ? 1u : 0u;
    return (root > (uint64_t)INT32_MAX) ? INT32_MAX : (num_t)root;
}

/* Of zero or less: as of the smallest square, 2^-44. */
static inline num_inverse_t num_inverse_root(num_wide_t square) {
    const uint64_t x = (square > 0) ? (uint64_t)square : 1u;
    const uint32_t leading = num_leading(x);
    return (num_inverse_t){.mantissa = num_newton((uint32_t)((x << leading) >> 32)), .shift = 40u - (leading / 2u)};
}

static inline num_t num_times(num_t a, num_inverse_t inverse, uint32_t *saturations) {
    return num_saturated(num_rounded((int64_t)a * inverse.mantissa, inverse.shift), saturations);
}

static inline bool num_finite(num_t a) {
    (void)a;
    return true;
}

/* A block of numbers is multiplied by 2^headroom to bring its largest size into 16 to 32: all of the bits that sums of
 * squares leave room for. */
static inline int32_t num_headroom(num_t largest) {
    return (largest > 0) ? (__builtin_clz((uint32_t)largest) - 5) : 0;
}

/* a * 2^shift, shift -31 to 31. */
static inline num_t num_shift(num_t a, int32_t shift, uint32_t *saturations) {
    if (shift >= 0) {
        return num_saturated((int64_t)a * ((int64_t)1 << shift), saturations);
    }
    return (num_t)num_rounded(a, (uint32_t)-shift);
}

/* Whether two columns are orthogonal but for such an angle: what it takes to make them so turns them by no more, or
 * their inner product is within four steps of the longer one's length, which is what rounding leaves of it.
 * Precondition: the block is scaled by its headroom. */
static inline bool num_orthogonal(num_wide_t first, num_wide_t second, num_wide_t inner, num_angle_t angle) {
    const uint64_t longer = (uint64_t)((second < first) ? first : second);
    const uint64_t size = (uint64_t)((inner < 0) ? -inner : inner);
    return (size <= (longer >> angle)) || ((size < ((uint64_t)1 << 32)) && ((size * size) <= (16u * longer)));
}

/* The rotation that makes two columns orthogonal, from their squared lengths, which it updates, and their inner
 * product: the smaller of the two angles. With the double angle's cosine and sine from one inverse root,
 * cos^2 = (1 + cos 2t) / 2 and 1 / cos from another. Preconditions: as of num_orthogonal, which is false; squares
 * below 2^16. */
static inline num_rotation_t num_orthogonalise(num_wide_t *first, num_wide_t *second, num_wide_t inner) {
    const bool shrinks = *second < *first; /* the second is the shorter one and gets shorter still */
    const uint64_t difference = (uint64_t)(shrinks ? (*first - *second) : (*second - *first));
    const uint64_t twice = 2u * (uint64_t)((inner < 0) ? -inner : inner);
    const int32_t excess = 34 - __builtin_clzll(difference | twice); /* over 30 bits */
    const uint32_t right = (excess > 0) ? (uint32_t)excess : 0u;
    const uint32_t left = (excess < 0) ? (uint32_t)-excess : 0u;
    const uint64_t along = (difference >> right) << left;
    const uint64_t across = (twice >> right) << left;

    const uint64_t square = (along * along) + (across * across);
    const uint32_t leading = num_leading(square);
    const uint32_t inverse = num_newton((uint32_t)((square << leading) >> 32));
    const uint32_t down = 32u - (leading / 2u);
    const uint32_t cosine_double = (uint32_t)((along * inverse) >> down); /* Q30 */
    const uint32_t sine_double = (uint32_t)((across * inverse) >> down);
    const uint64_t cosine_square = (uint64_t)(1073741824u + cosine_double) * 2u; /* Q32, from 0.5 to 1 */
    const uint32_t held = (cosine_square > UINT32_MAX) ? UINT32_MAX : (uint32_t)cosine_square;
    const uint32_t secant = num_newton(held);                                 /* Q30 */
    const uint32_t cosine = (uint32_t)(((uint64_t)held * secant) >> 32);      /* Q30 */
    const uint32_t sine = (uint32_t)(((uint64_t)sine_double * secant) >> 31); /* Q30 */
    const uint32_t tangent = (uint32_t)(((uint64_t)sine * secant) >> 30);     /* Q30, at most 1 */

    const int64_t exchange = (int64_t)((((across * tangent) >> 31) >> left) << right);
    *first += shrinks ? exchange : -exchange;
    *second += shrinks ? -exchange : exchange;
    *first = (*first < 0) ? 0 : *first;
    *second = (*second < 0) ? 0 : *second;
    const num_t size = (num_t)((sine + 128u) >> 8);
    return (num_rotation_t){.sin = (shrinks != (inner < 0)) ? -size : size, .cos = (num_t)((cosine + 128u) >> 8)};
}

/* a * b of Q30, both within +-2. */
static inline int32_t num_mul30(int32_t a, int32_t b) {
    return (int32_t)num_rounded((int64_t)a * b, 30u);
}

/* Reduction to a quarter turn with pi / 2 in Q50 (exact to 2e-13 after the largest angle's 326 quarters), Taylor's
 * polynomials on +-pi/4 in Q30: 1.8e-9 is cut off. */
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
