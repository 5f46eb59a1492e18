/* outputs: the permission pin and the watchdog of board.h on the Versal. */
#ifndef TAUPERP_VERSAL_R5_OUTPUTS_H
#define TAUPERP_VERSAL_R5_OUTPUTS_H

void outputs_init(void); /* drives the pin low */

#endif
