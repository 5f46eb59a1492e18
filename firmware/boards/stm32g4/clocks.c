#include "clocks.h"

#include "registers.h"

/* HSE 24 MHz / 6 * 85 = 340 MHz; / 2 = 170 MHz for the core, / 4 = 85 MHz for FDCAN (RM0440 rev 8: 7.2.4, 6.1.5). */
#define PLL                                                                                                            \
    (RCC_PLLCFGR_SOURCE_HSE | ((6u - 1u) << RCC_PLLCFGR_M_SHIFT) | (85u << RCC_PLLCFGR_N_SHIFT) | RCC_PLLCFGR_QEN |    \
     RCC_PLLCFGR_Q_4 | RCC_PLLCFGR_REN)

static bool comes(uint32_t address, uint32_t mask, uint32_t value) {
    for (uint32_t tries = 0; tries < CLOCKS_TRIES; ++tries) {
        if ((REGISTER(address) & mask) == value) {
            return true;
        }
    }
    return false;
}

bool clocks_start(void) {
    RCC_APB1ENR1 |= RCC_APB1ENR1_PWR;
    RCC_CR |= RCC_CR_HSEON;
    if (!comes(RCC_CR_ADDRESS, RCC_CR_HSERDY, RCC_CR_HSERDY)) {
        return false;
    }
    PWR_CR5 &= ~(uint32_t)PWR_CR5_R1MODE;
    FLASH_ACR = (FLASH_ACR & ~(uint32_t)FLASH_ACR_LATENCY) | FLASH_ACR_4_WAIT_STATES;
    if (!comes(FLASH_ACR_ADDRESS, FLASH_ACR_LATENCY, FLASH_ACR_4_WAIT_STATES)) {
        return false;
    }
    RCC_PLLCFGR = PLL;
    RCC_CR |= RCC_CR_PLLON;
    if (!comes(RCC_CR_ADDRESS, RCC_CR_PLLRDY, RCC_CR_PLLRDY)) {
        return false;
    }
    /* From below 80 MHz to above 150 MHz: half the frequency for a microsecond (6.1.5). */
    RCC_CFGR |= RCC_CFGR_HPRE_2;
    RCC_CFGR |= RCC_CFGR_SW_PLL;
    if (!comes(RCC_CFGR_ADDRESS, RCC_CFGR_SWS, RCC_CFGR_SWS_PLL)) {
        RCC_CFGR &= ~((uint32_t)RCC_CFGR_SW_PLL | (uint32_t)RCC_CFGR_HPRE_2);
        return false;
    }
    for (volatile uint32_t wait = 0; wait < CLOCKS_CORE_MHZ; ++wait) {}
    RCC_CFGR &= ~(uint32_t)RCC_CFGR_HPRE_2;
    RCC_CCIPR |= RCC_CCIPR_FDCAN_PLLQ;
    RCC_CR |= RCC_CR_CSSON;
    const bool divided = (RCC_CFGR & (uint32_t)RCC_CFGR_HPRE) != 0u;
    return (RCC_PLLCFGR == PLL) && !divided && ((RCC_CR & RCC_CR_CSSON) != 0u);
}
