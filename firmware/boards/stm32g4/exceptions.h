/* exceptions: whatever the processor did not expect ends in a stop: the permission pin goes low, a record is kept over
 * the reset that the watchdog then makes, nothing more is sent. */
#ifndef TAUPERP_STM32G4_EXCEPTIONS_H
#define TAUPERP_STM32G4_EXCEPTIONS_H

#include <stdbool.h>

/* Tells the log about a fault recorded before this start, once. True if there was one. */
bool fault_log_recorded(void);

_Noreturn void fault_stop(void);

#endif
