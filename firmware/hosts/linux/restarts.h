/* restarts: counts how often the service manager restarted the process after an unexpected end.
 *
 * The count is in the file `restarts` of the folder that systemd names in RUNTIME_DIRECTORY and keeps across a restart
 * (RuntimeDirectoryPreserve=restart). A process that ends on a signal from a person, or on a stop of the service,
 * removes the file. Without such a folder every start counts as commanded, because a person started it. If the file
 * cannot be opened, the cause of the start is unknown and the count is at the limit. The functions call open, read,
 * write and unlink only, before the loop starts and after it has ended.
 */
#ifndef TAUPERP_LINUX_RESTARTS_H
#define TAUPERP_LINUX_RESTARTS_H

#include <stdint.h>

#include "guard.h"

typedef struct {
    guard_start_t cause;
    uint32_t count; /* unexpected restarts since the last commanded start, including this one; at most 255 */
} restarts_t;

restarts_t restarts_note(void);

/* Call if the process ends on request. */
void restarts_forget(void);

#endif
