/* clock: the one clock of the process in microseconds, and the time of reception of each frame on it. It is
 * CLOCK_BOOTTIME, which continues while the machine sleeps: a guard that slept through its deadlines wakes up in FAULT
 * (TICK_LATE). Kernels without it (before 2.6.39, or 3.15 for timers) use CLOCK_MONOTONIC.
 *
 * The kernel stamps a frame by CLOCK_REALTIME, which an operator or NTP may set at any time. So only the frame's age
 * is taken from it, at reception: age = realtime now - stamp, and the frame came in at monotonic now - age. A step of
 * the real-time clock between the stamp and the reading makes that age wrong, so the result is clamped to the range
 * from the latest returned time to now: time never goes backwards, no frame comes from the future, and a frame of
 * unknown age counts as received when it was read.
 */
#ifndef TAUPERP_LINUX_CLOCK_H
#define TAUPERP_LINUX_CLOCK_H

#include <stdint.h>
#include <time.h>

typedef struct {
    uint64_t latest_us; /* returned: no later call gives an earlier time */
} guard_clock_t;

/* Both clocks, read in direct succession. */
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
