/* permitted_fixture: a guard that permits motion, before each test of a program. */
#ifndef PERMITTED_FIXTURE_H
#define PERMITTED_FIXTURE_H

#include "guard_fixture.h"

static bench_t bench;
static guard_t *const guard = &bench.guard;

void setUp(void) {
    start(&bench);
    run_until_permitted(&bench);
}
void tearDown(void) {}

#endif
