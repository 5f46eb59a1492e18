/* options: the command line of the process. */
#ifndef TAUPERP_LINUX_OPTIONS_H
#define TAUPERP_LINUX_OPTIONS_H

#include <stdbool.h>

typedef struct {
    const char *channel; /* network interface, for example can0 */
    const char *robot;   /* expected robot of the block */
    const char *config;  /* file of the configuration block */
    bool lockstep;       /* guard time is bus time: lockstep.h */
    bool verbose;
    bool json;
    int priority; /* SCHED_FIFO, 1 to 99; 0: stay as started */
} options_t;

typedef enum { OPTIONS_NONE = 0, OPTIONS_OK = 1, OPTIONS_DONE = 2, OPTIONS_BAD = 3 } options_status_t;

/* OPTIONS_DONE after --help or --version, which print. OPTIONS_BAD after one line on stderr. The strings belong to
 * argv. */
options_status_t options_read(options_t *self, int argc, char **argv);

/* Writes one line on stderr, starting with the program's name. For bad input before the loop starts. */
void complain(const char *format, ...) __attribute__((format(printf, 1, 2)));

#endif
