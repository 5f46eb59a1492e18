/* num_float: num_t as binary32. Included by num.h only.
 *
 * sqrt is the compiler's builtin: one instruction on every target with a float unit, and IEEE exact on all targets. No
 * library is called. A number times num_inverse_root: relative error 1.8e-7 (tests/unit/test_num_range.c). Sine and
 * cosine: error at most 1.2e-7 for |angle| <= 32 rad (measured over the whole range by tests/unit/test_num.c). The
 * error grows in proportion to larger angles. Up to 1e5 rad the results stay within -1.0001 to 1.0001.
 */
#define NUM(x)      ((num_t)(x))
#define NUM_NUMERIC 1u

/* Without -fno-math-errno the builtin calls sqrtf for negative numbers to set errno. The instruction is then used
 * directly, so that no program needs libm. */
static inline float num_float_root(float square) {
#if !defined(__NO_MATH_ERRNO__) && (defined(__x86_64__) || defined(__aarch64__))
    float root;
#ifdef __x86_64__
    __asm__("sqrtss %1, %0" : "=x"(root) : "x"(square));
#else
    __asm__("fsqrt %s0, %s1" : "=w"(root) : "w"(square));
#endif
    return root;
#else
    return __builtin_sqrtf(square);
#endif
}

typedef float num_inverse_t; /* 1 / sqrt(.) */

#define NUM_INVERSE_NONE 0.0f /* its product with any number is zero */

/* Force inlining so that each call specialises on its constant arguments. Never on soft-float targets. */
#ifdef __SOFTFP__
#define NUM_STEP static __attribute__((noinline))
#else
#define NUM_STEP static inline __attribute__((always_inline))
#endif

static inline num_t num_abs(num_t a) {
    return __builtin_fabsf(a);
}

static inline num_t num_from_int(int32_t a) {
    return (num_t)a;
}
static inline num_wide_t num_wide(num_t a, num_t b) {
    return a * b;
}
static inline num_wide_t num_widen(num_t a) {
    return a;
}

static inline num_t num_narrow(num_wide_t a, uint32_t *saturations) {
    (void)saturations;
    return a;
}

static inline num_t num_narrow_factor(num_wide_t a, uint32_t *saturations) {
    return num_narrow(a, saturations);
}

static inline num_t num_factor(num_t a, uint32_t *saturations) {
    (void)saturations;
    return a;
}

static inline num_t num_add(num_t a, num_t b, uint32_t *saturations) {
    (void)saturations;
    return a + b;
}

static inline num_t num_subtract(num_t a, num_t b, uint32_t *saturations) {
    (void)saturations;
    return a - b;
}

static inline num_t num_mul(num_t a, num_t b, uint32_t *saturations) {
    (void)saturations;
    return a * b;
}

static inline num_t num_div(num_t a, num_t b, uint32_t *saturations) {
    (void)saturations;
    return a / b;
}

static inline num_t num_root(num_wide_t square) {
    return num_float_root(square);
}

static inline num_inverse_t num_inverse_root(num_wide_t square) {
    return 1.0f / num_float_root(square);
}

static inline num_t num_times(num_t a, num_inverse_t inverse, uint32_t *saturations) {
    (void)saturations;
    return a * inverse;
}

static inline int32_t num_headroom(num_t largest) {
    (void)largest;
    return 0;
}

static inline num_t num_shift(num_t a, int32_t shift, uint32_t *saturations) {
    (void)shift;
    (void)saturations;
    return a;
}

/* False for NaN and infinity, whose exponent bits are all ones. */
static inline bool num_finite(num_t a) {
    return (a - a) == 0.0f;
}

static inline num_t num_unit_times(num_unit_t unit, num_t a) {
    return unit * a;
}

/* cosine * first + sine * second. */
static inline num_t num_unit_turned(num_unit_t cosine, num_unit_t sine, num_t first, num_t second) {
    return cosine * first + sine * second;
}

static inline num_t num_turned_first(num_unit_t cosine, num_unit_t sine, num_t first, num_t second,
                                     uint32_t *saturations) {
    (void)saturations;
    return cosine * first + sine * second;
}

static inline num_t num_turned_second(num_unit_t cosine, num_unit_t sine, num_t first, num_t second,
                                      uint32_t *saturations) {
    (void)saturations;
    return cosine * second - sine * first;
}

/* The rotation that turns the pair (first, second) onto the first axis. The identity for a pair shorter than 1e-15,
 * whose square may have no exact float. */
static inline num_rotation_t num_rotation(num_t first, num_t second, uint32_t *saturations) {
    (void)saturations;
    const float length = num_float_root(first * first + second * second);
    if (length <= 1e-15f) {
        return (num_rotation_t){.cos = 1.0f, .sin = 0.0f, .length = first};
    }
    const float inverse = 1.0f / length;
    return (num_rotation_t){.cos = first * inverse, .sin = second * inverse, .length = length};
}

/* The rotation for (first^2 - shift, first * second), except for its length. */
static inline num_rotation_t num_shifted_rotation(num_t first, num_t second, num_wide_t shift, uint32_t *saturations) {
    return (first == 0.0f) ? num_rotation(1.0f, 0.0f, saturations)
                           : num_rotation(first - shift / first, second, saturations);
}

/* The smaller eigenvalue of the symmetric matrix [a, b; b, c]. */
static inline num_wide_t num_smaller_eigenvalue(num_wide_t a, num_wide_t c, num_wide_t b) {
    const float difference = a - c;
    const float twice = b + b;
    const float sum = __builtin_fabsf(difference) + num_float_root(difference * difference + twice * twice);
    const float smaller = (difference < 0.0f) ? a : c;
    return (sum > 0.0f) ? (smaller - b * (twice / sum)) : smaller;
}

/* a / 2^bits; bits 1 to 62. */
static inline num_wide_t num_wide_share(num_wide_t a, uint32_t bits) {
    return a / (float)((uint64_t)1 << bits);
}

static inline bool num_wide_finite(num_wide_t a) {
    return (a - a) == 0.0f;
}

/* Cody and Waite's reduction to a quarter turn in three parts, then minimax polynomials on +-pi/4. */
static inline num_sincos_t num_sincos(num_t angle) {
    const float magic = 12582912.0f; /* 1.5 * 2^23: adding it rounds to an integer, in the sum's lowest bits */
    const float shifted = angle * 0.636619772f + magic;
    const float k = shifted - magic;
    uint32_t quarter;
    __builtin_memcpy(&quarter, &shifted, sizeof(quarter));
    const float x = ((angle - k * 1.5703125f) - k * 4.83751297e-4f) - k * 7.54978995e-8f;
    const float xx = x * x;
    const float s = x + x * xx * (-1.66666547e-1f + xx * (8.33216087e-3f + xx * -1.95152959e-4f));
    const float c = 1.0f + xx * (-0.5f + xx * (4.16666456e-2f + xx * (-1.38873163e-3f + xx * 2.44331571e-5f)));
    const bool swap = (quarter & 1u) != 0u;
    const float sine = swap ? c : s;
    const float cosine = swap ? s : c;
    return (num_sincos_t){.sin = ((quarter & 2u) != 0u) ? -sine : sine,
                          .cos = (((quarter + 1u) & 2u) != 0u) ? -cosine : cosine};
}
