#include "board.h"

_Noreturn void board_halt(void) {
    for (;;) {
        __asm volatile(""); /* until the watchdog, which is no longer served, resets */
    }
}

_Noreturn void main_returned(int code) {
    (void)code;
    board_halt();
}
