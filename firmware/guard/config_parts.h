/* config_parts: how the check of the bounds is divided. For the files of this folder only. */
#ifndef TAUPERP_CONFIG_PARTS_H
#define TAUPERP_CONFIG_PARTS_H

#include "config_bounds.h"

static inline bool lies_within(uint32_t value, uint32_t least, uint32_t most) {
    return (value >= least) && (value <= most);
}

static inline bool is_near(num_t a, num_t b, num_t tolerance) {
    return num_abs(a - b) <= tolerance;
}

/* Positive, a number, and at most `most`. */
static inline bool is_up_to(num_t value, num_t most) {
    return (value > NUM(0)) && (value <= most);
}

/* The same, or zero. */
static inline bool is_zero_up_to(num_t value, num_t most) {
    return (value >= NUM(0)) && (value <= most);
}

/* config_filters.c: the bank's channels and the regressor's low-pass are filters of gain 1 that see a step in time. */
bool bank_is_valid(const guard_config_t *config);
bool regressor_is_valid(const guard_config_t *config);

/* config_tasks.c: every task that is configured, and that one is. */
guard_status_t check_tasks(const guard_config_t *config);

#endif
