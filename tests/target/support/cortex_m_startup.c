/* Start-up of the mps2 images in QEMU, where tests and instruction counts run. Any exception ends the run as failed. */
#include <stdint.h>

#include "semihosting.h"

#define CPACR                 (*(volatile uint32_t *)0xE000ED88u) /* Armv7-M ARM B3.2.20 */
#define CPACR_FPU_FULL_ACCESS (0xFu << 20)
#define EXIT_EXCEPTION        99

extern uint32_t linker_data_start[], linker_data_end[], linker_data_load[];
extern uint32_t linker_bss_start[], linker_bss_end[], linker_stack_top[];

int main(void);
_Noreturn void reset_handler(void);

static void exception_handler(void) {
    semihosting_write("exception\n");
    semihosting_exit(EXIT_EXCEPTION);
}

_Noreturn void reset_handler(void) {
#ifdef __ARM_FP
    CPACR |= CPACR_FPU_FULL_ACCESS;
    __asm volatile("dsb\n isb" ::: "memory");
#endif
    const uint32_t *from = linker_data_load;
    for (uint32_t *to = linker_data_start; to < linker_data_end; ++to, ++from) {
        *to = *from;
    }
    for (uint32_t *to = linker_bss_start; to < linker_bss_end; ++to) {
        *to = 0;
    }
    semihosting_exit(main());
}

typedef union {
    uint32_t *stack;
    void (*handler)(void);
} vector_t;

__attribute__((section(".vectors"), used)) static const vector_t vectors[16] = {
    {.stack = linker_stack_top},    {.handler = reset_handler},     {.handler = exception_handler},
    {.handler = exception_handler}, {.handler = exception_handler}, {.handler = exception_handler},
    {.handler = exception_handler}, {.handler = exception_handler}, {.handler = exception_handler},
    {.handler = exception_handler}, {.handler = exception_handler}, {.handler = exception_handler},
    {.handler = exception_handler}, {.handler = exception_handler}, {.handler = exception_handler},
    {.handler = exception_handler}};
