/* subspace: the orthogonal complement of what a few columns span, safe at any rank.
 *
 * A is n x k, given as k columns of n. A direction of torque whose singular value is above the tolerance is explained,
 * any other is not. subspace_reject takes the explained part out of a torque: d = tau - U_r U_r^T tau (eqs. 12 and 18,
 * with the left singular vectors where the paper says columns of V). The complement is applied as a product of
 * reflections and rotations, never as the difference of two large vectors, so d keeps its accuracy next to a
 * singularity.
 *
 * Householder QR with column pivoting comes first. Its first rows of R explain a direction each for certain when the
 * inverse of their triangle is short: 1 / |R^-1|_F is at most the smallest singular value. Where that holds for all
 * rows, nothing is left to find out. Else one-sided Jacobi makes the rows orthogonal, but for pairs of certain rows:
 * what is left of the others is then as long as the singular values that the certain ones do not have.
 *
 * n 1 to ROBOT_MAX_JOINTS, k 0 to SUBSPACE_MAX_COLUMNS; entries below 64 in size, and zero from n on. The tolerance is
 * in the unit of A. Sweeps are bounded; `converged` tells whether the bound was enough (it is for finite input).
 * With NaN or infinity in A the step terminates with converged false and rank 0: nothing counts as explained.
 * Cost of a 7 x 6 step and reject on a Cortex-M4F, float: about 3,800 instructions, and 220 for every rotation with its
 * share of the sweeps and of the way back; the states of `make bench` take 26 rotations at most.
 */
#ifndef TAUPERP_SUBSPACE_H
#define TAUPERP_SUBSPACE_H

#include "robot.h"

#define SUBSPACE_MAX_COLUMNS 6u
#define SUBSPACE_MAX_SWEEPS  8u
#define SUBSPACE_PAIRS       ((SUBSPACE_MAX_COLUMNS * (SUBSPACE_MAX_COLUMNS - 1u)) / 2u)
#define SUBSPACE_MAX_TURNS   (SUBSPACE_MAX_SWEEPS * SUBSPACE_PAIRS)

/* One of Jacobi's rotations, of two directions. */
typedef struct {
    num_rotation_t rotation;
    uint32_t first, second;
} subspace_turn_t;

typedef struct {
    num_t reflector[SUBSPACE_MAX_COLUMNS][ROBOT_MAX_JOINTS]; /* of squared length 2; zero before their own row */
    subspace_turn_t turn[SUBSPACE_MAX_TURNS];                /* in their order */
    bool explained[SUBSPACE_MAX_COLUMNS];                    /* direction by direction, after the turns */
    bool converged;
    num_t smallest; /* singular value; where all are explained a lower bound of it, low by sqrt(6) at most for n >= k */
    uint32_t directions; /* min(n, k) */
    uint32_t rank;       /* number of explained directions */
    uint32_t sweeps;     /* of the last step, 0 where QR was enough */
    uint32_t turns;
    uint32_t saturations;
} subspace_t;

void subspace_init(subspace_t *self);
void subspace_step(subspace_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t tolerance);

/* rejected = tau without its explained part; both ROBOT_MAX_JOINTS entries, may be the same array. */
void subspace_reject(subspace_t *self, const num_t tau[], num_t rejected[]);

/* A step that works out every singular value: min(n, k) of them, in no order. For who looks at A, not for a tick. */
void subspace_measure(subspace_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t tolerance,
                      num_t singular[]);

#endif
