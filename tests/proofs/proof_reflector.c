/* firmware/core/reflector.h: any vector, from every start to every end. The shift by the headroom of the largest entry
 * leaves every entry within 32 (proof_num_headroom). */
#include "length_stub.h"

#include "reflector.h"

static void make_from(const uint32_t at, uint32_t end) {
    num_t x[REFLECTOR_ROWS];
    uint32_t saturations;
    largest = 0;
    (void)reflector_make(x, at, end, &saturations);
    for (uint32_t i = at; i < REFLECTOR_ROWS; ++i) {
        HOLDS((i >= end) || stub_below(x[i], 23u), "an entry of a reflector is below 2");
    }
}

void proof_reflector_make(void) {
    make_from(0u, REFLECTOR_ROWS);
    REACHED;
}

void proof_reflector_make_next(void) {
    for (uint32_t at = 1; at < REFLECTOR_ROWS; ++at) {
        make_from(at, REFLECTOR_ROWS);
    }
    REACHED;
}

/* A row: it ends with the columns. */
void proof_reflector_make_row(void) {
    for (uint32_t at = 1; at < 5u; ++at) {
        for (uint32_t columns = at + 2u; columns <= 6u; ++columns) {
            make_from(at, columns);
        }
    }
    REACHED;
}

/* Any reflector with entries below 2, as reflector_make leaves it. */
void proof_reflector_apply(void) {
    num_t u[REFLECTOR_ROWS];
    uint32_t saturations;
    for (uint32_t i = 0; i < REFLECTOR_ROWS; ++i) {
        ASSUME(stub_below(u[i], 23u));
    }
    for (uint32_t at = 0; at < REFLECTOR_ROWS; ++at) {
        num_t x[REFLECTOR_ROWS];
        reflector_apply(u, x, x, at, &saturations);
    }
    REACHED;
}
