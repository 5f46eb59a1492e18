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
#define REOPEN_EACH    100000u /* us between two looks for an interface that is gone */
#define EVENTS_AT_ONCE 3

/* --- time --------------------------------------------------------------------------------------------------------- */

static void set_timer(loop_t *self, uint64_t due_us) {
    self->due_us = due_us;
    const struct itimerspec when = {
        .it_value = {.tv_sec = (time_t)(due_us / US_PER_S), .tv_nsec = (long)(due_us % US_PER_S) * NS_PER_US}};
    (void)timerfd_settime(self->timer, TFD_TIMER_ABSTIME, &when, NULL);
}

/* What a tick on a complete cycle leaves the next cycle to be late by. */
static uint64_t grace_us(const guard_config_t *config) {
    const uint32_t left = (config->tick_deadline_us - config->period_us) / 2u;
    const uint32_t half = config->period_us / 2u;
    return (left < half) ? left : half;
}

/* What the journal says: guard time, as the states beside it. */
static uint64_t journal_time(const loop_t *self, uint64_t now_us) {
    return self->in_lockstep ? self->lockstep.now_us : now_us;
}

/* --- the bus's troubles ------------------------------------------------------------------------------------------- */

static void withdraw(loop_t *self, guard_reason_t reason) {
    if ((self->out.state == GUARD_STATE_MONITORING) || (self->out.state == GUARD_STATE_STOPPED)) {
        guard_trip(&self->guard, reason);
        self->urgent = self->urgent || self->out.permitted;
    }
}

