/* square_float: square.h for binary32. Included by square.h only. */

typedef float square_t;
typedef float square_size_t; /* of a square: itself */

static inline square_t square_of(num_wide_t a) {
    return a;
}

static inline square_size_t square_size(square_t a) {
    return a;
}

static inline square_size_t square_share(square_size_t a, uint32_t bits) {
    return a / (float)((uint64_t)1 << bits);
}

static inline bool square_is_longer(square_t a, square_t b) {
    return a > b;
}

/* A square below 1e-16 counts as zero: the product of such may have no exact float. */
static inline bool square_is_orthogonal(num_wide_t along, square_t first, square_t second, uint32_t bits) {
    const float share = 1.0f / (float)((uint32_t)1 << bits);
    return (first <= 1e-16f) || (second <= 1e-16f) ||
           (__builtin_fabsf(along) <= (share * num_float_root(first) * num_float_root(second)));
}

static inline num_rotation_t square_orthogonalise(square_t *longer, square_t *shorter, num_wide_t along) {
    const float difference = *longer - *shorter;
    const float twice = along + along;
    const float sum = difference + num_float_root((difference * difference) + (twice * twice));
    if (!(sum > 0.0f)) {
        return (num_rotation_t){.cos = 1.0f, .sin = 0.0f, .length = 0.0f};
    }
    const float tangent = twice / sum;
    const float cosine = 1.0f / num_float_root(1.0f + (tangent * tangent));
    *longer += tangent * along;
    *shorter -= tangent * along;
    return (num_rotation_t){.cos = cosine, .sin = tangent * cosine, .length = 0.0f};
}
