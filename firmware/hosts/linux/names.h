/* names: the DBC's words for states, reasons and tasks, as the process prints them. */
#ifndef TAUPERP_LINUX_NAMES_H
#define TAUPERP_LINUX_NAMES_H

#include <stdint.h>

/* "Unknown" for a number without a name. */
const char *state_name(uint32_t state);
const char *reason_name(uint32_t reason);
const char *task_name(uint32_t task);

#endif
