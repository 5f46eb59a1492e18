/* guard_reason: the class of a reason. No code compares reasons by their number. */
#ifndef TAUPERP_GUARD_REASON_H
#define TAUPERP_GUARD_REASON_H

#include "guard.h"

reason_class_t reason_class(guard_reason_t reason);

/* True if the guard stopped because of a computed value, not because of an input or a fault: the arm touched something.
 */
bool reason_is_contact(guard_reason_t reason);

/* The reason for the next tick if both are recorded: the one with the worse class, else the first. */
guard_reason_t reason_worse(guard_reason_t first, guard_reason_t second);

#endif
