/* semihosting: text and an exit code for an image that runs under a debugger or QEMU, on Cortex-M and Cortex-R.
 *
 * The interface is Arm's "Semihosting for AArch32 and AArch64" (release 2.0). Without a debugger attached a call is a
 * fault on Cortex-M and an SVC exception on Cortex-R: nothing that ships may link this.
 */
#ifndef TAUPERP_SEMIHOSTING_H
#define TAUPERP_SEMIHOSTING_H

#include <stdint.h>

void semihosting_write(const char *text); /* NUL-terminated, to the debugger's console */
_Noreturn void semihosting_exit(int32_t code);

#endif
