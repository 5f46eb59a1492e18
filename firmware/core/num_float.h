/* num_float: num_t as binary32. Included by num.h only.
 *
 * sqrt comes from the compiler's builtin, which is one instruction on every target that has a float unit (and IEEE
 * exact on all): with -fno-math-errno no library is called. Angles: error of sine and cosine at most 1.2e-7 for
 * |angle| <= 32 rad (measured over the whole range by tests/unit/test_num.c); larger angles lose accuracy in
 * proportion and never more than the value range of -1.0001 to 1.0001 while the argument is finite.
 */
#define NUM(x)      ((num_t)(x))
#define NUM_NUMERIC 1u

typedef float num_inverse_t; /* 1 / sqrt(.) */
typedef float num_angle_t;   /* a small one */

#define NUM_ANGLE(bits) (1.0f / (float)(1ul << (bits))) /* 2^-bits */

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
    return __builtin_sqrtf(square);
}

static inline num_inverse_t num_inverse_root(num_wide_t square) {
    return 1.0f / __builtin_sqrtf(square);
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

/* False for NaN and infinity: both are what they are by an exponent of all ones. */
static inline bool num_finite(num_t a) {
    return (a - a) == 0.0f;
}

/* Whether two columns are orthogonal but for such an angle: what it takes to make them so turns them by no more, or
 * their inner product is so small that its square has no exact float. */
static inline bool num_orthogonal(num_wide_t first, num_wide_t second, num_wide_t inner, num_angle_t angle) {
    const float limit = angle * (first + second);
    return inner * inner <= limit * limit;
}

/* The rotation that makes two columns orthogonal, from their squared lengths, which it updates, and their inner
 * product: the smaller of the two angles (Rutishauser 1966). Precondition: not num_orthogonal. */
static inline num_rotation_t num_orthogonalise(num_wide_t *first, num_wide_t *second, num_wide_t inner) {
    const float difference = *second - *first;
    const float twice = inner + inner;
    const float length = __builtin_sqrtf(difference * difference + twice * twice);
    const float tangent = twice / (difference + ((difference < 0.0f) ? -length : length));
    const float cosine = 1.0f / __builtin_sqrtf(1.0f + tangent * tangent);
    *first -= tangent * inner;
    *second += tangent * inner;
    return (num_rotation_t){.sin = cosine * tangent, .cos = cosine};
}

/* Cody and Waite's reduction to a quarter turn in three parts, then minimax polynomials on +-pi/4. */
static inline num_sincos_t num_sincos(num_t angle) {
    const float turns = angle * 0.636619772f;
    const float bounded = (turns > 1.0e6f) ? 1.0e6f : ((turns > -1.0e6f) ? turns : -1.0e6f); /* NaN becomes -1e6 */
    const int32_t quarter = (int32_t)(bounded + ((bounded < 0.0f) ? -0.5f : 0.5f));
    const float k = (float)quarter;
    const float x = ((angle - k * 1.5703125f) - k * 4.83751297e-4f) - k * 7.54978995e-8f;
    const float xx = x * x;
    const float s = x + x * xx * (-1.66666547e-1f + xx * (8.33216087e-3f + xx * -1.95152959e-4f));
    const float c = 1.0f + xx * (-0.5f + xx * (4.16666456e-2f + xx * (-1.38873163e-3f + xx * 2.44331571e-5f)));
    const bool swap = ((uint32_t)quarter & 1u) != 0u;
    const float sine = swap ? c : s;
    const float cosine = swap ? s : c;
    return (num_sincos_t){.sin = (((uint32_t)quarter & 2u) != 0u) ? -sine : sine,
                          .cos = ((((uint32_t)quarter + 1u) & 2u) != 0u) ? -cosine : cosine};
}
