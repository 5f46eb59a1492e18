#include "mpu.h"

#include <stdint.h>

/* PMSAv7 (Armv7-R ARM B5): the size of a region is a power of two, and the region is aligned to it. Of overlapping
 * regions the highest number applies. An access outside all regions faults, because the background region stays off. */
enum {
    READ_WRITE = 1u << 8, /* DRACR.AP 001, privileged only */
    READ_ONLY = 5u << 8,  /* 101 */
    NO_ACCESS = 0u,
    EXECUTE_NEVER = 1u << 12, /* DRACR.XN */
    NORMAL = 1u << 3,         /* TEX 001, C 0, B 0: normal memory, not cached (it is tightly coupled) */
    DEVICE = 1u << 0,         /* TEX 000, C 0, B 1: shared device */
    REGION_ENABLE = 1u,
    SCTLR_MPU = 1u << 0
};

#define PERIPHERALS      0xFF000000u
#define PERIPHERALS_SIZE 24u /* log2 of bytes: 16 MB */

#define RESET_REASONS      0xF1260000u /* CRP */
#define RESET_REASONS_SIZE 16u

extern uint8_t linker_code_start[], linker_code_log2[], linker_data_region_start[], linker_data_region_log2[];
extern uint8_t linker_stack_guard[], linker_stack_guard_log2[];

static void set_region(uint32_t number, uint32_t base, uint32_t log2_size, uint32_t access) {
    const uint32_t size = ((log2_size - 1u) << 1) | REGION_ENABLE;
    __asm volatile("mcr p15, 0, %0, c6, c2, 0" ::"r"(number)); /* RGNR */
    __asm volatile("mcr p15, 0, %0, c6, c1, 0" ::"r"(base));   /* DRBAR */
    __asm volatile("mcr p15, 0, %0, c6, c1, 4" ::"r"(access)); /* DRACR */
    __asm volatile("mcr p15, 0, %0, c6, c1, 2" ::"r"(size));   /* DRSR */
}

void mpu_init(void) {
    set_region(0, (uint32_t)linker_code_start, (uint32_t)linker_code_log2, READ_ONLY | NORMAL);
    set_region(1, (uint32_t)linker_data_region_start, (uint32_t)linker_data_region_log2,
               READ_WRITE | NORMAL | EXECUTE_NEVER);
    set_region(2, (uint32_t)linker_stack_guard, (uint32_t)linker_stack_guard_log2, NO_ACCESS | NORMAL | EXECUTE_NEVER);
    set_region(3, PERIPHERALS, PERIPHERALS_SIZE, READ_WRITE | DEVICE | EXECUTE_NEVER);
    set_region(4, RESET_REASONS, RESET_REASONS_SIZE, READ_ONLY | DEVICE | EXECUTE_NEVER);
    uint32_t sctlr;
    __asm volatile("mrc p15, 0, %0, c1, c0, 0" : "=r"(sctlr));
    sctlr |= SCTLR_MPU;
    __asm volatile("dsb\n mcr p15, 0, %0, c1, c0, 0\n isb" ::"r"(sctlr) : "memory");
}
