/* mpu: code is read-only, data is not executable, the words below the stack are not accessible. Outside memory only
 * 16 MB of peripherals and the reset reasons (read-only) are mapped. Called once, by the start-up code. */
#ifndef TAUPERP_VERSAL_R5_MPU_H
#define TAUPERP_VERSAL_R5_MPU_H

void mpu_init(void);

#endif
