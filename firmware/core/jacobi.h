/* jacobi: singular value decomposition by one-sided Jacobi rotations (Hestenes 1958), and both projectors made of it.
 *
 * The second channel's own algorithm: it shares no code with subspace.h and soft.h, so that a mistake in either shows
 * as a difference of the two channels.
 *
 * Rotations of two columns of A make them orthogonal, pair by pair, in at most JACOBI_SWEEPS sweeps over all pairs. A
 * pair that is orthogonal to 2^-16 is left as it is. A sweep is the last one if it found every pair orthogonal to
 * 2^-10, because its rotations square that. Then A V = U diag(sigma): the columns' lengths are the singular values,
 * their directions the left singular vectors. With v_i = sigma_i u_i / sqrt(sigma_i^2 + s^2) d = tau - sum v_i (v_i .
 * tau) is the soft projector (soft.h). With s = 0, over the directions above the tolerance alone, it is the hard one
 * (subspace.h), by the same rule of rank.
 *
 * n 1 to ROBOT_JOINTS, k 0 to SUBSPACE_MAX_COLUMNS; entries below 64 in size, and zero from n on. With NaN or infinity
 * in A `converged` is false and the rank 0: nothing counts as explained. Cost: JACOBI_SWEEPS k (k - 1) / 2 rotations at
 * most.
 */
#ifndef TAUPERP_JACOBI_H
#define TAUPERP_JACOBI_H

#include "subspace.h"

#define JACOBI_SWEEPS 6u

typedef struct {
    num_t direction[SUBSPACE_MAX_COLUMNS][ROBOT_MAX_JOINTS]; /* v_i; zero where nothing is explained */
    num_t singular[SUBSPACE_MAX_COLUMNS];                    /* of the first `directions`, the largest first */
    num_t smallest;                                          /* of them; 0 without columns */
    uint32_t columns;
    uint32_t directions; /* min(n, k) */
    uint32_t rank;       /* hard: directions above the tolerance; soft: singular values above s */
    bool converged;      /* the last sweep found every pair orthogonal to 2^-10, but for directions too weak for that */
    uint32_t saturations;
} jacobi_t;

void jacobi_init(jacobi_t *self);
void jacobi_hard(jacobi_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t tolerance);
void jacobi_soft(jacobi_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t s);

/* rejected = d of the last step; both ROBOT_JOINTS entries, may be the same array. */
void jacobi_reject(jacobi_t *self, const num_t tau[], num_t rejected[]);

#endif
