/* firmware/core/projection.c of the second channel. The projector is a stub: proof_jacobi.c. */
#define TAUPERP_SECOND 1

#include "projection.c"
#include "stub_object.h"

void jacobi_init(jacobi_t *self) {
    stub_object(self, sizeof(*self));
}

void jacobi_hard(jacobi_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t tolerance) {
    stub_object(self, sizeof(*self));
    stub_columns(k, column);
}

void jacobi_soft(jacobi_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t s) {
    stub_object(self, sizeof(*self));
    stub_columns(k, column);
    HOLDS((s >= NUM(SOFT_MIN)) && (s <= NUM(1)), "the softness is in its range");
}

void jacobi_reject(jacobi_t *self, const num_t tau[], num_t rejected[]) {
    stub_object(self, sizeof(*self));
    stub_torques(tau, rejected);
}

#include "project_any.h"

void proof_projection_second(void) {
    project_any();
    REACHED;
}
