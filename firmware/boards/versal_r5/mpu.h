/* mpu: code cannot be written, data cannot be executed, the words below the stack cannot be touched, and everything
 * but the peripherals' 16 MB and the reset reasons (read only) is not there at all. Called once, by the start-up. */
#ifndef TAUPERP_VERSAL_R5_MPU_H
#define TAUPERP_VERSAL_R5_MPU_H

void mpu_init(void);

#endif
