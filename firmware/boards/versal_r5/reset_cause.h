/* reset_cause: cause of the RPU's start, from the platform's reset reasons (CRP.RESET_REASON of the AM012 register
 * reference) and from whether its memory survived the reset. */
#ifndef TAUPERP_VERSAL_R5_RESET_CAUSE_H
#define TAUPERP_VERSAL_R5_RESET_CAUSE_H

#include "guard.h"

enum {
    RESET_EXTERNAL_POR = 1u << 0,
    RESET_SW_POR = 1u << 1,
    RESET_SLR_POR = 1u << 2,
    RESET_ERR_POR = 1u << 3,
    RESET_DAP_SRST = 1u << 7,
    RESET_ERR_SRST = 1u << 8,
    RESET_SW_SRST = 1u << 9,
    RESET_SLR_SRST = 1u << 10
};

/* `recorded`: the count of restarts is still in memory (restarts.h). A power-on clears it, so a record means that only
 * the RPU was restarted: by its watchdog, or by an error on which the platform manager acted. Neither changes `reason`.
 * Without a record `reason` counts: a reset by an error counts as the watchdog's; no reason at all (the platform
 * manager has cleared it) counts as power-on.
 */
guard_start_t reset_cause(uint32_t reason, bool recorded, bool exception_recorded);

#endif
