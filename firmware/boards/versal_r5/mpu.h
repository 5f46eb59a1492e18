/* mpu: code is read-only, data is not executable, and the words below the stack are not accessible. Besides memory,
 * only 16 MB of peripherals and the reset reasons (read-only) are mapped. The start-up code calls it once. */
#ifndef TAUPERP_VERSAL_R5_MPU_H
#define TAUPERP_VERSAL_R5_MPU_H

void mpu_init(void);

#endif
