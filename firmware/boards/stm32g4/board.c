/* Clocks, pins, time, watchdog and UART of the NUCLEO-G474RE.
 *
 *   PA8   (D7)  permission, to the safety relay      PA11, PA12  FDCAN1 RX, TX, to a transceiver for 5 Mbit/s
 *   PA2         USART2 TX, the ST-LINK's virtual COM port, 115200 baud
 */
#include "board.h"

#include "exceptions.h"
#include "log.h"
#include "registers.h"

enum { PIN_PERMISSION = 8, PIN_UART = 2, PIN_CAN_RX = 11, PIN_CAN_TX = 12 };
enum { CORE_MHZ = 170, UART_DIVISOR = 1476 }; /* 170 MHz / 115200 */
enum { WATCHDOG_TICK_US = 128 };              /* LSI / 4 at the slowest that the data sheet allows, about 31 kHz */

static bool permitted;
static uint32_t last_us;
static uint64_t time_us;

/* HSE 24 MHz / 6 * 85 = 340 MHz; / 2 = 170 MHz for the core, / 4 = 85 MHz for FDCAN (7.2.4, 6.1.5, 5.3.3). */
static void start_clocks(void) {
    RCC_APB1ENR1 |= RCC_APB1ENR1_PWR;
    RCC_CR |= RCC_CR_HSEON;
    while ((RCC_CR & RCC_CR_HSERDY) == 0u) {}
    PWR_CR5 &= ~(uint32_t)PWR_CR5_R1MODE;
    FLASH_ACR = (FLASH_ACR & ~(uint32_t)FLASH_ACR_LATENCY) | FLASH_ACR_4_WAIT_STATES;
    while ((FLASH_ACR & FLASH_ACR_LATENCY) != FLASH_ACR_4_WAIT_STATES) {}
    RCC_PLLCFGR = RCC_PLLCFGR_SOURCE_HSE | ((6u - 1u) << RCC_PLLCFGR_M_SHIFT) | (85u << RCC_PLLCFGR_N_SHIFT) |
                  RCC_PLLCFGR_QEN | RCC_PLLCFGR_Q_4 | RCC_PLLCFGR_REN;
    RCC_CR |= RCC_CR_PLLON;
    while ((RCC_CR & RCC_CR_PLLRDY) == 0u) {}
    /* From below 80 MHz to above 150 MHz: half the frequency for a microsecond (6.1.5). */
    RCC_CFGR |= RCC_CFGR_HPRE_2;
    RCC_CFGR |= RCC_CFGR_SW_PLL;
    while ((RCC_CFGR & RCC_CFGR_SWS) != RCC_CFGR_SWS_PLL) {}
    for (volatile uint32_t wait = 0; wait < CORE_MHZ; ++wait) {}
    RCC_CFGR &= ~(uint32_t)RCC_CFGR_HPRE_2;
    RCC_CCIPR |= RCC_CCIPR_FDCAN_PLLQ;
}

static void set_mode(uint32_t pin, uint32_t mode) {
    GPIOA_MODER = (GPIOA_MODER & ~((uint32_t)MODE_MASK << (2u * pin))) | (mode << (2u * pin));
}

void board_init(void) {
    /* Before the clocks: the pin is to be low as soon as it is anything. */
    RCC_AHB2ENR |= RCC_AHB2ENR_GPIOA;
    permission_withdraw();
    set_mode(PIN_PERMISSION, MODE_OUTPUT);
    start_clocks();
    RCC_APB1ENR1 |= RCC_APB1ENR1_TIM2 | RCC_APB1ENR1_USART2 | RCC_APB1ENR1_FDCAN;
    GPIOA_AFRL |= (uint32_t)ALTERNATE_USART << (4u * PIN_UART);
    GPIOA_AFRH |= ((uint32_t)ALTERNATE_FDCAN << (4u * (PIN_CAN_RX - 8u))) |
                  ((uint32_t)ALTERNATE_FDCAN << (4u * (PIN_CAN_TX - 8u)));
    set_mode(PIN_UART, MODE_ALTERNATE);
    set_mode(PIN_CAN_RX, MODE_ALTERNATE);
    set_mode(PIN_CAN_TX, MODE_ALTERNATE);
    TIM2_PSC = CORE_MHZ - 1u;
    TIM2_ARR = UINT32_MAX;
    TIM2_EGR = TIM_EGR_UG;
    TIM2_CR1 = TIM_CR1_CEN;
    USART2_BRR = UART_DIVISOR;
    USART2_CR1 = USART_CR1_UE | USART_CR1_TE | USART_CR1_FIFOEN;
    fault_log_recorded();
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
    while (IWDG_SR != 0u) {}
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
