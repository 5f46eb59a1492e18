/* loop: the one loop of the process: frames in, ticks, frames out.
 *
 * schedule.h says when to tick.
 *
 * A bus fault ends the permission (guard_trip), and the process tries to send that StopCommand at once:
 *   bus-off: BUS_OFF; the interface is down or gone, the controller's transmission times out, or the kernel does not
 *   take a StopCommand (its queue is full, so older ones are stuck in it): BUS_DOWN; the socket or the controller lost
 *   frames: RX_OVERFLOW. The guard gets them in every state, before the first tick too.
 *   Another guard's StopCommand: ANOTHER_GUARD (guard.h), at once.
 * An interface that comes back, or is removed and created again under its name, is used again without a restart. The
 * trip stays latched like any other.
 */
#ifndef TAUPERP_LINUX_LOOP_H
#define TAUPERP_LINUX_LOOP_H

#include "bus.h"
#include "clock.h"
#include "event_log.h"
#include "guard.h"
#include "journal.h"
#include "schedule.h"

typedef struct {
    const guard_config_t *config;
    guard_t guard; /* initialised */
    bus_t bus;     /* open */
    journal_t journal;
    bool in_lockstep;

    guard_output_t out; /* of the last tick */
    schedule_t schedule;
    event_log_t events;
    guard_clock_t clock;
    journal_counts_t counts;
    int epoll, timer, signals;
    uint64_t timer_us;   /* what the timer is set to */
    uint64_t told_us;    /* the last line of counters or of a reason that changes */
    uint32_t overflows;  /* of the socket, as last seen */
    uint32_t bus_errors; /* BUS_ERROR_*, as last told */
    bool stuck;          /* the bus does not take frames, since a StopCommand last went out */
    bool timer_set;
    bool urgent;       /* tick at once */
    bool told_state;   /* a state has been told */
    bool told_company; /* that there is another guard */
} loop_t;

/* Before the first line or frame: from here on SIGTERM, SIGINT and SIGHUP wait until loop_run looks for them. */
void loop_hold_signals(void);

/* Runs until SIGTERM, SIGINT or SIGHUP, then sends a last StopCommand without permission and returns true. False, after
 * one line on stderr, if it cannot start or continue. */
bool loop_run(loop_t *self);

#endif
