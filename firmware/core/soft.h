/* soft: a projector that stays continuous where columns become dependent.
 *
 *     d = (I + A A^T / s^2)^-1 tau
 *
 * A direction of torque with singular value sigma keeps s^2 / (s^2 + sigma^2) of itself. The hard projector
 * (subspace.h) has a step where sigma crosses its tolerance. This one has none. A wrench w leaks at most s |w| / 2 into
 * d, at sigma = s, and less anywhere else.
 *
 * It is a QR decomposition of [A; s I]. Reflection j sends column j onto row j of s I, so that no row fills in and the
 * rows of A alone are left to work on. Each reflection is I - u u^T there, with |u|^2 < 2. d is tau by all reflections
 * and by the same in reverse. Nothing is larger than tau, and no system is solved.
 *
 * The reflections of the first columns alone give d of these columns: soft_reject takes how many.
 *
 * k 0 to SUBSPACE_MAX_COLUMNS; entries below 64 in size. s from SOFT_MIN to 0.1, in the unit of A. With NaN or infinity
 * in A, d is not a number, or is zero. Cost: 6 columns of 7 joints about 460 products, 6 roots.
 */
#ifndef TAUPERP_SOFT_H
#define TAUPERP_SOFT_H

#include "subspace.h"

#define SOFT_MIN 0.004

typedef struct {
    num_t reflector[SUBSPACE_MAX_COLUMNS][ROBOT_MAX_JOINTS];
    num_t triangle[SUBSPACE_MAX_COLUMNS][SUBSPACE_MAX_COLUMNS]; /* R of the decomposition: column, row; up to a sign */
    num_t weakest[SUBSPACE_MAX_COLUMNS]; /* right singular vector of the smallest singular value */
    num_t smallest;                      /* singular value of A, from above: one inverse iteration a step */
    uint32_t columns;                    /* without the zero columns at the end */
    uint32_t saturations;
} soft_t;

void soft_init(soft_t *self);
void soft_step(soft_t *self, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t s);

/* rejected = d, and with `first` above zero also first_rejected = d of the first columns alone. ROBOT_JOINTS entries
 * each, in different arrays. */
void soft_reject(soft_t *self, const num_t tau[], num_t rejected[], uint32_t first, num_t first_rejected[]);

#endif
