#define _GNU_SOURCE /* -std=c11 hides what is not ISO C */
#include "journal.h"

#include <fcntl.h>
#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "names.h"
#include "protocol.h"
#include "version.h"

#define LINE_BYTES 1400 /* below PIPE_BUF: a write to a pipe is atomic */
#define US_PER_S   1000000u

/* For output only. */
static double newton_metres(num_t value) {
#ifdef TAUPERP_FIXED
    return (double)value / (double)(1u << NUM_FRACTION);
#else
    return (double)value;
#endif
}

typedef struct {
    char text[LINE_BYTES];
    size_t length;
} line_t;

static void add(line_t *line, const char *format, ...) __attribute__((format(printf, 2, 3)));

static void add(line_t *line, const char *format, ...) {
    const size_t room = sizeof line->text - line->length;
    va_list arguments;
    va_start(arguments, format);
    const int added = vsnprintf(&line->text[line->length], room, format, arguments);
    va_end(arguments);
    if ((added > 0) && ((size_t)added < room)) {
        line->length += (size_t)added;
    }
}

/* Writes a string as JSON. Only quotes, backslashes and control characters need an escape. */
static void add_string(line_t *line, const char *key, const char *value) {
    add(line, ",\"%s\":\"", key);
    for (const char *c = value; *c != '\0'; c++) {
        if ((*c == '"') || (*c == '\\')) {
            add(line, "\\%c", *c);
        } else if ((unsigned char)*c < ' ') {
            add(line, "\\u%04x", (unsigned int)(unsigned char)*c);
        } else {
            add(line, "%c", *c);
        }
    }
    add(line, "\"");
}

static void add_number(line_t *line, const char *key, uint64_t value) {
    add(line, ",\"%s\":%llu", key, (unsigned long long)value);
}

static void add_time(line_t *line, uint64_t now_us) {
    add(line, "%llu.%06llu", (unsigned long long)(now_us / US_PER_S), (unsigned long long)(now_us % US_PER_S));
}

static void begin(const journal_t *self, line_t *line, const char *event, uint64_t now_us) {
    line->length = 0;
    add(line, "\n"); /* `put` omits it if the last line was complete */
    if (self->json) {
        add(line, "{\"event\":\"%s\",\"time_s\":", event);
        add_time(line, now_us);
    } else {
        add_time(line, now_us);
        add(line, " %s", event);
    }
}

static ssize_t put(const journal_t *self, const line_t *line) {
    /* After a partial line, start with its line break. */
    const char *const text = self->torn ? line->text : &line->text[1];
    const size_t length = self->torn ? line->length : (line->length - 1u);
    const ssize_t written =
        self->is_socket ? send(self->out, text, length, MSG_DONTWAIT | MSG_NOSIGNAL) : write(self->out, text, length);
    return (written == (ssize_t)length) ? (ssize_t)line->length : written;
}

static void end(journal_t *self, line_t *line) {
    add(line, self->json ? "}\n" : "\n");
    struct pollfd out = {.fd = self->out, .events = POLLOUT};
    const bool room = (poll(&out, 1, 0) == 1) && ((out.revents & POLLOUT) != 0);
    const ssize_t written = room ? put(self, line) : 0;
    if (written != (ssize_t)line->length) {
        self->dropped++;
        self->torn = self->torn || (written > 0);
    } else {
        self->torn = false;
    }
}

/* Other processes share the flags of stdout, so stdout is reopened as non-blocking. A write to a file does not wait
 * long. */
