/* restarts: unexpected restarts since the last power-on or commanded start, counted in RAM that outlives a reset. */
#ifndef TAUPERP_RESTARTS_H
#define TAUPERP_RESTARTS_H

#include "guard.h"

/* Once per start: counts this one if `cause` is unexpected, and returns the count. Where an
 * unexpected start finds no intact record, memory was lost or overwritten and the count with it: it is then
 * GUARD_MAX_RESTARTS, and the next one is too many. */
uint32_t restarts_note(guard_start_t cause);

/* A record is there and intact: this is not the first start since power came on. */
bool restarts_recorded(void);

#endif
