/* reflector: Householder's reflection I - u u^T along the joints, where u has the squared length 2. The index at which
 * a reflector starts should be a compile-time constant: the compiler then makes a copy for each start (NUM_STEP).
 */
#ifndef TAUPERP_REFLECTOR_H
#define TAUPERP_REFLECTOR_H

#include "robot.h"

#define REFLECTOR_ROWS ROBOT_JOINTS

/* A vector this short counts as zero: the square of a rounding residue may have no exact float. */
#define REFLECTOR_NOTHING NUM(1e-15)

/* Replaces x by the vector u whose reflection maps x onto the axis of entry `at`; u is zero if x is. Returns the image
 * of x on that axis. Only entries `at` to `end` - 1 are used. */
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
    const num_t image = (x[at] < NUM(0)) ? length : -length; /* the sign without cancellation */
    x[at] -= image;
    const num_inverse_t inverse =
        (length <= REFLECTOR_NOTHING) ? NUM_INVERSE_NONE : num_inverse_root(num_wide(length, num_abs(x[at])));
    for (uint32_t i = at; i < end; ++i) {
        x[i] = num_times(x[i], inverse, saturations);
    }
    return num_shift(image, -shift, saturations);
}

/* to = (I - u u^T) from, for a reflector u that starts at `at`. Entries before `at` are copied. */
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
