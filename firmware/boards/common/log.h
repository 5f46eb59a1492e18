/* log: text lines in a buffer that the loop empties when the UART has space. Nothing waits. Text that does not fit is
 * dropped and replaced by "...". */
#ifndef TAUPERP_LOG_H
#define TAUPERP_LOG_H

#include <stdint.h>

#define LOG_TRIES 200000u /* polls of the UART per character: several times the duration of one at 115200 baud */

void log_text(const char *text);
void log_number(uint32_t number);
void log_hex(uint32_t number, uint32_t digits); /* 1 to 8 digits */
void log_pump(void);                            /* sends one character, if there is one and the UART has space */
void log_flush(void); /* Waits until all is sent: at start-up and after a fault only. Gives up on a UART that accepts
                         nothing for LOG_TRIES polls, and drops the rest. */

#endif
