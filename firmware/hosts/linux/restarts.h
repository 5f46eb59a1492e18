/* restarts: counts how often the service manager restarted the process after an unexpected end.
 *
 * The count is in the file `restarts` of the folder that systemd names in RUNTIME_DIRECTORY and keeps over a restart
 * (RuntimeDirectoryPreserve=restart). A process that ends on a signal from a person or on a stop of the service removes
 * it. Without such a folder every start counts as commanded, since a person started it. If the file cannot be opened,
 * the start is unknown and the count is at the limit. Calls open,
 * read, write and unlink only, before the loop begins and after it has ended.
 */
#ifndef TAUPERP_LINUX_RESTARTS_H
#define TAUPERP_LINUX_RESTARTS_H

#include <stdint.h>

#include "guard.h"

typedef struct {
    guard_start_t cause;
    uint32_t count; /* unexpected restarts since the last commanded start, this one included; at most 255 */
} restarts_t;

restarts_t restarts_note(void);

/* The process ends because it was asked to. */
void restarts_forget(void);

#endif
