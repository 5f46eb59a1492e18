/* subspace: the orthogonal complement of what a few columns span, safe at any rank.
 *
 * A is n x k, given as k columns of n. Householder QR, then one-sided Jacobi on the rows of R, gives the singular
 * values; a direction whose singular value is above the tolerance is explained, any other is not. subspace_reject
 * then takes the explained part out of a torque: d = tau - U_r U_r^T tau (eqs. 12 and 18, with the left singular
 * vectors where the paper says columns of V). The complement is applied as a product of reflections, never as the
 * difference of two large vectors, so d keeps its accuracy next to a singularity.
 *
 * n 1 to ROBOT_MAX_JOINTS, k 0 to SUBSPACE_MAX_COLUMNS; entries below 64 in size. The tolerance is in the unit of A.
 * Sweeps are bounded; `converged` tells whether the bound was enough (it is for finite input: measured 7 at most).
 * With NaN or infinity in A the step terminates with converged false and rank 0: nothing counts as explained.
 */
#ifndef TAUPERP_SUBSPACE_H
#define TAUPERP_SUBSPACE_H

#include "robot.h"

#define SUBSPACE_MAX_COLUMNS 6u
#define SUBSPACE_MAX_SWEEPS  8u
#define SUBSPACE_PAIRS       ((SUBSPACE_MAX_COLUMNS * (SUBSPACE_MAX_COLUMNS - 1u)) / 2u)

typedef struct {
    num_t reflector[SUBSPACE_MAX_COLUMNS][ROBOT_MAX_JOINTS];  /* of squared length 2; zero before their own row */
    num_rotation_t turn[SUBSPACE_MAX_SWEEPS][SUBSPACE_PAIRS]; /* Jacobi's rotations, in their order */
    num_t singular[SUBSPACE_MAX_COLUMNS];                     /* min(n, k) values, in no order */
    bool explained[SUBSPACE_MAX_COLUMNS];                     /* singular value above the tolerance */
    bool converged;
    uint32_t rows;       /* n */
    uint32_t directions; /* min(n, k) */
    uint32_t rank;       /* number of explained directions */
    uint32_t sweeps;     /* used by the last step */
    uint32_t saturations;
} subspace_t;

void subspace_init(subspace_t *self);
void subspace_step(subspace_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t tolerance);

/* rejected = tau without its explained part; both n entries, may be the same array. */
void subspace_reject(subspace_t *self, const num_t tau[], num_t rejected[]);

/* The smallest of the singular values, 0 without columns. */
num_t subspace_smallest(const subspace_t *self);

#endif
