#include "reset_cause.h"

guard_start_t reset_cause(uint32_t reason, bool recorded, bool exception_recorded) {
    const uint32_t error = (uint32_t)RESET_ERR_POR | (uint32_t)RESET_ERR_SRST;
    const uint32_t commanded = (uint32_t)RESET_SW_POR | (uint32_t)RESET_SLR_POR | (uint32_t)RESET_DAP_SRST |
                               (uint32_t)RESET_SW_SRST | (uint32_t)RESET_SLR_SRST;
    if (exception_recorded) {
        return GUARD_START_EXCEPTION;
    }
    if (recorded || ((reason & error) != 0u)) {
        return GUARD_START_WATCHDOG;
    }
    return ((reason & commanded) != 0u) ? GUARD_START_COMMANDED : GUARD_START_POWER_ON;
}
