/* square_any: any square of square_fixed.h, for the harnesses of that file and of its caller. */
#ifndef TAUPERP_SQUARE_ANY_H
#define TAUPERP_SQUARE_ANY_H

#include "proof.h"
#include "square.h"

static bool is_square(square_t a) {
    const bool zero = (a.mantissa == 0u) && (a.bits == 0u);
    return zero || ((a.mantissa >= (1u << 30)) && (a.mantissa < (1u << 31)) && (a.bits <= 63u));
}

static square_t any_square(void) {
    square_t a;
    ASSUME(is_square(a));
    return a;
}

#endif
