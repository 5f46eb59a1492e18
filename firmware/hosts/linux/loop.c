#define _GNU_SOURCE /* -std=c11 hides what is not ISO C */
#include "loop.h"

#include <errno.h>
#include <signal.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/signalfd.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include "options.h"

#define US_PER_S       1000000u
#define NS_PER_US      1000
#define REOPEN_EACH    100000u /* us between two attempts to reopen a missing interface */
#define EVENTS_AT_ONCE 3

/* --- time --------------------------------------------------------------------------------------------------------- */

/* A timer that fires too early costs one wake-up. Setting it again for every frame costs one system call each. */
static void set_timer(loop_t *self) {
    const uint64_t due_us = self->schedule.due_us;
    if (self->timer_set && (self->timer_us <= due_us)) {
        return;
    }
    /* A time of zero would disarm it. */
    const uint64_t at_us = (due_us > 0u) ? due_us : 1u;
    const struct itimerspec when = {
        .it_value = {.tv_sec = (time_t)(at_us / US_PER_S), .tv_nsec = (long)(at_us % US_PER_S) * NS_PER_US}};
    (void)timerfd_settime(self->timer, TFD_TIMER_ABSTIME, &when, NULL);
    self->timer_us = at_us;
    self->timer_set = true;
}

/* Guard time for the journal, the same as that of the states. */
static uint64_t journal_time(const loop_t *self, uint64_t now_us) {
    return schedule_time(&self->schedule, now_us);
}

/* --- bus faults --------------------------------------------------------------------------------------------------- */

/* Passed on in every state, also before the first tick: the guard decides on the consequence. */
static void withdraw(loop_t *self, guard_reason_t reason) {
    pair_trip(&self->pair, reason);
    self->urgent = self->urgent || self->out.permitted;
}

/* An error of the socket, on reading or on sending. */
static void bus_failed(loop_t *self, uint64_t now_us, int problem) {
    if (!self->stuck) {
        self->stuck = true;
        journal_bus(&self->journal, journal_time(self, now_us), "does not take frames", strerror(problem));
        withdraw(self, GUARD_REASON_BUS_DOWN);
    }
    if ((problem == ENODEV) || (problem == ENXIO)) {
        bus_close(&self->bus); /* this also removes it from the epoll set */
    }
}

static bool watch(const loop_t *self, int file) {
    struct epoll_event event = {.events = EPOLLIN, .data = {.fd = file}};
    return epoll_ctl(self->epoll, EPOLL_CTL_ADD, file, &event) == 0;
}

static void look_for_interface(loop_t *self, uint64_t now_us) {
    if ((self->bus.socket < 0) && bus_reopen(&self->bus)) {
        self->overflows = 0;
        if (watch(self, self->bus.socket)) {
            journal_bus(&self->journal, journal_time(self, now_us), "reopened", NULL);
        } else {
            bus_close(&self->bus);
        }
    }
}

static void take_error(loop_t *self, uint64_t now_us, uint32_t error) {
    self->counts.error_frames++;
    if ((error & BUS_ERROR_OFF) != 0u) {
        withdraw(self, GUARD_REASON_BUS_OFF);
    } else if ((error & BUS_ERROR_TX_TIMEOUT) != 0u) {
        withdraw(self, GUARD_REASON_BUS_DOWN);
    } else if ((error & BUS_ERROR_OVERFLOW) != 0u) {
        self->counts.overflows++;
        withdraw(self, GUARD_REASON_RX_OVERFLOW);
    } else {
        /* reported only */
    }
    if (error != self->bus_errors) { /* repeated errors make one line */
        self->bus_errors = error;
        const char *const what = ((error & BUS_ERROR_OFF) != 0u)          ? "bus-off"
                                 : ((error & BUS_ERROR_RESTARTED) != 0u)  ? "restarted after bus-off"
                                 : ((error & BUS_ERROR_TX_TIMEOUT) != 0u) ? "transmission timed out"
                                 : ((error & BUS_ERROR_OVERFLOW) != 0u)   ? "the controller lost frames"
                                 : ((error & BUS_ERROR_PASSIVE) != 0u)    ? "error passive"
                                                                          : "errors";
        journal_bus(&self->journal, journal_time(self, now_us), what, NULL);
    }
}

static void look_for_overflow(loop_t *self, uint64_t now_us) {
    if (self->bus.overflows != self->overflows) {
        self->counts.overflows += (uint32_t)(self->bus.overflows - self->overflows);
        self->overflows = self->bus.overflows;
        journal_bus(&self->journal, journal_time(self, now_us), "the receive buffer lost frames", NULL);
        withdraw(self, GUARD_REASON_RX_OVERFLOW);
    }
}

