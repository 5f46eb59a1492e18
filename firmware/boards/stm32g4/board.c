/* Clocks, pins, time, watchdog and UART of the NUCLEO-G474RE.
 *
 *   PA8   (D7)  permission, to the safety relay      PA11, PA12  FDCAN1 RX, TX, to a transceiver for 5 Mbit/s
 *   PA2         USART2 TX, the ST-LINK's virtual COM port, 115200 baud
 */
#include "board.h"

#include "clocks.h"
#include "exceptions.h"
#include "log.h"
#include "registers.h"
#include "reset_cause.h"

enum { PIN_PERMISSION = 8, PIN_UART = 2, PIN_CAN_RX = 11, PIN_CAN_TX = 12 };
enum { UART_DIVISOR = 1476, UART_DIVISOR_HSI = 139 }; /* 115200 baud from 170 MHz, and from the 16 MHz after a reset */
enum { HALT_TIMEOUT_US = 500000, WATCHDOG_TRIES = 100000 };
enum { WATCHDOG_TICK_US = 128 }; /* LSI / 4 at its slowest (data sheet), about 31 kHz */

static bool permitted;
static guard_start_t cause;
static uint32_t last_us;
static uint64_t time_us;

static void set_mode(uint32_t pin, uint32_t mode) {
    GPIOA_MODER = (GPIOA_MODER & ~((uint32_t)MODE_MASK << (2u * pin))) | (mode << (2u * pin));
}

void board_init(void) {
    /* Before the clocks, because the pin must be low from the start. */
    RCC_AHB2ENR |= RCC_AHB2ENR_GPIOA;
    permission_withdraw();
    set_mode(PIN_PERMISSION, MODE_OUTPUT);
    const bool clocked = clocks_start();
    RCC_APB1ENR1 |= RCC_APB1ENR1_TIM2 | RCC_APB1ENR1_USART2 | RCC_APB1ENR1_FDCAN;
    GPIOA_AFRL |= (uint32_t)ALTERNATE_USART << (4u * PIN_UART);
    GPIOA_AFRH |= ((uint32_t)ALTERNATE_FDCAN << (4u * (PIN_CAN_RX - 8u))) |
                  ((uint32_t)ALTERNATE_FDCAN << (4u * (PIN_CAN_TX - 8u)));
    set_mode(PIN_UART, MODE_ALTERNATE);
    set_mode(PIN_CAN_RX, MODE_ALTERNATE);
    set_mode(PIN_CAN_TX, MODE_ALTERNATE);
    TIM2_PSC = CLOCKS_CORE_MHZ - 1u;
    TIM2_ARR = UINT32_MAX;
    TIM2_EGR = TIM_EGR_UG;
    TIM2_CR1 = TIM_CR1_CEN;
    USART2_BRR = clocked ? UART_DIVISOR : UART_DIVISOR_HSI;
    USART2_CR1 = USART_CR1_UE | USART_CR1_TE | USART_CR1_FIFOEN;
    cause = reset_cause(RCC_CSR, fault_log_recorded());
    RCC_CSR |= RCC_CSR_RMVF; /* otherwise the next start reads these flags again */
    if (!clocked) {
        log_text("the clock does not start: no guard\n");
        watchdog_start(HALT_TIMEOUT_US); /* its own oscillator runs it; it causes another start */
        log_flush();
        board_halt();
    }
}

guard_start_t board_start_cause(void) {
    return cause;
}

uint64_t clock_us(void) {
    const uint32_t now = TIM2_CNT;
    time_us += (uint32_t)(now - last_us);
    last_us = now;
    return time_us;
}

static void log_permission(bool now) {
    if (now != permitted) {
        permitted = now;
        log_text(now ? "permission\n" : "no permission\n");
    }
}

void permission_toggle(void) {
    GPIOA_BSRR = ((GPIOA_ODR & (1u << PIN_PERMISSION)) != 0u) ? (1u << (PIN_PERMISSION + 16u)) : (1u << PIN_PERMISSION);
    log_permission(true);
}

void permission_withdraw(void) {
    GPIOA_BSRR = 1u << (PIN_PERMISSION + 16u);
    log_permission(false);
}

void watchdog_start(uint32_t timeout_us) {
    const uint32_t ticks = (timeout_us + WATCHDOG_TICK_US - 1u) / WATCHDOG_TICK_US;
    IWDG_KR = IWDG_START;
    IWDG_KR = IWDG_UNLOCK;
    IWDG_PR = 0; /* LSI / 4 */
    IWDG_RLR = (ticks < IWDG_RLR_MAX) ? ticks : (uint32_t)IWDG_RLR_MAX;
    /* If the settings have no effect, the timeout is its maximum of half a second. */
    for (uint32_t tries = 0; (IWDG_SR != 0u) && (tries < (uint32_t)WATCHDOG_TRIES); ++tries) {}
    IWDG_KR = IWDG_RELOAD;
}

void watchdog_serve(void) {
    IWDG_KR = IWDG_RELOAD;
}

bool uart_write(char character) {
    if ((USART2_ISR & USART_ISR_TXFNF) == 0u) {
        return false;
    }
    USART2_TDR = (uint8_t)character;
    return true;
}
