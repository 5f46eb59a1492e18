/* restarts: unexpected restarts since the last power-on or commanded start, counted in RAM that a reset keeps. */
#ifndef TAUPERP_RESTARTS_H
#define TAUPERP_RESTARTS_H

#include "guard.h"

/* Once per start: counts this one if `cause` is unexpected, and returns the count. If an
 * unexpected start finds no intact record, the count is lost. It is then set to GUARD_MAX_RESTARTS, so that the next
 * unexpected restart is one too many. */
uint32_t restarts_note(guard_start_t cause);

/* An intact record exists: this is not the first start since power-on. */
bool restarts_recorded(void);

#endif
