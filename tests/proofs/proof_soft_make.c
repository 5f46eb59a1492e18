/* firmware/core/soft.c, the functions that divide by a length. Columns are below 64, and a reflection does not lengthen
 * them: no entry is beyond 64 sqrt(8) = 181 (proofs.md). */
#define LENGTH_ENTRY     805306368                               /* 192 */
#define LENGTH_PRODUCT() (stub_product(59u) + stub_product(56u)) /* 192^2 is 9 * 2^12 */
#include "length_stub.h"

#include "soft.c"

void proof_soft_make(void) {
    soft_t soft;
    num_t x[ROBOT_MAX_JOINTS], s;
    uint32_t at;
    ASSUME((at < SUBSPACE_MAX_COLUMNS) && (s >= NUM(SOFT_MIN)) && (s <= NUM(1)));
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        ASSUME((x[i] >= -LENGTH_ENTRY) && (x[i] <= LENGTH_ENTRY));
    }
    largest = 0;
    (void)make(&soft, x, s, at);
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        HOLDS(stub_below(x[i], 23u), "an entry of a reflector is below 2");
    }
    REACHED;
}
