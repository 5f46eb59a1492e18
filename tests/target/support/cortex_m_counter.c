#include "counter.h"

/* CMSDK APB timer 0 (Arm DDI 0479): a 25 MHz down-counter on every mps2 FPGA image. */
#define TIMER_CTRL   (*(volatile uint32_t *)0x40000000u)
#define TIMER_VALUE  (*(volatile uint32_t *)0x40000004u)
#define TIMER_RELOAD (*(volatile uint32_t *)0x40000008u)

void counter_init(void) {
    TIMER_RELOAD = UINT32_MAX;
    TIMER_VALUE = UINT32_MAX;
    TIMER_CTRL = 1u;
}

uint32_t counter_read(void) {
    return TIMER_VALUE;
}

/* 40 ns per count, and 2^6 ns per instruction with -icount shift=6. */
uint32_t counter_instructions(uint32_t from, uint32_t to) {
    return (uint32_t)(((uint64_t)(from - to) * 40u + 32u) / 64u);
}
