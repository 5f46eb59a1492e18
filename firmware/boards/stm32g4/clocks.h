/* clocks: the STM32G4 on its crystal: 170 MHz for the core, 85 MHz for FDCAN, and what a failing crystal does. */
#ifndef TAUPERP_STM32G4_CLOCKS_H
#define TAUPERP_STM32G4_CLOCKS_H

#include <stdbool.h>

#define CLOCKS_CORE_MHZ 170u

/* Looks at one flag at most: at 16 MHz some 50 ms. The data sheet's longest start of the crystal is 2 ms. */
#define CLOCKS_TRIES 100000u

/* False if an oscillator, the flash or the switch does not answer, or if what was set is not what is read back: the
 * core is then still on the 16 MHz that it starts from. True: on the crystal through the PLL, and the clock security
 * system watches the crystal. If that stops later, the processor gets an NMI, which is fault_stop (exceptions.h). */
bool clocks_start(void);

#endif