/* --- one tick ----------------------------------------------------------------------------------------------------- */

/* Reports states at once, and a changed reason within a state at most once a second. */
static void tell_state(loop_t *self, uint64_t monotonic_us, uint64_t now_us, const guard_output_t *before) {
    const guard_output_t *const out = &self->out;
    const bool other =
        !self->state_reported || (out->state != before->state) || (out->trip_number != before->trip_number);
    if (other || ((out->reason != before->reason) && (monotonic_us >= (self->reported_us + US_PER_S)))) {
        self->state_reported = true;
        self->reported_us = monotonic_us;
        journal_state(&self->journal, now_us, out);
    }
}

/* Sends the guard's frames, and after them sometimes one of the event recorder. Real time only, because runs in
 * lockstep are compared byte for byte. */
static void send_answer(loop_t *self, uint64_t now_us) {
    int problem = 0;
    can_frame_t frames[GUARD_MAX_FRAMES + 1u];
    size_t count = self->out.frame_count;
    (void)memcpy(frames, self->out.frame, sizeof self->out.frame);
    if (!self->schedule.in_lockstep) {
        event_log_note(&self->events, &self->out);
        count += event_log_frame(&self->events, &frames[count]) ? 1u : 0u;
    }
    const size_t sent = bus_send(&self->bus, frames, count, &problem);
    self->counts.sent += sent;
    self->counts.unsent += count - sent;
    if (sent == 0u) {
        bus_failed(self, now_us, problem);
    } else if (self->stuck) {
        self->stuck = false;
        journal_bus(&self->journal, journal_time(self, now_us), "takes frames again", NULL);
    } else {
        /* no change */
    }
}

/* Ticks now. Returns the time at which the verdict was ready. */
static uint64_t tick(loop_t *self) {
    const guard_output_t before = self->out;
    const uint64_t monotonic_us = clock_monotonic_us();
    const uint64_t now_us = schedule_time(&self->schedule, clock_now(&self->clock, monotonic_us));
    pair_tick(&self->pair, now_us, &self->out);
    const uint64_t done_us = clock_monotonic_us();
    if (!self->schedule.in_lockstep) { /* in lockstep a tick takes no time */
        const uint64_t took_us = done_us - monotonic_us;
        pair_note_tick_time(&self->pair, (took_us < UINT32_MAX) ? (uint32_t)took_us : UINT32_MAX);
    }
    send_answer(self, now_us);
    schedule_ticked(&self->schedule, monotonic_us, self->out.fresh);
    self->counts.ticks++;
    self->counts.fresh_ticks += self->out.fresh ? 1u : 0u;
    self->counts.permits += self->out.permitted ? 1u : 0u;
    tell_state(self, done_us, now_us, &before);
    return done_us;
}

static void timer_tick(loop_t *self) {
    self->counts.timer_ticks++;
    (void)tick(self);
}

/* --- frames ------------------------------------------------------------------------------------------------------- */

/* The guard itself withdraws the permission (ANOTHER_GUARD). Here it does so at once, and the process reports it. The
 * socket does not return frames of this process. */
static void look_for_company(loop_t *self, const can_frame_t *frame, uint64_t now_us) {
    if (frame->id != protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND].id) {
        return;
    }
    self->urgent = self->urgent || self->out.permitted;
    if (!self->second_guard_reported) {
        self->second_guard_reported = true;
        journal_bus(&self->journal, journal_time(self, now_us), "another guard answers on this bus", NULL);
    }
}

static void take_frame(loop_t *self, const can_frame_t *frame, uint64_t frame_us, uint64_t read_us) {
    self->counts.frames++;
    look_for_company(self, frame, frame_us);
    schedule_hear(&self->schedule, frame, read_us);
    while (schedule_owes_tick(&self->schedule)) {
        timer_tick(self);
    }
    pair_receive(&self->pair, frame, schedule_time(&self->schedule, frame_us));
    if (schedule_complete(&self->schedule, pair_cycle_complete(&self->pair))) {
        const uint64_t ready_us = tick(self);
        histogram_add(&self->counts.work, ready_us - read_us);
        histogram_add(&self->counts.response, clock_monotonic_us() - frame_us);
    }
}

