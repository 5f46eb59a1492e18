/* provoke: an image of the Versal board that permits motion, then causes the fault PROVOKE. A stop must follow. */
#include "board.h"
#include "log.h"

#include <stdint.h>

int main(void);

static volatile uint32_t sink;
static uint32_t code_in_data[2] = {0xE12FFF1Eu, 0xE12FFF1Eu}; /* bx lr */

static void write_code(void) {
    *(volatile uint32_t *)0x40u = 0;
}

static void execute_data(void) {
    ((void (*)(void))(uintptr_t)code_in_data)();
}

static void undefined_instruction(void) {
    __asm volatile("udf #0");
}

static void supervisor_call(void) {
    __asm volatile("svc #0");
}

static void no_memory(void) {
    sink = *(volatile uint32_t *)0x40000000u;
}

static uint32_t overflow_stack(uint32_t depth) {
    volatile uint32_t frame[64];
    frame[depth % 64u] = depth;
    return (depth == 0u) ? 0u : (overflow_stack(depth - 1u) + frame[depth % 64u]);
}

static void stack_overflow(void) {
    sink = overflow_stack(100000u);
}

static void restarted_by_exception(void) {
    log_text("start ");
    log_number((uint32_t)board_start_cause());
    log_text("\n");
    log_flush();
    undefined_instruction();
}

int main(void) {
    board_init();
    permission_toggle();
    log_text("provoked\n");
    log_flush();
    PROVOKE();
    log_text("and continued\n");
    log_flush();
    board_halt();
}
