/* num: the scalar of the whole firmware, and the only place that knows what it is.
 *
 * num_t is IEEE-754 binary32 by default and Q9.22 in an int32_t with TAUPERP_FIXED=1 (range +-512, step 2.4e-7).
 * Plain + - < work on both. Products, quotients, roots and angles go through num_*; a constant is written NUM(0.5).
 * No libm and no contraction: IEEE division and square root only, so that every target computes the same bits.
 *
 * A fixed-point result that does not fit saturates and adds one to the counter handed in; a float build has nothing
 * to count and drops the argument. The owner of the counter is always the state struct of the calling stage.
 */
#ifndef TAUPERP_NUM_H
#define TAUPERP_NUM_H

#include <stdbool.h>
#include <stdint.h>

#ifdef TAUPERP_FIXED
typedef int32_t num_t;
#else
typedef float num_t;
#endif

#endif
