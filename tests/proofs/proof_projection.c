/* firmware/core/projection.c of the first channel. The projectors are stubs: proof_subspace.c, proof_soft.c. */
#include "projection.c"
#include "stub_object.h"

void subspace_init(subspace_t *self) {
    stub_object(self, sizeof(*self));
}

void subspace_step(subspace_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t tolerance) {
    stub_object(self, sizeof(*self));
    stub_columns(k, column);
}

void subspace_reject(subspace_t *self, const num_t tau[], num_t rejected[]) {
    stub_object(self, sizeof(*self));
    stub_torques(tau, rejected);
}

void soft_init(soft_t *self) {
    stub_object(self, sizeof(*self));
}

void soft_step(soft_t *self, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t s) {
    stub_object(self, sizeof(*self));
    stub_columns(k, column);
    HOLDS((s >= NUM(SOFT_MIN)) && (s <= NUM(1)), "a softness");
}

void soft_reject(soft_t *self, const num_t tau[], num_t rejected[], uint32_t first, num_t first_rejected[]) {
    stub_object(self, sizeof(*self));
    stub_torques(tau, rejected);
    stub_torques(tau, first_rejected);
}

#include "project_any.h"

void proof_projection(void) {
    project_any();
    REACHED;
}