static void hear(loop_t *self) {
    bus_frame_t frames[BUS_BATCH];
    int problem = 0;
    const size_t count = bus_receive(&self->bus, frames, &problem);
    const clock_pair_t read = clock_read_pair();
    if (problem != 0) {
        bus_failed(self, read.monotonic_us, problem);
    }
    if (count > 0u) {
        look_for_overflow(self, read.monotonic_us);
    }
    for (size_t i = 0; i < count; i++) {
        const uint64_t frame_us = clock_of_frame(&self->clock, read, frames[i].stamped ? &frames[i].stamp : NULL);
        if (frames[i].kind == BUS_FRAME_ERROR) {
            take_error(self, frame_us, frames[i].error);
        } else {
            take_frame(self, &frames[i].frame, frame_us, read.monotonic_us);
        }
    }
}

/* --- timer -------------------------------------------------------------------------------------------------------- */

static void look_at_clock(loop_t *self) {
    uint64_t expirations = 0;
    (void)!read(self->timer, &expirations, sizeof expirations);
    self->timer_set = false;
    const uint64_t monotonic_us = clock_monotonic_us();
    if (monotonic_us < self->schedule.due_us) {
        return; /* a tick has moved it since */
    }
    look_for_interface(self, monotonic_us);
    if (schedule_is_due(&self->schedule, monotonic_us)) {
        timer_tick(self);
    }
}

static void act_at_once(loop_t *self) {
    if (self->urgent) {
        self->urgent = false;
        if (!self->schedule.in_lockstep) { /* in lockstep a cycle has one tick: the next one reports the fault */
            (void)tick(self);
        }
    }
}

static void tell_counts(loop_t *self, uint64_t *last_us) {
    if (self->journal.verbose && (self->clock.latest_us >= (*last_us + US_PER_S))) {
        *last_us = self->clock.latest_us;
        journal_counts(&self->journal, journal_time(self, self->clock.latest_us), &self->counts,
                       &self->pair.guard.counters, false);
    }
}

/* --- start, run, end ---------------------------------------------------------------------------------------------- */

static sigset_t ending_signals(void) {
    sigset_t ending;
    (void)sigemptyset(&ending);
    (void)sigaddset(&ending, SIGTERM);
    (void)sigaddset(&ending, SIGINT);
    (void)sigaddset(&ending, SIGHUP);
    return ending;
}

void loop_hold_signals(void) {
    const sigset_t ending = ending_signals();
    (void)sigprocmask(SIG_BLOCK, &ending, NULL);
    (void)signal(SIGPIPE, SIG_IGN); /* the reader of the log may end */
}

static bool begin(loop_t *self) {
    const sigset_t ending = ending_signals();
    self->epoll = epoll_create1(EPOLL_CLOEXEC);
    self->timer = timerfd_create(clock_choose(), TFD_NONBLOCK | TFD_CLOEXEC);
    self->signals = signalfd(-1, &ending, SFD_NONBLOCK | SFD_CLOEXEC);
    if ((self->epoll < 0) || !watch(self, self->timer) || !watch(self, self->signals) ||
        !watch(self, self->bus.socket)) {
        complain("%s", strerror(errno));
        return false;
    }
    schedule_init(&self->schedule, self->config, self->in_lockstep, clock_now(&self->clock, clock_monotonic_us()));
    event_log_init(&self->events, self->config);
    set_timer(self);
    return true;
}

/* True if a signal requests the end. */
static bool turn(loop_t *self, const struct epoll_event *events, int count) {
    bool end = false;
    bool timer = false;
    for (int i = 0; i < count; i++) {
        if (events[i].data.fd == self->signals) {
            end = true;
        } else if (events[i].data.fd == self->timer) {
            timer = true; /* after the frames, which may make its tick unnecessary */
        } else {
            hear(self);
        }
    }
    act_at_once(self);
    if (timer) {
        look_at_clock(self);
        act_at_once(self); /* the last answer may not have been sent */
    }
    set_timer(self);
    return end;
}

static void last_words(loop_t *self) {
    pair_trip(&self->pair, GUARD_REASON_SHUTDOWN);
    (void)tick(self);
    journal_counts(&self->journal, journal_time(self, self->clock.latest_us), &self->counts, &self->pair.guard.counters,
                   true);
}

bool loop_run(loop_t *self) {
    if (!begin(self)) {
        return false;
    }
    uint64_t counts_us = self->clock.latest_us;
    for (bool end = false; !end;) {
        struct epoll_event events[EVENTS_AT_ONCE];
        const int count = epoll_wait(self->epoll, events, EVENTS_AT_ONCE, -1);
        if ((count < 0) && (errno != EINTR)) {
            complain("epoll: %s", strerror(errno));
            return false;
        }
        end = turn(self, events, count);
        tell_counts(self, &counts_us);
    }
    last_words(self);
    return true;
}
