/* guard_reason: what kind of thing a reason is. No code compares reasons by their number. */
#ifndef TAUPERP_GUARD_REASON_H
#define TAUPERP_GUARD_REASON_H

#include "guard.h"

typedef enum {
    REASON_UNKNOWN = 0, /* a number that is no reason: as bad as FAULT */
    REASON_WAITING = 1, /* no permission yet, nothing latched */
    REASON_STOPPED = 2, /* ends a permission and latches */
    REASON_BOARD = 3,   /* the same, and latches before the first permission as well: bus, board, another guard */
    REASON_FAULT = 4    /* until the next guard_init */
} reason_class_t;

reason_class_t reason_class(guard_reason_t reason);

/* The one that the next tick is to act on, when both are noted: the worse class, else the one that came first. */
guard_reason_t reason_worse(guard_reason_t first, guard_reason_t second);

#endif
