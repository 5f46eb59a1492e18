/* num: the scalar type of the whole firmware. No other file depends on its representation.
 *
 * num_t is IEEE-754 binary32 by default. With TAUPERP_FIXED=1 it is Q9.22 in an int32_t (range +-512, step 2.4e-7).
 * Plain + - < work on both where a bound excludes overflow; num_add and num_subtract saturate. Products, quotients,
 * roots and angles use num_*. Constants are written NUM(0.5). The code uses IEEE division and square root only, without
 * libm and without contraction, so that every target computes the same bits.
 *
 * num_wide_t holds a product or a sum of products before rounding (the same float, or Q19.44 in an int64_t). A dot
 * product is thus rounded once: num_narrow(num_wide(a, b) + num_wide(c, d), &saturations). A sum may hold at most eight
 * products, each with one factor below 64 in size. Otherwise the 64 bits could overflow. num_narrow_factor rounds a sum
 * to such a factor, and num_factor limits a number to one. A larger value saturates. In float they change nothing.
 *
 * A vector whose squares are summed is first multiplied by 2^num_headroom(largest size), with num_shift. In fixed point
 * this keeps the squares in range and the bits of small entries. In float both are no-ops.
 *
 * A fixed-point result that does not fit saturates and increments the counter argument, which belongs to the state
 * struct of the calling stage. In float the counter never changes. No function fails: a float computation continues
 * with NaN or infinity, and num_finite() reports them.
 */
#ifndef TAUPERP_NUM_H
#define TAUPERP_NUM_H

#include <stdbool.h>
#include <stdint.h>

#ifdef TAUPERP_FIXED
typedef int32_t num_t;
typedef int64_t num_wide_t;
typedef int32_t num_unit_t;
#else
typedef float num_t;
typedef float num_wide_t;
typedef float num_unit_t;
#endif

typedef struct {
    num_t sin, cos;
} num_sincos_t;

/* A plane rotation first' = cos first + sin second, second' = cos second - sin first. Cosine and sine are num_unit_t:
 * the same float, or Q2.30. */
typedef struct {
    num_unit_t cos, sin;
    num_t length; /* of the pair that the rotation turns onto the first axis */
} num_rotation_t;

#ifndef TAUPERP_CDEF

#ifdef TAUPERP_FIXED
#include "num_fixed.h"
#else
#include "num_float.h"
#endif

static inline num_t num_min(num_t a, num_t b) {
    return (b < a) ? b : a;
}
static inline num_t num_max(num_t a, num_t b) {
    return (b > a) ? b : a;
}

#endif
#endif
