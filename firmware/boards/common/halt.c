#include "board.h"

_Noreturn void board_halt(void) {
    for (;;) {
        __asm volatile(""); /* until the watchdog resets, because it is no longer served */
    }
}

_Noreturn void main_returned(int code) {
    (void)code;
    board_halt();
}
