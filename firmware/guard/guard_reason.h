/* guard_reason: what kind of thing a reason is. No code compares reasons by their number. */
#ifndef TAUPERP_GUARD_REASON_H
#define TAUPERP_GUARD_REASON_H

#include "guard.h"

reason_class_t reason_class(guard_reason_t reason);

/* The one that the next tick is to act on, when both are noted: the worse class, else the one that came first. */
guard_reason_t reason_worse(guard_reason_t first, guard_reason_t second);

#endif
