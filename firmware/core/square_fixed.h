/* square_fixed: square.h for Q9.22. Included by square.h only.
 *
 * A square keeps its highest 31 bits, so a rotation is found with products of 32 bits and two short divisions. Its
 * angle has a relative error of 5e-4, which leaves that much of the inner product; the next sweep removes it. Cosine
 * and sine fit each other to 3e-9, so both vectors keep their lengths.
 */

/* mantissa * 2^(bits - 31). Zero has no bits; any other mantissa has 31. */
typedef struct {
    uint32_t mantissa;
    uint32_t bits; /* of the square, at most 63 */
} square_t;

typedef uint32_t square_size_t; /* number of bits */

static inline square_size_t square_bits(uint64_t a) {
    return (a > 0u) ? (64u - (uint32_t)__builtin_clzll(a)) : 0u;
}

static inline square_t square_of(num_wide_t a) {
    const uint64_t square = (uint64_t)a;
    const uint32_t bits = square_bits(square);
    return (square_t){.mantissa = (uint32_t)((square << (63u - bits)) >> 32), .bits = bits};
}

static inline square_size_t square_size(square_t a) {
    return a.bits;
}

static inline square_size_t square_share(square_size_t a, uint32_t bits) {
    return (a > bits) ? (a - bits) : 0u;
}

static inline bool square_is_longer(square_t a, square_t b) {
    return (a.bits > b.bits) || ((a.bits == b.bits) && (a.mantissa > b.mantissa));
}

static inline bool square_is_orthogonal(num_wide_t along, square_t first, square_t second, uint32_t bits) {
    return (2u * (square_bits(num_wide_size(along)) + bits + 1u)) <= (first.bits + second.bits);
}

/* The high word: a b / 2^32. */
static inline uint32_t square_high(uint32_t a, uint32_t b) {
    return (uint32_t)(((uint64_t)a * b) >> 32);
}

/* Length of (x, y), relative error 4e-4, and 1e-6 where one is below a tenth of the other. Precondition: the larger has
 * 30 bits. */
static inline uint32_t square_near_length(uint32_t x, uint32_t y) {
    const uint32_t unit = ((x > y) ? x : y) >> 15;
    const uint32_t ratio = ((x > y) ? y : x) / unit; /* Q15 */
    const uint32_t w = (ratio * ratio) >> 15;
    /* sqrt(1 + w) = 1 + w (0.5 - w (0.1195 - 0.0337 w)) */
    const uint32_t slope = 16384u - ((w * (3916u - ((w * 1105u) >> 15))) >> 15);
    return unit * (32768u + ((w * slope) >> 15));
}

/* Tangent, in Q31, of half the angle of (x, y): y / (x + length). Relative error as of square_near_length, and 2^-14.
 * Preconditions: the larger has 30 bits; y is not 0. */
static inline uint32_t square_half_tangent(uint32_t x, uint32_t y) {
    const uint32_t sum = x + square_near_length(x, y);
    const uint32_t leading = (uint32_t)__builtin_clz(y);    /* 2 to 31 */
    const uint32_t quotient = (y << leading) / (sum >> 15); /* in Q(15 + leading), at most 18 bits */
    const uint32_t tangent = (leading < 16u) ? (quotient << (16u - leading)) : (quotient >> (leading - 16u));
    return (tangent < 2147483648u) ? tangent : 2147483648u;
}

static inline num_rotation_t square_orthogonalise(square_t *longer, square_t *shorter, num_wide_t along) {
    const uint32_t down = longer->bits - shorter->bits;
    const uint32_t least = (down < 32u) ? (shorter->mantissa >> down) : 0u;
    const uint32_t size = (uint32_t)((num_wide_size(along) << (63u - longer->bits)) >> 32);
    const uint32_t across = (size < longer->mantissa) ? size : longer->mantissa;
    if (across < 2u) {
        return (num_rotation_t){.cos = 1073741824, .sin = 0, .length = 0};
    }
    const uint32_t x = (longer->mantissa - least) / 4u;
    const uint32_t y = across / 2u;
    const uint32_t left = (uint32_t)__builtin_clz(x | y) - 2u;
    const uint32_t tangent = square_half_tangent(x << left, y << left);
    const uint32_t cosine = num_newton(1073741824u + square_high(tangent, tangent)); /* Q31 */
    const int32_t sine = (int32_t)square_high(tangent, cosine);
    const uint32_t exchange = 2u * square_high(tangent, across);
    const uint32_t most = longer->mantissa + exchange;
    const uint32_t carry = most >> 31;
    const uint32_t rest = (least > exchange) ? (least - exchange) : 0u;
    const uint32_t up = (rest > 0u) ? ((uint32_t)__builtin_clz(rest) - 1u) : 0u;
    const uint32_t bits = (rest > 0u) ? square_share(longer->bits, up) : 0u;
    *shorter = (square_t){.mantissa = (bits > 0u) ? (rest << up) : 0u, .bits = bits};
    *longer = (square_t){.mantissa = most >> carry, .bits = (longer->bits < 63u) ? (longer->bits + carry) : 63u};
    return (num_rotation_t){.cos = (int32_t)(cosine / 2u), .sin = (along < 0) ? -sine : sine, .length = 0};
}
