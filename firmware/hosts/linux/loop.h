/* loop: the only loop of the process. It receives frames, ticks, and sends the answers. schedule.h decides when to
 * tick.
 *
 * A bus fault ends the permission (guard_trip), and the process tries to send that StopCommand at once:
 *   - BUS_OFF: the controller is bus-off.
 *   - BUS_DOWN: the interface is down or gone, the controller's transmission times out, or the kernel does not accept a
 *     StopCommand (its queue is full of older ones).
 *   - RX_OVERFLOW: the socket or the controller lost frames.
 *   - ANOTHER_GUARD: a StopCommand of another guard was received (guard.h).
 * The guard gets them in every state, also before the first tick. An interface that is up again, or is removed and
 * created again under its name, is used again without a restart. The trip stays latched.
 */
#ifndef TAUPERP_LINUX_LOOP_H
#define TAUPERP_LINUX_LOOP_H

#include "bus.h"
#include "clock.h"
#include "event_log.h"
#include "journal.h"
#include "pair.h"
#include "schedule.h"

typedef struct {
    const guard_config_t *config;
    pair_t pair; /* initialised */
    bus_t bus;   /* open */
    journal_t journal;
    bool in_lockstep;

    guard_output_t out; /* of the last tick */
    schedule_t schedule;
    event_log_t events;
    guard_clock_t clock;
    journal_counts_t counts;
    int epoll, timer, signals;
    uint64_t timer_us;    /* the time that the timer is set to */
    uint64_t reported_us; /* time of the last line of counters or of a changed reason */
    uint32_t overflows;   /* of the socket, as last read */
    uint32_t bus_errors;  /* BUS_ERROR_*, as last reported */
    bool stuck;           /* the bus has accepted no frames since the last sent StopCommand */
    bool timer_set;
    bool urgent;                /* tick at once */
    bool state_reported;        /* a state has been reported */
    bool second_guard_reported; /* another guard has been reported */
} loop_t;

/* Call before the first line or frame: from then on SIGTERM, SIGINT and SIGHUP wait until loop_run checks for them. */
void loop_hold_signals(void);

/* Runs until SIGTERM, SIGINT or SIGHUP, then sends a last StopCommand without permission and returns true. False, after
 * one line on stderr, if it cannot start or continue. */
bool loop_run(loop_t *self);

#endif
