/* num: the scalar of the whole firmware, and the only place that knows what it is.
 *
 * num_t is IEEE-754 binary32 by default and Q9.22 in an int32_t with TAUPERP_FIXED=1 (range +-512, step 2.4e-7).
 * Plain + - < work on both where a bound rules overflow out; num_add and num_subtract saturate. Products, quotients,
 * roots and angles go through num_*; a constant is written NUM(0.5).
 * No libm and no contraction: IEEE division and square root only, so that every target computes the same bits.
 *
 * num_wide_t holds a product or a sum of products before it is rounded (the same float, or Q19.44 in an int64_t), so
 * that a dot product is rounded once: num_narrow(num_wide(a, b) + num_wide(c, d), &saturations). A sum may hold at
 * most eight products of which one factor each is below 64 in size: beyond, the 64 bits could overflow.
 *
 * A block of numbers that is squared and summed is first multiplied by 2^num_headroom of its largest size, by
 * num_shift: that keeps the squares in range and the small ones' bits. A float has exponents and shifts by nothing.
 *
 * A fixed-point result that does not fit saturates and adds one to the counter handed in; a float has nothing to
 * count. The counter belongs to the state struct of the calling stage. Nothing here fails; a float computes on with
 * NaN or infinity, and num_finite() tells.
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

/* A plane rotation, first' = cos first + sin second, second' = cos second - sin first, its cosine and sine as
 * num_unit_t: the same float, or Q2.30. */
typedef struct {
    num_unit_t cos, sin;
    num_t length; /* of the pair that it was made to turn onto the first axis */
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
