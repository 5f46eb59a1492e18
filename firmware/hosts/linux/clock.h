/* clock: the only clock of the process, in microseconds, and the time of reception of each frame on it. It is
 * CLOCK_BOOTTIME, which continues while the machine sleeps. A guard that slept past its deadlines wakes up in FAULT
 * (TICK_LATE). Kernels without it (before 2.6.39, or 3.15 for timers) use CLOCK_MONOTONIC.
 *
 * The kernel stamps a frame by CLOCK_REALTIME, which an operator or NTP may set at any time. Only the frame's age at
 * reception is therefore used: age = realtime now - stamp, and time of reception = monotonic now - age. A step of the
 * real-time clock between the stamp and the reading makes that age wrong. The result is therefore clamped to the range
 * from the latest returned time to now. Time never goes backwards, no frame comes from the future, and a frame of
 * unknown age counts as received when it was read.
 */
#ifndef TAUPERP_LINUX_CLOCK_H
#define TAUPERP_LINUX_CLOCK_H

#include <stdint.h>
#include <time.h>

typedef struct {
    uint64_t latest_us; /* latest returned time; no later call returns an earlier one */
} guard_clock_t;

/* Both clocks, read in direct succession. */
typedef struct {
    uint64_t monotonic_us;
    int64_t realtime_ns;
} clock_pair_t;

clockid_t clock_choose(void); /* for the timer */
uint64_t clock_monotonic_us(void);
clock_pair_t clock_read_pair(void);

/* The time for a tick: now, but not before the latest returned time. */
uint64_t clock_now(guard_clock_t *self, uint64_t monotonic_us);

/* The time for a frame that the kernel stamped with `stamp` (NULL: not stamped) and that was read at `now`. */
uint64_t clock_of_frame(guard_clock_t *self, clock_pair_t now, const struct timespec *stamp);

#endif
