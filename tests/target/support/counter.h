/* counter: instructions executed, on a target emulated by QEMU with -icount. Counts wrap; take differences.
 *
 * Under -icount QEMU's clock advances by a fixed time per instruction, so a hardware counter is an exact instruction
 * counter: the CMSDK timer of the mps2 boards (-icount shift=6), PMCCNTR of the Cortex-R5F (-icount shift=0).
 */
#ifndef TAUPERP_COUNTER_H
#define TAUPERP_COUNTER_H

#include <stdint.h>

void counter_init(void);
uint32_t counter_read(void);

/* Instructions between two readings that are less than 2^31 counts apart, rounded to the nearest. The cost of the two
 * counter_read calls is included. */
uint32_t counter_instructions(uint32_t from, uint32_t to);

#endif
