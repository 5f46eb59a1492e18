/* soft: a projector that stays continuous where columns become linearly dependent.
 *
 *     d = (I + A A^T / s^2)^-1 tau
 *
 * Of a torque in a direction with singular value sigma, the part s^2 / (s^2 + sigma^2) stays in d. The hard projector
 * (subspace.h) has a step where sigma crosses its tolerance; this one has none. A wrench w leaks at most s |w| / 2 into
 * d, at sigma = s.
 *
 * The method is a QR decomposition of [A; s I]. Reflection j maps column j onto row j of s I. No other row fills in, so
 * only the rows of A need work. There each reflection is I - u u^T with |u|^2 < 2. d is tau after all reflections, then
 * the same reflections in reverse order. Nothing becomes larger than tau, and no system of equations is solved.
 *
 * The reflections of the first columns alone give d of these columns: the argument `first` of soft_reject.
 *
 * k is 0 to SUBSPACE_MAX_COLUMNS; entries below 64 in size. s is SOFT_MIN to 1, in the unit of A. With NaN or
 * infinity in A, d is not a number, or zero. Cost: about 460 products and 6 roots for 6 columns of 7 joints.
 */
#ifndef TAUPERP_SOFT_H
#define TAUPERP_SOFT_H

#include "subspace.h"

#define SOFT_MIN 0.004

typedef struct {
    num_t reflector[SUBSPACE_MAX_COLUMNS][ROBOT_MAX_JOINTS];
    /* R of the decomposition: [column][row]; the signs are arbitrary. */
    num_t triangle[SUBSPACE_MAX_COLUMNS][SUBSPACE_MAX_COLUMNS];
    num_t weakest[SUBSPACE_MAX_COLUMNS]; /* right singular vector of the smallest singular value */
    num_t smallest;                      /* singular value of A, an upper bound: one inverse iteration per step */
    uint32_t columns;                    /* number without trailing zero columns */
    uint32_t saturations;
} soft_t;

void soft_init(soft_t *self);
void soft_step(soft_t *self, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t s);

/* Computes rejected = d and, if `first` is above zero, first_rejected = d of the first columns alone. ROBOT_JOINTS
 * entries each, in different arrays. */
void soft_reject(soft_t *self, const num_t tau[], num_t rejected[], uint32_t first, num_t first_rejected[]);

#endif
