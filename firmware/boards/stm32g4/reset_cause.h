/* reset_cause: cause of the STM32G4's start, from its reset flags (RM0440 rev 8, 7.4.30 RCC_CSR). */
#ifndef TAUPERP_STM32G4_RESET_CAUSE_H
#define TAUPERP_STM32G4_RESET_CAUSE_H

#include "guard.h"

/* Every reset drives NRST, so PINRSTF alone means the button or a debugger's pin. SFTRSTF also comes from a debugger or
 * programmer: this firmware never writes AIRCR. A record of an exception takes precedence over the watchdog's flag,
 * because an exception always ends in a watchdog reset. No flag at all is unknown, and counts as unexpected.
 */
guard_start_t reset_cause(uint32_t rcc_csr, bool exception_recorded);

#endif