static void find_out(journal_t *self) {
    struct stat kind = {0};
    self->out = STDOUT_FILENO;
    if (fstat(STDOUT_FILENO, &kind) == 0) {
        self->is_socket = S_ISSOCK(kind.st_mode);
        if (S_ISCHR(kind.st_mode) || S_ISFIFO(kind.st_mode)) {
            const int reopened = open("/proc/self/fd/1", O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
            self->out = (reopened >= 0) ? reopened : STDOUT_FILENO;
        }
    }
}

void journal_start(journal_t *self, const options_t *options, const guard_config_t *block, uint32_t channels,
                   journal_denied_t denied) {
    *self = (journal_t){.json = options->json, .verbose = options->verbose};
    find_out(self);
    const bool fd = block->format == (uint32_t)FORMAT_FD;
    line_t line;
    begin(self, &line, "start", 0);
    if (self->json) {
        add(&line, ",\"version\":\"%u.%u.%u\"", TAUPERP_VERSION_MAJOR, TAUPERP_VERSION_MINOR, TAUPERP_VERSION_PATCH);
        add(&line, ",\"config_crc\":\"%08x\",\"wire_crc\":\"%08x\"", block->crc, PROTOCOL_WIRE_CRC);
        add_string(&line, "channel", options->channel);
        add_string(&line, "robot", options->robot);
        add_number(&line, "joints", block->robot.joint_count);
        add_number(&line, "period_us", block->period_us);
        add_string(&line, "format", fd ? "fd" : "classic");
        add_number(&line, "channels", channels);
        add(&line, ",\"lockstep\":%s", options->lockstep ? "true" : "false");
        add(&line, ",\"realtime\":%s", ((options->priority > 0) && (denied.priority == NULL)) ? "true" : "false");
        add(&line, ",\"locked\":%s", (denied.locking == NULL) ? "true" : "false");
        add_number(&line, "pid", (uint64_t)getpid());
    } else {
        add(&line, " tauperp-guard %u.%u.%u, configuration %08x, wire %08x, %s, %u joints, on %s: %s, %u us a cycle",
            TAUPERP_VERSION_MAJOR, TAUPERP_VERSION_MINOR, TAUPERP_VERSION_PATCH, block->crc, PROTOCOL_WIRE_CRC,
            options->robot, block->robot.joint_count, options->channel, fd ? "CAN FD" : "classic CAN",
            block->period_us);
        add(&line, (channels == 2u) ? ", two channels" : ", one channel");
        if (options->lockstep) {
            add(&line, ", in lockstep");
        } else if (denied.priority != NULL) {
            add(&line, ", without real-time priority (%s)", denied.priority);
        } else {
            add(&line, ", priority %d", options->priority);
        }
        if (denied.locking != NULL) {
            add(&line, ", memory not locked (%s)", denied.locking);
        }
    }
    end(self, &line);
}

void journal_state(journal_t *self, uint64_t now_us, const guard_output_t *out) {
    const char *const state = state_name((uint32_t)out->state);
    const char *const reason = reason_name((uint32_t)out->reason);
    line_t line;
    begin(self, &line, "state", now_us);
    if (self->json) {
        add_string(&line, "state", state);
        add_string(&line, "reason", reason);
        add(&line, ",\"permitted\":%s", out->permitted ? "true" : "false");
        add_string(&line, "task", task_name(out->task));
        add_number(&line, "cycle", out->cycle);
        add_number(&line, "trip", out->trip_number);
        add_number(&line, "joint", out->joint);
        add(&line, ",\"value_nm\":%.4f,\"threshold_nm\":%.4f", newton_metres(out->value_nm),
            newton_metres(out->threshold_nm));
    } else {
        add(&line, " %s", state);
        if (!out->permitted) {
            add(&line, ": %s", reason);
        }
        if (!out->permitted && (out->joint != 0u)) {
            add(&line, ", joint %u", out->joint);
        }
        if (out->reason == GUARD_REASON_COLLISION) {
            add(&line, ", %.2f Nm above %.2f Nm", newton_metres(out->value_nm), newton_metres(out->threshold_nm));
        }
        if ((out->state == GUARD_STATE_STOPPED) || (out->state == GUARD_STATE_FAULT)) {
            add(&line, ", trip %u", out->trip_number);
        }
        add(&line, ", cycle %u, task %s", out->cycle, task_name(out->task));
    }
    end(self, &line);
}

void journal_bus(journal_t *self, uint64_t now_us, const char *event, const char *detail) {
    line_t line;
    begin(self, &line, "bus", now_us);
    if (self->json) {
        add_string(&line, "what", event);
        if (detail != NULL) {
            add_string(&line, "detail", detail);
        }
    } else {
        add(&line, " %s", event);
        if (detail != NULL) {
            add(&line, " (%s)", detail);
        }
    }
    end(self, &line);
}

static void add_guard_counters(line_t *line, const guard_counters_t *guard) {
    add_number(line, "crc_errors", guard->crc_errors);
    add_number(line, "sequence_errors", guard->sequence_errors);
    add_number(line, "lost_frames", guard->lost_frames);
    add_number(line, "range_errors", guard->range_errors);
    add_number(line, "format_errors", guard->format_errors);
    add_number(line, "late_frames", guard->late_frames);
    add_number(line, "resets_refused", guard->resets_refused);
    add_number(line, "trips", guard->trips);
}

static void add_durations(line_t *line, const char *name, const histogram_t *histogram) {
    add(line, ",\"%s_us\":{\"count\":%llu,\"p50\":%llu,\"p99\":%llu,\"max\":%llu}", name,
        (unsigned long long)histogram->count, (unsigned long long)histogram_percentile(histogram, 50),
        (unsigned long long)histogram_percentile(histogram, 99), (unsigned long long)histogram->longest);
}

static uint64_t microseconds(struct timeval time) {
    return ((uint64_t)time.tv_sec * US_PER_S) + (uint64_t)time.tv_usec;
}

static void counts_json(line_t *line, const journal_counts_t *counts, const guard_counters_t *guard,
                        const struct rusage *usage) {
    add_number(line, "frames", counts->frames);
    add_number(line, "error_frames", counts->error_frames);
    add_number(line, "overflows", counts->overflows);
    add_number(line, "ticks", counts->ticks);
    add_number(line, "fresh_ticks", counts->fresh_ticks);
    add_number(line, "timer_ticks", counts->timer_ticks);
    add_number(line, "permits", counts->permits);
    add_number(line, "sent", counts->sent);
    add_number(line, "unsent", counts->unsent);
    add_guard_counters(line, guard);
    add_durations(line, "response", &counts->response);
    add_durations(line, "work", &counts->work);
    add_number(line, "user_us", microseconds(usage->ru_utime));
    add_number(line, "system_us", microseconds(usage->ru_stime));
    add_number(line, "page_faults", (uint64_t)usage->ru_minflt + (uint64_t)usage->ru_majflt);
}

static void counts_text(line_t *line, const journal_counts_t *counts, const guard_counters_t *guard) {
    add(line, " %llu frames, %llu ticks (%llu by the clock), %llu permitted", (unsigned long long)counts->frames,
        (unsigned long long)counts->ticks, (unsigned long long)counts->timer_ticks,
        (unsigned long long)counts->permits);
    add(line, "; answer after %llu us (99 %% %llu, longest %llu)",
        (unsigned long long)histogram_percentile(&counts->response, 50),
        (unsigned long long)histogram_percentile(&counts->response, 99), (unsigned long long)counts->response.longest);
    add(line, "; crc %u, sequence %u, lost %u, range %u, format %u, late %u, overflow %llu, unsent %llu, trips %u",
        guard->crc_errors, guard->sequence_errors, guard->lost_frames, guard->range_errors, guard->format_errors,
        guard->late_frames, (unsigned long long)counts->overflows, (unsigned long long)counts->unsent, guard->trips);
}

void journal_counts(journal_t *self, uint64_t now_us, const journal_counts_t *counts, const guard_counters_t *guard,
                    bool last) {
    struct rusage usage = {0};
    (void)getrusage(RUSAGE_SELF, &usage);
    line_t line;
    begin(self, &line, last ? "end" : "counts", now_us);
    if (self->json) {
        counts_json(&line, counts, guard, &usage);
        add_number(&line, "lines_dropped", self->dropped);
    } else {
        counts_text(&line, counts, guard);
    }
    end(self, &line);
}
