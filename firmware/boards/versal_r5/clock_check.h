/* clock_check: compares the core's clock with the one that the image was built for. */
#ifndef TAUPERP_VERSAL_R5_CLOCK_CHECK_H
#define TAUPERP_VERSAL_R5_CLOCK_CHECK_H

#include <stdbool.h>
#include <stdint.h>

/* True if `cycles` of the core passed in `counts` of a reference of `hz`, within 5 % of PMU_CYCLES_PER_US. False also
 * if the reference does not run or states no frequency. */
bool clock_agrees(uint32_t cycles, uint32_t counts, uint32_t hz);

#endif
