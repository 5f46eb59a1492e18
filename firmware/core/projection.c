#include "projection.h"

#ifdef TAUPERP_SECOND

void projection_init(projection_t *self) {
    *self = (projection_t){0};
}

void projection_hard(projection_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS],
                     num_t tolerance, const num_t tau[], num_t rejected[]) {
    jacobi_hard(&self->jacobi, n, k, column, tolerance);
    jacobi_reject(&self->jacobi, tau, rejected);
    self->smallest = self->jacobi.smallest;
    self->rank = self->jacobi.rank;
    self->converged = self->jacobi.converged;
}

void projection_soft(projection_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t s,
                     const num_t tau[], num_t rejected[], uint32_t first, num_t first_rejected[]) {
    bool converged = true;
    if (first > 0u) {
        jacobi_soft(&self->jacobi, n, first, column, s);
        jacobi_reject(&self->jacobi, tau, first_rejected);
        converged = self->jacobi.converged;
    }
    jacobi_soft(&self->jacobi, n, k, column, s);
    jacobi_reject(&self->jacobi, tau, rejected);
    self->smallest = self->jacobi.smallest;
    self->rank = self->jacobi.rank;
    self->converged = converged && self->jacobi.converged;
}

void projection_reject(projection_t *self, const num_t tau[], num_t rejected[]) {
    jacobi_reject(&self->jacobi, tau, rejected);
}

uint32_t projection_saturations(const projection_t *self) {
    return self->jacobi.saturations;
}

#else

void projection_init(projection_t *self) {
    subspace_init(&self->subspace);
    soft_init(&self->soft);
    self->smallest = NUM(0);
    self->rank = 0;
    self->soft_projector = false;
    self->converged = false;
}

void projection_hard(projection_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS],
                     num_t tolerance, const num_t tau[], num_t rejected[]) {
    self->soft_projector = false;
    subspace_step(&self->subspace, n, k, column, tolerance);
    subspace_reject(&self->subspace, tau, rejected);
    self->smallest = self->subspace.smallest;
    self->rank = self->subspace.rank;
    self->converged = self->subspace.converged;
}

void projection_soft(projection_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t s,
                     const num_t tau[], num_t rejected[], uint32_t first, num_t first_rejected[]) {
    (void)n;
    self->soft_projector = true;
    soft_step(&self->soft, k, column, s);
    soft_reject(&self->soft, tau, rejected, first, first_rejected);
    self->smallest = self->soft.smallest;
    self->rank = self->soft.columns - (((self->soft.columns > 0u) && (self->smallest <= s)) ? 1u : 0u);
    self->converged = true;
}

void projection_reject(projection_t *self, const num_t tau[], num_t rejected[]) {
    if (self->soft_projector) {
        soft_reject(&self->soft, tau, rejected, 0u, rejected);
    } else {
        subspace_reject(&self->subspace, tau, rejected);
    }
}

uint32_t projection_saturations(const projection_t *self) {
    return self->subspace.saturations + self->soft.saturations;
}

#endif
