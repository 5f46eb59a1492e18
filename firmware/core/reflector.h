/* reflector: Householder's reflection I - u u^T, u of squared length 2, along the joints. The index at which a
 * reflector begins is worth a constant: each of these is a copy of its own there (NUM_STEP).
 */
#ifndef TAUPERP_REFLECTOR_H
#define TAUPERP_REFLECTOR_H

#include "robot.h"

#define REFLECTOR_ROWS ROBOT_JOINTS

/* A vector this short is zero: the square of what rounding leaves of a zero may have no exact float. */
#define REFLECTOR_NOTHING NUM(1e-15)

/* The vector u of squared length 2, in place of x, whose reflection sends x onto the axis of entry `at`; zero when x
 * is. Returns what x becomes there. Entries `at` to `end` - 1. */
NUM_STEP num_t reflector_make(num_t x[], const uint32_t at, const uint32_t end, uint32_t *saturations) {
    num_t size = NUM(0);
    for (uint32_t i = at; i < end; ++i) {
        size = num_max(size, num_abs(x[i]));
    }
    const int32_t shift = num_headroom(size);
    num_wide_t square = num_widen(NUM(0));
    for (uint32_t i = at; i < end; ++i) {
        x[i] = num_shift(x[i], shift, saturations);
        square += num_wide(x[i], x[i]);
    }
    const num_t length = num_root(square);
    const num_t image = (x[at] < NUM(0)) ? length : -length; /* the sign that cancels nothing */
    x[at] -= image;
    const num_inverse_t inverse =
        (length <= REFLECTOR_NOTHING) ? NUM_INVERSE_NONE : num_inverse_root(num_wide(length, num_abs(x[at])));
    for (uint32_t i = at; i < end; ++i) {
        x[i] = num_times(x[i], inverse, saturations);
    }
    return num_shift(image, -shift, saturations);
}

/* to = (I - u u^T) from, for a reflector u that begins at `at`; what is before stays as it is. */
NUM_STEP void reflector_apply(const num_t u[], const num_t from[], num_t to[], const uint32_t at,
                              uint32_t *saturations) {
    num_t x[REFLECTOR_ROWS];
    num_wide_t along = num_widen(NUM(0));
    for (uint32_t i = at; i < REFLECTOR_ROWS; ++i) {
        x[i] = from[i];
        along += num_wide(u[i], x[i]);
    }
    const num_t scale = num_narrow(along, saturations);
    for (uint32_t i = at; i < REFLECTOR_ROWS; ++i) {
        to[i] = num_narrow(num_widen(x[i]) - num_wide(scale, u[i]), saturations);
    }
}

#endif
