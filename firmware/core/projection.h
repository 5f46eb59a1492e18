/* projection: the hard and the soft projector, by the algorithm of this channel.
 *
 * The first channel, and the only one of a guard with one channel, takes the bidiagonal form (subspace.h) and the
 * reflections of [A; s I] (soft.h). The second channel takes one-sided Jacobi rotations (jacobi.h) for both, so that
 * the two share no mistake. TAUPERP_SECOND selects it when the firmware is compiled.
 *
 * n, k, columns, tolerance and s as of these headers. `first`: how many columns, from the first on, explain
 * `first_rejected` alone; 0: none, and it stays as it is.
 */
#ifndef TAUPERP_PROJECTION_H
#define TAUPERP_PROJECTION_H

#include "jacobi.h"
#include "soft.h"
#include "subspace.h"

typedef struct {
#ifdef TAUPERP_SECOND
    jacobi_t jacobi;
#else
    subspace_t subspace;
    soft_t soft;
    bool soft_projector; /* of the last step */
#endif
    num_t smallest; /* singular value of A, or a bound below it (subspace.h); 0 without columns */
    uint32_t rank;  /* directions that are explained; soft: columns, less one near a singularity */
    bool converged;
} projection_t;

void projection_init(projection_t *self);
void projection_hard(projection_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS],
                     num_t tolerance, const num_t tau[], num_t rejected[]);
void projection_soft(projection_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t s,
                     const num_t tau[], num_t rejected[], uint32_t first, num_t first_rejected[]);

/* rejected <- the unexplained part of any torque, with the columns of the last step. */
void projection_reject(projection_t *self, const num_t tau[], num_t rejected[]);
uint32_t projection_saturations(const projection_t *self);

#endif
