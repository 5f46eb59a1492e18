/* pmu: the cycle counter of the Cortex-R5F (PMCCNTR), which counts at the processor's clock. Under QEMU with -icount
 * shift=0, one instruction is one cycle. */
#ifndef TAUPERP_VERSAL_R5_PMU_H
#define TAUPERP_VERSAL_R5_PMU_H

#include <stdint.h>

#ifdef TAUPERP_EMULATOR
#define PMU_CYCLES_PER_US 1000u /* QEMU's R5F runs at 1 GHz */
#else
#define PMU_CYCLES_PER_US 600u /* the RPU clock, in MHz, that the boot image sets; board_init checks it */
#endif

void pmu_init(void);
uint32_t pmu_cycles(void);

#endif
