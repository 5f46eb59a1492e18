/* clock: the one clock of the process in microseconds, and when a frame came in on it. It is CLOCK_BOOTTIME, which goes
 * on while the machine sleeps: a guard that slept through its deadlines wakes up in FAULT (TICK_LATE). On a kernel
 * without it (before 2.6.39, or 3.15 for timers) it is CLOCK_MONOTONIC.
 *
 * The kernel stamps a frame by CLOCK_REALTIME, which an operator or NTP may set at any moment. So only the frame's age
 * is taken from it, at reception: age = realtime now - stamp, and the frame came in at monotonic now - age. A step of
 * the real-time clock between the stamp and the reading makes that age wrong, so the result is held between the latest
 * time handed out before and now: time never goes backwards, no frame comes from the future, and one whose age is
 * unknown counts as come in when it was read.
 */
#ifndef TAUPERP_LINUX_CLOCK_H
#define TAUPERP_LINUX_CLOCK_H

#include <stdint.h>
#include <time.h>

typedef struct {
    uint64_t latest_us; /* handed out: no later call gives an earlier time */
} guard_clock_t;

/* Both clocks, read one right after the other. */
typedef struct {
    uint64_t monotonic_us;
    int64_t realtime_ns;
} clock_pair_t;

clockid_t clock_choose(void); /* for the timer */
uint64_t clock_monotonic_us(void);
clock_pair_t clock_read_pair(void);

/* The time for a tick: now, at least the latest. */
uint64_t clock_now(guard_clock_t *self, uint64_t monotonic_us);

/* The time for a frame that the kernel stamped with `stamp` (NULL: not stamped) and that was read at `now`. */
uint64_t clock_of_frame(guard_clock_t *self, clock_pair_t now, const struct timespec *stamp);

#endif
