#define _GNU_SOURCE /* -std=c11 hides what is not ISO C */
#include "options.h"

#include <errno.h>
#include <getopt.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include "version.h"

#define PROGRAM          "tauperp-guard"
#define DEFAULT_PRIORITY 50
#define MAX_PRIORITY     99

static const char HELP[] = "usage: " PROGRAM " --channel CAN --robot NAME --config FILE [options]\n"
                           "\n"
                           "The collision guard as a process on SocketCAN. It receives the robot's frames\n"
                           "and permits motion or stops it, once per cycle. On SIGTERM or SIGINT it sends a\n"
                           "last StopCommand without permission and ends.\n"
                           "\n"
                           "  --channel CAN    network interface: can0, vcan0, ...\n"
                           "  --robot NAME     robot on that bus; must match the block\n"
                           "  --config FILE    configuration block, made by 'tauperp config TOML -o FILE'\n"
                           "  --lockstep       guard time is bus time: each Sync advances it by one period,\n"
                           "                   independent of the clock (for simulated robots)\n"
                           "  --priority N     SCHED_FIFO priority, 1 to 99, or 0 for none (default 50, in\n"
                           "                   lockstep 0)\n"
                           "  --verbose        also print a line of counters every second\n"
                           "  --json           print one JSON object per line instead of text\n"
                           "  --version        print the version\n"
                           "  --help           print this help\n"
                           "\n"
                           "Exit code: 0 ended by a signal, 1 cannot continue, 2 bad input.\n";

void complain(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    (void)fputs(PROGRAM ": ", stderr);
    (void)vfprintf(stderr, format, arguments);
    (void)fputc('\n', stderr);
    va_end(arguments);
}

static bool read_priority(int *priority, const char *text) {
    char *end = NULL;
    errno = 0;
    const long value = strtol(text, &end, 10);
    if ((errno != 0) || (end == text) || (*end != '\0') || (value < 0) || (value > MAX_PRIORITY)) {
        complain("--priority: '%s' is not a number from 0 to %d", text, MAX_PRIORITY);
        return false;
    }
    *priority = (int)value;
    return true;
}

static bool is_complete(const options_t *self) {
    const char *missing = NULL;
    if (self->config == NULL) {
        missing = "--config";
    }
    if (self->robot == NULL) {
        missing = "--robot";
    }
    if (self->channel == NULL) {
        missing = "--channel";
    }
    if (missing != NULL) {
        complain("%s is missing (see '" PROGRAM " --help')", missing);
        return false;
    }
    if (self->json && self->verbose) {
        complain("--verbose and --json exclude each other");
        return false;
    }
    return true;
}

options_status_t options_read(options_t *self, int argc, char **argv) {
    enum { CHANNEL = 1, ROBOT, CONFIG, LOCKSTEP, PRIORITY, VERBOSE, JSON, VERSION, HELP_OPTION };
    static const struct option known[] = {{"channel", required_argument, NULL, CHANNEL},
                                          {"robot", required_argument, NULL, ROBOT},
                                          {"config", required_argument, NULL, CONFIG},
                                          {"lockstep", no_argument, NULL, LOCKSTEP},
                                          {"priority", required_argument, NULL, PRIORITY},
                                          {"verbose", no_argument, NULL, VERBOSE},
                                          {"json", no_argument, NULL, JSON},
                                          {"version", no_argument, NULL, VERSION},
                                          {"help", no_argument, NULL, HELP_OPTION},
                                          {NULL, 0, NULL, 0}};
    *self = (options_t){.priority = -1};
    opterr = 0;
    int option = getopt_long(argc, argv, ":", known, NULL);
    for (; option != -1; option = getopt_long(argc, argv, ":", known, NULL)) {
        switch (option) {
        case CHANNEL:
            self->channel = optarg;
            break;
        case ROBOT:
            self->robot = optarg;
            break;
        case CONFIG:
            self->config = optarg;
            break;
        case LOCKSTEP:
            self->lockstep = true;
            break;
        case PRIORITY:
            if (!read_priority(&self->priority, optarg)) {
                return OPTIONS_BAD;
            }
            break;
        case VERBOSE:
            self->verbose = true;
            break;
        case JSON:
            self->json = true;
            break;
        case VERSION:
            (void)printf(PROGRAM " %u.%u.%u\n", TAUPERP_VERSION_MAJOR, TAUPERP_VERSION_MINOR, TAUPERP_VERSION_PATCH);
            return OPTIONS_DONE;
        case HELP_OPTION:
            (void)fputs(HELP, stdout);
            return OPTIONS_DONE;
        case ':':
            complain("%s needs a value (see '" PROGRAM " --help')", argv[optind - 1]);
            return OPTIONS_BAD;
        default:
            complain("unknown option %s (see '" PROGRAM " --help')", argv[optind - 1]);
            return OPTIONS_BAD;
        }
    }
    if (optind < argc) {
        complain("'%s' is not an option (see '" PROGRAM " --help')", argv[optind]);
        return OPTIONS_BAD;
    }
    if (self->priority < 0) {
        self->priority = self->lockstep ? 0 : DEFAULT_PRIORITY;
    }
    return is_complete(self) ? OPTIONS_OK : OPTIONS_BAD;
}
