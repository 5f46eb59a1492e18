/* reflector_stub: reflector.h as stubs (proofs.toml). proof_reflector.c shows what they promise. */
#ifndef TAUPERP_REFLECTOR_STUB_H
#define TAUPERP_REFLECTOR_STUB_H

#include "num_sizes.h"
#include "reflector.h"

/* From `at` on, no entry of a reflector has the size 2: its squared length is 2. */
static inline bool is_reflector(const num_t u[], uint32_t at) {
    bool below = true;
    for (uint32_t i = 0; i < REFLECTOR_ROWS; ++i) {
        below = below && ((i < at) || stub_below(u[i], 23u));
    }
    return below;
}

num_t stub_make(num_t x[], uint32_t at, uint32_t end, uint32_t *saturations) {
    HOLDS((at < end) && (end <= REFLECTOR_ROWS), "entries of a vector");
    HOLDS(__CPROVER_w_ok(x, end * sizeof(*x)), "the vector is there");
    for (uint32_t i = 0; i < REFLECTOR_ROWS; ++i) {
        if ((i >= at) && (i < end)) {
            num_t any;
            ASSUME(stub_below(any, 23u));
            x[i] = any;
        }
    }
    return stub_number(saturations);
}

void stub_apply(const num_t u[], const num_t from[], num_t to[], uint32_t at, uint32_t *saturations) {
    HOLDS(is_reflector(u, at), "a reflector");
    HOLDS(__CPROVER_r_ok(from, REFLECTOR_ROWS * sizeof(*from)), "the vector is there");
    HOLDS(__CPROVER_w_ok(to, REFLECTOR_ROWS * sizeof(*to)), "the result is there");
    for (uint32_t i = 0; i < REFLECTOR_ROWS; ++i) {
        if (i >= at) {
            to[i] = stub_number(saturations);
        }
    }
}

#endif
