/* exceptions: every exception stops the board. The permission pin goes low, nothing more is sent, and a record survives
 * the reset by the watchdog. */
#ifndef TAUPERP_STM32G4_EXCEPTIONS_H
#define TAUPERP_STM32G4_EXCEPTIONS_H

#include <stdbool.h>

/* Logs, once, a fault that was recorded before this start. True if there was one. */
bool fault_log_recorded(void);

_Noreturn void fault_stop(void);

#endif
