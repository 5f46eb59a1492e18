/* config_fixture: a block that is changed in one place, and the guard's answer to it. */
#ifndef CONFIG_FIXTURE_H
#define CONFIG_FIXTURE_H

#include "config_bounds.h"
#include "guard_fixture.h"

static guard_config_t config;

/* Checks the block as it is changed, then restores it. */
static inline void assert_status(guard_status_t expected) {
    guard_t guard;
    seal_config(&config);
    TEST_ASSERT_EQUAL(expected, config_check(&config));
    TEST_ASSERT_EQUAL(expected, guard_init(&guard, &config));
    TEST_ASSERT_EQUAL((expected == GUARD_OK) ? GUARD_STATE_SELF_TEST : GUARD_STATE_UNINITIALISED, guard.state);
    config = make_config();
}

#endif
