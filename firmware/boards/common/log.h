/* log: lines for people, through a buffer that the loop empties whenever the UART has room. Nothing ever waits; what
 * does not fit is dropped, and "..." says so. */
#ifndef TAUPERP_LOG_H
#define TAUPERP_LOG_H

#include <stdint.h>

#define LOG_TRIES 200000u /* looks at the UART for one character: several times what one takes at 115200 baud */

void log_text(const char *text);
void log_number(uint32_t number);
void log_hex(uint32_t number, uint32_t digits); /* 1 to 8 digits */
void log_pump(void);                            /* one character, if there is one and the UART takes it */
void log_flush(void); /* all of it, waiting: at start-up and after a fault only. A UART that takes
                         nothing for LOG_TRIES looks is given up, and the rest dropped. */

#endif
