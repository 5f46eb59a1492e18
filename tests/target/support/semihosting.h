/* semihosting: text and an exit code for an image that runs under a debugger or QEMU, on Cortex-M and Cortex-R.
 *
 * The interface is Arm's "Semihosting for AArch32 and AArch64" (release 2.0). Without a debugger a call is a fault on
 * Cortex-M and an SVC exception on Cortex-R: no shipped image may link this.
 */
#ifndef TAUPERP_SEMIHOSTING_H
#define TAUPERP_SEMIHOSTING_H

#include <stdbool.h>
#include <stdint.h>

void semihosting_write(const char *text); /* NUL-terminated, to the debugger's console */
_Noreturn void semihosting_exit(int32_t code);

/* The program's command line from the debugger, NUL-terminated. False if it does not fit. */
bool semihosting_command_line(char text[], uint32_t size);

int32_t semihosting_open(const char *path);                         /* for reading; -1 on failure */
uint32_t semihosting_read(int32_t file, void *to, uint32_t length); /* bytes read: fewer at the end of the file */

#endif