/* The socket said so, on reading or on sending. */
static void bus_failed(loop_t *self, uint64_t now_us, int problem) {
    if (!self->stuck) {
        self->stuck = true;
        journal_bus(&self->journal, journal_time(self, now_us), "does not take frames", strerror(problem));
        withdraw(self, GUARD_REASON_BUS_DOWN);
    }
    if ((problem == ENODEV) || (problem == ENXIO)) {
        bus_close(&self->bus); /* and out of the epoll with it */
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
            journal_bus(&self->journal, journal_time(self, now_us), "opened anew", NULL);
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
        /* only told */
    }
    if (error != self->bus_errors) { /* a storm of the same is one line */
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

/* States at once; a reason that changes within one at most once a second. */
static void tell_state(loop_t *self, uint64_t monotonic_us, uint64_t now_us, const guard_output_t *before) {
    const guard_output_t *const out = &self->out;
    const bool other = !self->told_state || (out->state != before->state) || (out->trip_number != before->trip_number);
    if (other || ((out->reason != before->reason) && (monotonic_us >= (self->told_us + US_PER_S)))) {
        self->told_state = true;
        self->told_us = monotonic_us;
        journal_state(&self->journal, now_us, out);
    }
}

static void send_answer(loop_t *self, uint64_t now_us) {
    int problem = 0;
    const size_t sent = bus_send(&self->bus, self->out.frame, self->out.frame_count, &problem);
    self->counts.sent += sent;
    self->counts.unsent += self->out.frame_count - sent;
    if (sent == 0u) {
        bus_failed(self, now_us, problem);
    } else if (self->stuck) {
        self->stuck = false;
        journal_bus(&self->journal, journal_time(self, now_us), "takes frames again", NULL);
    } else {
        /* as ever */
    }
}

/* At guard time now_us, which in real time is about monotonic_us. Returns when it was done. */
static uint64_t tick(loop_t *self, uint64_t monotonic_us, uint64_t now_us) {
    const guard_output_t before = self->out;
    guard_tick(&self->guard, now_us, &self->out);
    const uint64_t done_us = clock_monotonic_us();
    if (!self->in_lockstep) { /* there, a tick takes no time */
        const uint64_t took_us = done_us - monotonic_us;
        guard_note_tick_time(&self->guard, (took_us < UINT32_MAX) ? (uint32_t)took_us : UINT32_MAX);
    }
    send_answer(self, now_us);
    self->counts.ticks++;
    self->counts.fresh_ticks += self->out.fresh ? 1u : 0u;
    self->counts.permits += self->out.permitted ? 1u : 0u;
    tell_state(self, done_us, now_us, &before);
    return done_us;
}

static void tick_in_real_time(loop_t *self) {
    const uint64_t monotonic_us = clock_monotonic_us();
    (void)tick(self, monotonic_us, clock_now(&self->clock, monotonic_us));
    set_timer(self, monotonic_us + self->config->period_us + (self->out.fresh ? grace_us(self->config) : 0u));
}

/* The cycle is complete: answer. `frame_us` is when its last frame came in, `read_us` when it was read. */
static void answer(loop_t *self, uint64_t frame_us, uint64_t read_us) {
    const uint64_t begin_us = clock_monotonic_us();
    uint64_t ready_us = begin_us;
    if (self->in_lockstep) {
        ready_us = tick(self, begin_us, self->lockstep.now_us);
    } else {
        ready_us = tick(self, begin_us, clock_now(&self->clock, begin_us));
        set_timer(self, begin_us + self->config->period_us + grace_us(self->config));
    }
    histogram_add(&self->counts.work, ready_us - read_us);
    histogram_add(&self->counts.response, clock_monotonic_us() - frame_us);
}

/* --- frames ------------------------------------------------------------------------------------------------------- */

/* The guard itself withdraws the permission (ANOTHER_GUARD); here it does so at once, and is told. Frames that this
 * process sends do not come back to it. */
static void look_for_company(loop_t *self, const can_frame_t *frame, uint64_t now_us) {
    if (frame->id != protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND].id) {
        return;
    }
    self->urgent = self->urgent || self->out.permitted;
    if (!self->told_company) {
        self->told_company = true;
        journal_bus(&self->journal, journal_time(self, now_us), "another guard answers on this bus", NULL);
    }
}

static void take_frame(loop_t *self, const can_frame_t *frame, uint64_t frame_us, uint64_t read_us) {
    self->counts.frames++;
    look_for_company(self, frame, frame_us);
    uint64_t now_us = frame_us;
    if (self->in_lockstep) {
        lockstep_hear(&self->lockstep, frame);
        while (lockstep_owes_tick(&self->lockstep)) {
            self->counts.timer_ticks++;
            (void)tick(self, read_us, self->lockstep.now_us);
        }
        now_us = self->lockstep.now_us;
    }
    guard_receive(&self->guard, frame, now_us);
    if (guard_cycle_complete(&self->guard) && (!self->in_lockstep || lockstep_complete(&self->lockstep))) {
        answer(self, frame_us, read_us);
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
        self->heard_us = read.monotonic_us;
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

/* --- the clock's turn --------------------------------------------------------------------------------------------- */

static void watch_silence(loop_t *self, uint64_t monotonic_us) {
    if (monotonic_us < (self->heard_us + LOCKSTEP_SILENCE_US)) {
        set_timer(self, self->heard_us + LOCKSTEP_SILENCE_US);
        return;
    }
    if (lockstep_silence(&self->lockstep)) {
        self->counts.timer_ticks++;
        (void)tick(self, monotonic_us, self->lockstep.now_us);
    }
    set_timer(self, monotonic_us + LOCKSTEP_SILENCE_US);
}

static void look_at_clock(loop_t *self) {
    uint64_t expirations = 0;
    (void)!read(self->timer, &expirations, sizeof expirations);
    const uint64_t monotonic_us = clock_monotonic_us();
    if (monotonic_us < self->due_us) {
        return; /* a tick has moved it on since */
    }
    look_for_interface(self, monotonic_us);
    if (self->in_lockstep) {
        watch_silence(self, monotonic_us);
    } else {
        self->counts.timer_ticks++;
        tick_in_real_time(self);
    }
}

static void act_at_once(loop_t *self) {
    if (self->urgent) {
        self->urgent = false;
        if (!self->in_lockstep) { /* there, a cycle has one tick: the next one tells */
            tick_in_real_time(self);
        }
    }
}

static void tell_counts(loop_t *self, uint64_t *last_us) {
    if (self->journal.verbose && (self->clock.latest_us >= (*last_us + US_PER_S))) {
        *last_us = self->clock.latest_us;
        journal_counts(&self->journal, journal_time(self, self->clock.latest_us), &self->counts, &self->guard.counters,
                       false);
    }
}

/* --- begin, go on, end -------------------------------------------------------------------------------------------- */

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
    (void)signal(SIGPIPE, SIG_IGN); /* whoever read the log has gone */
}

static bool begin(loop_t *self) {
    const sigset_t ending = ending_signals();
    self->epoll = epoll_create1(EPOLL_CLOEXEC);
    self->timer = timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC);
    self->signals = signalfd(-1, &ending, SFD_NONBLOCK | SFD_CLOEXEC);
    if ((self->epoll < 0) || !watch(self, self->timer) || !watch(self, self->signals) ||
        !watch(self, self->bus.socket)) {
        complain("%s", strerror(errno));
        return false;
    }
    self->lockstep = (lockstep_t){.period_us = self->config->period_us};
    self->heard_us = clock_now(&self->clock, clock_monotonic_us());
    set_timer(self, self->in_lockstep ? (self->heard_us + LOCKSTEP_SILENCE_US) : self->heard_us);
    return true;
}

/* True when a signal asks to end. */
static bool turn(loop_t *self, const struct epoll_event *events, int count) {
    bool end = false;
    bool timer = false;
    for (int i = 0; i < count; i++) {
        if (events[i].data.fd == self->signals) {
            end = true;
        } else if (events[i].data.fd == self->timer) {
            timer = true; /* after the frames: they may make its tick needless */
        } else {
            hear(self);
        }
    }
    act_at_once(self);
    if (timer) {
        look_at_clock(self);
        act_at_once(self); /* its answer may not have gone out */
    }
    return end;
}

static void last_words(loop_t *self) {
    guard_trip(&self->guard, GUARD_REASON_SHUTDOWN);
    const uint64_t monotonic_us = clock_monotonic_us();
    const uint64_t now_us = self->in_lockstep ? self->lockstep.now_us : clock_now(&self->clock, monotonic_us);
    (void)tick(self, monotonic_us, now_us);
    journal_counts(&self->journal, now_us, &self->counts, &self->guard.counters, true);
}

bool loop_run(loop_t *self) {
    if (!begin(self)) {
        return false;
    }
    uint64_t counts_us = self->heard_us;
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
