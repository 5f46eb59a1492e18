/* guard_parts: how guard.c is divided. For the files of this folder only. */
#ifndef TAUPERP_GUARD_PARTS_H
#define TAUPERP_GUARD_PARTS_H

#include "guard.h"

static inline void count(uint16_t *counter, uint32_t more) {
    const uint32_t room = (uint32_t)UINT16_MAX - *counter;
    *counter = (uint16_t)(*counter + ((more < room) ? more : room));
}

/* guard_report.c: fills the frames of `out` from its verdict and the state. */
void report_init(guard_report_t *self);
void report_tick(guard_t *guard, guard_output_t *out);

/* guard_self_test.c: known answers of the CRC, the E2E check and the projection, which is worked out in `scratch` and
 * leaves it as after subspace_init. Cost: about 5,000 instructions. */
bool self_test(subspace_t *scratch);

#endif
