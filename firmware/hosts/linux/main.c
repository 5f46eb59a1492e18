/* tauperp-guard: the guard as a process on SocketCAN. See README.md for a real adapter. */
#define _GNU_SOURCE /* -std=c11 hides what is not ISO C */
#include <errno.h>
#include <fcntl.h>
#include <sched.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "block.h"
#include "loop.h"
#include "options.h"
#include "restarts.h"

enum { EXIT_ENDED = 0, EXIT_CANNOT = 1, EXIT_BAD_INPUT = 2 };

#define STACK_BYTES (128 * 1024) /* more than the loop needs; mapped before it starts */

static void touch_stack(void) {
    volatile unsigned char stack[STACK_BYTES];
    for (size_t i = 0; i < sizeof stack; i += 1024u) {
        stack[i] = 0;
    }
}

static journal_denied_t ask_for_real_time(int priority) {
    journal_denied_t denied = {NULL, NULL};
    if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
        denied.locking = strerror(errno);
    }
    touch_stack();
    const struct sched_param wanted = {.sched_priority = priority};
    if (priority == 0) {
        denied.priority = "not requested";
    } else if (sched_setscheduler(0, SCHED_FIFO, &wanted) != 0) {
        denied.priority = strerror(errno);
    } else {
        /* granted */
    }
    return denied;
}

/* Opens descriptors 0 to 2 if the caller closed them. Otherwise the bus socket could become stdout. */
static void open_standard_files(void) {
    int file = 0;
    while ((file >= 0) && (file <= STDERR_FILENO)) {
        file = open("/dev/null", O_RDWR);
    }
    (void)close(file);
}

int main(int argc, char **argv) {
    static loop_t loop; /* too large for the stack */
    options_t options;
    open_standard_files();
    const options_status_t asked = options_read(&options, argc, argv);
    if (asked != OPTIONS_OK) {
        return (asked == OPTIONS_DONE) ? EXIT_ENDED : EXIT_BAD_INPUT;
    }
    const void *second = NULL;
    loop.config = block_load(options.config, options.robot, &second);
    if (loop.config == NULL) {
        return EXIT_BAD_INPUT;
    }
    const guard_status_t status = pair_init(&loop.pair, loop.config, second);
    if (status != GUARD_OK) {
        complain("%s: %s", options.config, block_problem(status));
        return EXIT_BAD_INPUT;
    }
    if (!bus_open(&loop.bus, options.channel, loop.config->format == (uint32_t)FORMAT_FD)) {
        return EXIT_BAD_INPUT;
    }
    const restarts_t restarts = restarts_note();
    pair_note_start(&loop.pair, restarts.cause, restarts.count,
                    options.lockstep ? GUARD_VARIANT_LOCKSTEP : GUARD_VARIANT_PRODUCT);
    loop.in_lockstep = options.lockstep;
    loop_hold_signals();
    journal_start(&loop.journal, &options, loop.config, (second == NULL) ? 1u : 2u,
                  ask_for_real_time(options.priority));
    if (!loop_run(&loop)) {
        return EXIT_CANNOT;
    }
    restarts_forget();
    return EXIT_ENDED;
}
