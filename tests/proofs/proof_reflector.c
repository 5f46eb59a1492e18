/* firmware/core/reflector.h: any vector, from every start. The shift by the headroom of the largest entry leaves every
 * entry within 32 (proof_num_headroom). */
#define STUB_SHIFTED 134217728
#include "num_sizes.h"

#include "reflector.h"

void proof_reflector_make(void) {
    uint32_t saturations;
    for (uint32_t at = 0; at < REFLECTOR_ROWS; ++at) {
        num_t x[REFLECTOR_ROWS];
        (void)reflector_make(x, at, REFLECTOR_ROWS, &saturations);
    }
    REACHED;
}

/* Any reflector with entries below 2: it has the squared length 2. */
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
