/* stub_object: what a stub of a stage does with its objects: they are there, and it leaves anything behind. */
#ifndef TAUPERP_STUB_OBJECT_H
#define TAUPERP_STUB_OBJECT_H

#include "num.h"
#include "proof.h"
#include "robot.h"

static inline void stub_object(void *object, uint32_t size) {
    HOLDS(__CPROVER_w_ok(object, size), "the object is there");
    __CPROVER_havoc_slice(object, size);
}

static inline void stub_columns(uint32_t k, const num_t column[][ROBOT_MAX_JOINTS]) {
    HOLDS(k <= 6u, "no more columns than a projector takes");
    HOLDS(__CPROVER_r_ok(column, k * sizeof(column[0])), "the columns are there");
}

static inline void stub_torques(const num_t tau[], num_t rejected[]) {
    HOLDS(__CPROVER_r_ok(tau, ROBOT_MAX_JOINTS * sizeof(*tau)), "the torque is there");
    stub_object(rejected, ROBOT_MAX_JOINTS * sizeof(*rejected));
}

#endif
