/* Board functions for the Versal's fault handler, in images that end by themselves: a fault ends them too. */
#include "board.h"
#include "semihosting.h"

#define EXIT_FAULT 99

void permission_withdraw(void) {}

bool uart_write(char character) {
    const char text[2] = {character, '\0'};
    semihosting_write(text);
    return true;
}

_Noreturn void board_halt(void) {
    semihosting_exit(EXIT_FAULT);
}

_Noreturn void main_returned(int code) {
    semihosting_exit(code);
}
