/* clocks: the STM32G4 on its crystal: 170 MHz for the core, 85 MHz for FDCAN, and the reaction to a failing crystal. */
#ifndef TAUPERP_STM32G4_CLOCKS_H
#define TAUPERP_STM32G4_CLOCKS_H

#include <stdbool.h>

#define CLOCKS_CORE_MHZ 170u

/* Polls of one flag at most: about 50 ms at 16 MHz. The crystal starts within 2 ms (data sheet). */
#define CLOCKS_TRIES 100000u

/* True: the core runs on the crystal through the PLL, and the clock security system watches the crystal. A crystal that
 * stops later raises an NMI, which is fault_stop (exceptions.h). False if an oscillator, the flash or the switch does
 * not answer, or a setting does not read back: the core then still runs on the 16 MHz of the reset. */
bool clocks_start(void);

#endif
