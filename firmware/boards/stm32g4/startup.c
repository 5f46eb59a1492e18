/* Start-up of the STM32G474. No interrupt is used; every exception is a fault. */
#include <stdint.h>

#include "board.h"
#include "exceptions.h"
#include "loop.h"
#include "registers.h"

extern uint32_t linker_data_start[], linker_data_end[], linker_data_load[];
extern uint32_t linker_bss_start[], linker_bss_end[], linker_stack_top[];

/* NOLINTNEXTLINE(misc-use-internal-linkage): stm32g4.ld names it as the entry, and the vector table calls it */
_Noreturn void reset_handler(void);

_Noreturn void reset_handler(void) {
    SCB_CPACR |= CPACR_FPU_FULL_ACCESS;
    __asm volatile("dsb\n isb" ::: "memory");
    const uint32_t *from = linker_data_load;
    for (uint32_t *to = linker_data_start; to < linker_data_end; ++to, ++from) {
        *to = *from;
    }
    for (uint32_t *to = linker_bss_start; to < linker_bss_end; ++to) {
        *to = 0;
    }
    board_init();
    loop_run();
}

typedef union {
    uint32_t *stack;
    void (*handler)(void);
} vector_t;

#define FAULT {.handler = fault_stop}

/* Initial stack, reset, the 14 other system exceptions. Interrupts are never enabled. */
__attribute__((section(".vectors"), used)) static const vector_t vectors[16] = {{.stack = linker_stack_top},
                                                                                {.handler = reset_handler},
                                                                                FAULT,
                                                                                FAULT,
                                                                                FAULT,
                                                                                FAULT,
                                                                                FAULT,
                                                                                FAULT,
                                                                                FAULT,
                                                                                FAULT,
                                                                                FAULT,
                                                                                FAULT,
                                                                                FAULT,
                                                                                FAULT,
                                                                                FAULT,
                                                                                FAULT};
