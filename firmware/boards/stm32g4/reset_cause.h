/* reset_cause: why the STM32G4 starts, by its reset flags (RM0440 rev 8, 7.4.30 RCC_CSR). */
#ifndef TAUPERP_STM32G4_RESET_CAUSE_H
#define TAUPERP_STM32G4_RESET_CAUSE_H

#include "guard.h"

/* Every reset drives NRST, so PINRSTF alone is the button or a debugger's pin. SFTRSTF is a debugger's or programmer's
 * as well: nothing in this firmware writes AIRCR. A record of an exception is stronger than the watchdog's flag, since
 * the watchdog ends what an exception stopped. No flag at all is unknown, and counts as unexpected. */
guard_start_t reset_cause(uint32_t rcc_csr, bool exception_recorded);

#endif
