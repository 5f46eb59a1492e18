#define _GNU_SOURCE /* -std=c11 hides what is not ISO C */
#include "clock.h"

#include <stddef.h>

#define US_PER_S  1000000
#define NS_PER_US 1000
#define NS_PER_S  1000000000

clockid_t clock_choose(void) {
    struct timespec now;
    return (clock_gettime(CLOCK_BOOTTIME, &now) == 0) ? CLOCK_BOOTTIME : CLOCK_MONOTONIC;
}

uint64_t clock_monotonic_us(void) {
    struct timespec now;
    /* CLOCK_MONOTONIC stops while the machine sleeps, which would hide the age of the inputs. */
    if (clock_gettime(CLOCK_BOOTTIME, &now) != 0) {
        (void)clock_gettime(CLOCK_MONOTONIC, &now);
    }
    return ((uint64_t)now.tv_sec * (uint64_t)US_PER_S) + ((uint64_t)now.tv_nsec / (uint64_t)NS_PER_US);
}

clock_pair_t clock_read_pair(void) {
    /* Monotonic first: the time between the two readings can only make a frame look older, never younger. */
    const uint64_t monotonic_us = clock_monotonic_us();
    struct timespec realtime;
    (void)clock_gettime(CLOCK_REALTIME, &realtime);
    return (clock_pair_t){monotonic_us, ((int64_t)realtime.tv_sec * NS_PER_S) + realtime.tv_nsec};
}

uint64_t clock_now(guard_clock_t *self, uint64_t monotonic_us) {
    if (monotonic_us > self->latest_us) {
        self->latest_us = monotonic_us;
    }
    return self->latest_us;
}

uint64_t clock_of_frame(guard_clock_t *self, clock_pair_t now, const struct timespec *stamp) {
    uint64_t time_us = now.monotonic_us;
    if (stamp != NULL) {
        const int64_t age_ns = now.realtime_ns - (((int64_t)stamp->tv_sec * NS_PER_S) + stamp->tv_nsec);
        const uint64_t age_us = (age_ns > 0) ? ((uint64_t)age_ns / (uint64_t)NS_PER_US) : 0u;
        time_us = (age_us < time_us) ? (time_us - age_us) : 0u;
    }
    return clock_now(self, time_us);
}
