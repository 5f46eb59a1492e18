/* exceptions: every exception stops the board permanently. The permission pin goes low, nothing more is sent, the
 * watchdog is no longer served, and a record survives the reset. */
#ifndef TAUPERP_VERSAL_R5_EXCEPTIONS_H
#define TAUPERP_VERSAL_R5_EXCEPTIONS_H

#include <stdbool.h>
#include <stdint.h>

typedef enum {
    FAULT_NONE = 0,
    FAULT_UNDEFINED_INSTRUCTION = 1,
    FAULT_SUPERVISOR_CALL = 2,
    FAULT_PREFETCH_ABORT = 3,
    FAULT_DATA_ABORT = 4,
    FAULT_INTERRUPT = 5, /* none is enabled */
    FAULT_FAST_INTERRUPT = 6,
    FAULT_COUNT = 7
} fault_kind_t;

/* The vectors call it, on a separate stack. `return_address`: the banked link register. */
_Noreturn void fault_stop(fault_kind_t kind, uint32_t return_address, uint32_t saved_status);

/* Logs, once, a fault that was recorded before this start. True if there was one. */
bool fault_log_recorded(void);

#endif
