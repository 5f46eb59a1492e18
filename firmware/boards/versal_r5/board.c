/* UART and clock of the Versal board. */
#include "board.h"

#include "clock_check.h"
#include "exceptions.h"
#include "log.h"
#include "output_registers.h"
#include "outputs.h"
#include "pmu.h"
#include "registers.h"
#include "reset_cause.h"
#include "restarts.h"

#define CLOCK_CYCLES    (PMU_CYCLES_PER_US * 1000u) /* a millisecond */
#define HALT_TIMEOUT_US 500000u

enum { UART_DIVISOR = 54, UART_FRACTION = 16 }; /* 115200 baud from 100 MHz: 54.25 */

#ifdef TAUPERP_EMULATOR
volatile uint32_t output_words[OUTPUT_WORDS];
#endif

static guard_start_t cause;
static uint32_t last_cycles;
static uint64_t cycles;

#ifdef TAUPERP_EMULATOR
static void check_clock(void) {} /* the model has a single clock */
#else
/* Compares the core's clock with the platform's time stamps, which use the divider of another oscillator. */
static void check_clock(void) {
    const uint32_t hz = output_read(SCNTR_FREQUENCY);
    const uint32_t from_counts = output_read(SCNTR_COUNT);
    const uint32_t from_cycles = pmu_cycles();
    uint32_t passed = 0;
    for (uint32_t tries = 0; (passed < CLOCK_CYCLES) && (tries < CLOCK_CYCLES); ++tries) {
        passed = pmu_cycles() - from_cycles;
    }
    if (!clock_agrees(passed, output_read(SCNTR_COUNT) - from_counts, hz)) {
        log_text("the clock frequency does not match this image: no guard\n");
        watchdog_start(HALT_TIMEOUT_US);
        log_flush();
        board_halt();
    }
}
#endif

void board_init(void) {
    outputs_init();
    pmu_init();
    UART_CR = 0;
    UART_IBRD = UART_DIVISOR;
    UART_FBRD = UART_FRACTION;
    UART_LCR_H = UART_LCR_FEN | UART_LCR_WLEN8;
    UART_CR = UART_CR_UARTEN | UART_CR_TXE;
    cause = reset_cause(output_read(CRP_RESET_REASON), restarts_recorded(), fault_log_recorded());
    check_clock();
}

guard_start_t board_start_cause(void) {
    return cause;
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
