/* unit_stub: vec3_unit as a stub (proofs.toml). No entry is larger than 1 plus a rounding: enumerate_newton.c. */
#ifndef TAUPERP_UNIT_STUB_H
#define TAUPERP_UNIT_STUB_H

#include "num_sizes.h"
#include "robot.h"

vec3_t stub_unit(vec3_t v, uint32_t *saturations) {
    (void)v;
    *saturations += 0u;
    return (vec3_t){.x = stub_within(NUM(1) + 1), .y = stub_within(NUM(1) + 1), .z = stub_within(NUM(1) + 1)};
}

#endif
