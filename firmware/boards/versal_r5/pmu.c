#include "pmu.h"

enum { PMCR_ENABLE = 1u << 0, PMCR_RESET_CYCLES = 1u << 2, PMCNTENSET_CYCLES = 1u << 31 };

void pmu_init(void) {
    __asm volatile("mcr p15, 0, %0, c9, c12, 0" ::"r"(PMCR_ENABLE | PMCR_RESET_CYCLES));
    __asm volatile("mcr p15, 0, %0, c9, c12, 1" ::"r"(PMCNTENSET_CYCLES));
}

uint32_t pmu_cycles(void) {
    uint32_t cycles;
    __asm volatile("isb\n mrc p15, 0, %0, c9, c13, 0" : "=r"(cycles)::"memory");
    return cycles;
}
