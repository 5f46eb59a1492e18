#include "reset_cause.h"

#include "registers.h"

guard_start_t reset_cause(uint32_t rcc_csr, bool exception_recorded) {
    if ((rcc_csr & (uint32_t)RCC_CSR_BORRSTF) != 0u) { /* power-on or brown-out: the content of RAM is meaningless */
        return GUARD_START_POWER_ON;
    }
    if (exception_recorded) {
        return GUARD_START_EXCEPTION;
    }
    if ((rcc_csr & ((uint32_t)RCC_CSR_IWDGRSTF | (uint32_t)RCC_CSR_WWDGRSTF)) != 0u) {
        return GUARD_START_WATCHDOG;
    }
    if ((rcc_csr & RCC_CSR_LPWRRSTF) != 0u) { /* the firmware enters no low-power mode */
        return GUARD_START_UNKNOWN;
    }
    const uint32_t commanded = (uint32_t)RCC_CSR_OBLRSTF | (uint32_t)RCC_CSR_SFTRSTF | (uint32_t)RCC_CSR_PINRSTF;
    return ((rcc_csr & commanded) != 0u) ? GUARD_START_COMMANDED : GUARD_START_UNKNOWN;
}
