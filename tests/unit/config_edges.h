/* config_edges: a configuration block with one value at its bound, and one with a value beyond it. The bounds are those
 * of config_bounds.h, which the tests write out as numbers. */
#ifndef CONFIG_EDGES_H
#define CONFIG_EDGES_H

#include "config_bounds.h"
#include "guard_fixture.h"

#ifdef TAUPERP_FIXED
#define STEP_UP(x)   ((x) + 1)
#define STEP_DOWN(x) ((x) - 1)
#else
#define STEP_UP(x)   ((x) * (1.0f + 2.4e-7f))
#define STEP_DOWN(x) ((x) * (1.0f - 1.2e-7f))
#endif

static guard_config_t config;

/* Judges the block as it is changed, then restores it. */
static inline guard_status_t judged(void) {
    const guard_status_t status = config_bounds_check(&config);
    config = make_config();
    return status;
}

/* A value beyond a bound is refused for it. The last one before it is not; it may violate another bound. */
#define ASSERT_BOUND(place, inside, outside, refusal)                                                                  \
    do {                                                                                                               \
        config.place = (inside);                                                                                       \
        TEST_ASSERT_NOT_EQUAL(refusal, judged());                                                                      \
        config.place = (outside);                                                                                      \
        TEST_ASSERT_EQUAL(refusal, judged());                                                                          \
    } while (false)

/* The same where the block is accepted with the last value. */
#define ASSERT_LIMIT(place, inside, outside, refusal)                                                                  \
    do {                                                                                                               \
        config.place = (inside);                                                                                       \
        TEST_ASSERT_EQUAL(GUARD_OK, judged());                                                                         \
        config.place = (outside);                                                                                      \
        TEST_ASSERT_EQUAL(refusal, judged());                                                                          \
    } while (false)

/* Every time as short as this period permits. */
static inline void make_timing(uint32_t period_us) {
    config.period_us = period_us;
    config.sync_deadline_us = period_us;
    config.joint_deadline_us = period_us;
    config.task_deadline_us = period_us;
    config.tick_deadline_us = period_us;
    config.tick_budget_us = 1u;
    config.settling_us = period_us;
    config.reset_healthy_us = period_us;
    config.task_dwell_cycles = 250000u / period_us;
}

/* Constants of the gain K, with K T = rate, as `tauperp config` computes them. */
static inline void make_observer(const double decay[CONFIG_MAX_GAP]) {
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) {
        const double gain = 1.0 - decay[g];
        config.observer.decay[g] = (num_t)NUM(decay[g]);
        config.observer.gain[g] = NUM(1) - config.observer.decay[g];
        config.observer.momentum_gain[g] = (num_t)NUM(gain * 1000.0 / (g + 1.0));
        config.bank.channel[0].own[g] = config.observer.decay[g];
    }
}

#endif
