/* subspace: the orthogonal complement of the span of a few columns, at any rank.
 *
 * A is n x k, given as k columns of n. A direction of torque whose singular value is above the tolerance is explained,
 * any other is not. subspace_reject takes the explained part out of a torque: d = tau - U_r U_r^T tau (eqs. 12 and 18,
 * with the left singular vectors where the paper says columns of V). The complement is applied as a product of
 * reflections and rotations, never as the difference of two large vectors, so d keeps its accuracy next to a
 * singularity.
 *
 * Singular value decomposition of Golub and Kahan (1965): reflections from both sides make A bidiagonal. Far from a
 * singularity this form already shows that everything is explained. Elsewhere rotations make it diagonal as far as
 * necessary (bidiagonal.h).
 *
 * n 1 to ROBOT_JOINTS, k 0 to SUBSPACE_MAX_COLUMNS; entries below 64 in size, and zero from n on. The tolerance is
 * in the unit of A. `converged` states whether the bound of bidiagonal.h sufficed.
 * With NaN or infinity in A the step terminates with converged false and rank 0: nothing counts as explained.
 */
#ifndef TAUPERP_SUBSPACE_H
#define TAUPERP_SUBSPACE_H

#include "bidiagonal.h"
#include "robot.h"

#define SUBSPACE_MAX_COLUMNS BIDIAGONAL_MAX_ROWS

typedef struct {
    num_t reflector[SUBSPACE_MAX_COLUMNS][ROBOT_MAX_JOINTS]; /* squared length 2, from their own row on */
    bidiagonal_path_t path;                                  /* of the last step */
    /* Unexplained directions in the coordinates of the reflectors: directions - rank of them. */
    num_t unexplained[SUBSPACE_MAX_COLUMNS][SUBSPACE_MAX_COLUMNS];
    bool converged;
    num_t smallest;      /* singular value; if all directions are explained, a lower bound, at most sqrt(6) too low */
    uint32_t directions; /* min(n, k) */
    uint32_t rank;       /* number of explained directions */
    uint32_t saturations;
} subspace_t;

void subspace_init(subspace_t *self);
void subspace_step(subspace_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t tolerance);

/* rejected = tau without its explained part. Both have ROBOT_JOINTS entries and may be the same array. */
void subspace_reject(subspace_t *self, const num_t tau[], num_t rejected[]);

/* A step that computes all min(n, k) singular values, unordered. For analysis of A; too slow for a tick. */
void subspace_measure(subspace_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t tolerance,
                      num_t singular[]);

#endif
