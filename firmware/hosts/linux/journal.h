/* journal: the output of the process on stdout, as text or as one JSON object per line.
 *
 * The loop never waits for the reader (a full pipe, a stopped terminal): a line that cannot be written at once is
 * dropped and counted. No line allocates. now_us is guard time.
 */
#ifndef TAUPERP_LINUX_JOURNAL_H
#define TAUPERP_LINUX_JOURNAL_H

#include "guard.h"
#include "histogram.h"
#include "options.h"

/* Counts since the start. */
typedef struct {
    uint64_t frames;       /* given to the guard */
    uint64_t error_frames; /* of the CAN controller */
    uint64_t overflows;    /* frames lost by the kernel or the controller */
    uint64_t ticks;
    uint64_t fresh_ticks; /* on a complete cycle */
    uint64_t timer_ticks; /* made by the clock, without a complete cycle */
    uint64_t permits;     /* ticks with permission */
    uint64_t sent;
    uint64_t unsent;      /* frames that could not be sent */
    histogram_t response; /* us from reception of the frame that completed a cycle until the kernel has the answer */
    histogram_t work;     /* us from reading that frame until the answer is ready: this process without the kernel */
} journal_counts_t;

typedef struct {
    bool json;
    bool verbose;
    uint64_t dropped; /* lines */
    int out;          /* stdout, or stdout reopened as non-blocking */
    bool is_socket;   /* stdout is a socket, as under systemd */
    bool torn;        /* the last line was written only in part */
} journal_t;

/* Requests that the kernel refused, by name; NULL for those it granted. */
typedef struct {
    const char *priority;
    const char *locking;
} journal_denied_t;

void journal_start(journal_t *self, const options_t *options, const guard_config_t *block, uint32_t channels,
                   journal_denied_t denied);

/* Writes a change of state or reason. */
void journal_state(journal_t *self, uint64_t now_us, const guard_output_t *out);

/* Writes an event of the bus; `detail` may be NULL. */
void journal_bus(journal_t *self, uint64_t now_us, const char *event, const char *detail);

/* Writes the counters. Call it once a second, and once at the end. */
void journal_counts(journal_t *self, uint64_t now_us, const journal_counts_t *counts, const guard_counters_t *guard,
                    bool last);

#endif
