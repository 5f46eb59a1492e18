/* restarts: unexpected restarts since the last power-on or commanded start, counted in RAM that a reset preserves. */
#ifndef TAUPERP_RESTARTS_H
#define TAUPERP_RESTARTS_H

#include "guard.h"

/* Call once per start. Counts this start if `cause` is unexpected, and returns the count. If an unexpected start finds
 * no valid record, the count is lost. It is then set to GUARD_MAX_RESTARTS, so that the next unexpected restart exceeds
 * the limit. */
uint32_t restarts_note(guard_start_t cause);

/* True if a valid record exists: this is not the first start since power-on. */
bool restarts_recorded(void);

#endif
