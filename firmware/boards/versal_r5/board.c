/* UART and clock of the Versal board. */
#include "board.h"

#include "exceptions.h"
#include "output_registers.h"
#include "outputs.h"
#include "pmu.h"
#include "registers.h"

enum { UART_DIVISOR = 54, UART_FRACTION = 16 }; /* 115200 baud from 100 MHz: 54.25 */

#ifndef TAUPERP_SILICON
volatile uint32_t output_words[OUTPUT_WORDS];
#endif

static uint32_t last_cycles;
static uint64_t cycles;

void board_init(void) {
    outputs_init();
    pmu_init();
    UART_CR = 0;
    UART_IBRD = UART_DIVISOR;
    UART_FBRD = UART_FRACTION;
    UART_LCR_H = UART_LCR_FEN | UART_LCR_WLEN8;
    UART_CR = UART_CR_UARTEN | UART_CR_TXE;
    fault_log_recorded();
}

uint64_t clock_us(void) {
    const uint32_t now = pmu_cycles();
    cycles += (uint32_t)(now - last_cycles);
    last_cycles = now;
    return cycles / PMU_CYCLES_PER_US;
}

bool uart_write(char character) {
    if ((UART_FR & UART_FR_TXFF) != 0u) {
        return false;
    }
    UART_DR = (uint8_t)character;
    return true;
}
