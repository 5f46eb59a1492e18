/* UART, clock, permission pin and watchdog of the Versal board.
 *
 * QEMU's model of the Versal has neither its GPIO nor its window watchdog, and an access to a missing device faults.
 * So the pin and the watchdog are words in memory here, at the one place where a port to silicon writes registers;
 * the pin's state is also in the log. README.md says so.
 */
#include "board.h"

#include "exceptions.h"
#include "log.h"
#include "pmu.h"
#include "registers.h"

enum { UART_DIVISOR = 54, UART_FRACTION = 16 }; /* 115200 baud from 100 MHz: 54.25 */

volatile uint32_t permission_pin;     /* level */
volatile uint32_t permission_edges;   /* since start-up */
volatile uint32_t watchdog_served;    /* times */
volatile uint32_t watchdog_period_us; /* 0: not started */

static bool permitted;
static uint32_t last_cycles;
static uint64_t cycles;

void board_init(void) {
    permission_withdraw();
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

static void log_permission(bool now) {
    if (now != permitted) {
        permitted = now;
        log_text(now ? "permission\n" : "no permission\n");
    }
}

void permission_toggle(void) {
    permission_pin ^= 1u;
    permission_edges += 1u;
    log_permission(true);
}

void permission_withdraw(void) {
    permission_pin = 0;
    log_permission(false);
}

void watchdog_start(uint32_t timeout_us) {
    watchdog_period_us = timeout_us;
}

void watchdog_serve(void) {
    watchdog_served += 1u;
}

bool uart_write(char character) {
    if ((UART_FR & UART_FR_TXFF) != 0u) {
        return false;
    }
    UART_DR = (uint8_t)character;
    return true;
}
