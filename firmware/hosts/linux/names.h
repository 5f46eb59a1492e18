/* names: the DBC's names of states, reasons and tasks, for printing. */
#ifndef TAUPERP_LINUX_NAMES_H
#define TAUPERP_LINUX_NAMES_H

#include <stdint.h>

/* "Unknown" for a number without a name. */
const char *state_name(uint32_t state);
const char *reason_name(uint32_t reason);
const char *task_name(uint32_t task);

#endif
