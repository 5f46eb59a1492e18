/* config_parts: the parts of the bounds check. For the files of this folder only. */
#ifndef TAUPERP_CONFIG_PARTS_H
#define TAUPERP_CONFIG_PARTS_H

#include "config_bounds.h"

static inline bool lies_within(uint32_t value, uint32_t least, uint32_t most) {
    return (value >= least) && (value <= most);
}

static inline bool is_near(num_t a, num_t b, num_t tolerance) {
    uint32_t held = 0; /* a difference at the end of the range is not near */
    return num_abs(num_subtract(a, b, &held)) <= tolerance;
}

/* True if positive, a number, and at most `most`. */
static inline bool is_up_to(num_t value, num_t most) {
    return (value > NUM(0)) && (value <= most);
}

/* The same, or zero. */
static inline bool is_zero_up_to(num_t value, num_t most) {
    return (value >= NUM(0)) && (value <= most);
}

/* config_filters.c: the bank's channels and the regressor's low-pass have gain 1 and respond to a step in time. */
bool bank_is_valid(const guard_config_t *config);
bool regressor_is_valid(const guard_config_t *config);

/* config_tasks.c: every configured task is valid, and there is at least one. */
guard_status_t check_tasks(const guard_config_t *config);

#endif
