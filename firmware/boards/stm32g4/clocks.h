/* clocks: runs the STM32G4 from its crystal, 170 MHz for the core and 85 MHz for FDCAN, and reacts to a failing
 * crystal. */
#ifndef TAUPERP_STM32G4_CLOCKS_H
#define TAUPERP_STM32G4_CLOCKS_H

#include <stdbool.h>

#define CLOCKS_CORE_MHZ 170u

/* Maximum polls of one flag: about 50 ms at 16 MHz. The crystal starts within 2 ms (data sheet). */
#define CLOCKS_TRIES 100000u

/* True: the core runs from the crystal through the PLL, and the clock security system monitors the crystal. A crystal
 * that stops later raises an NMI, which is fault_stop (exceptions.h). False if an oscillator, the flash or the switch
 * does not answer, or a setting does not read back. The core then still runs from the 16 MHz after reset.
 */
bool clocks_start(void);

#endif
