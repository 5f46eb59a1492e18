/* bidiagonal: an upper bidiagonal matrix B, as reflections from both sides make it, and the rotations that make it
 * diagonal.
 *
 * Implicit QR iteration of Golub and Kahan (1965) with Wilkinson's shift. The first sweeps have no shift, because they
 * then isolate the smallest singular values first (Demmel and Kahan 1990). The iteration stops early: 1 / |B^-1|_F is a
 * lower bound of the smallest singular value. Where this bound exceeds the tolerance, every singular value of these
 * rows does, and the rows stay bidiagonal.
 *
 * The number of sweeps is bounded; `done` states whether the bound sufficed. It did for 200,000 random matrices in
 * float, and in fixed point down to the tolerance. For all singular values it did not for 6 of 20,000 in fixed point
 * (tests/unit/test_bidiagonal.c). Precondition: finite. In fixed point the sum of the squares is below 2^16, so that no
 * number saturates; a larger matrix gives a wrong result, but nothing undefined. Cost on a Cortex-M4F, float: about 70
 * instructions per rotation and 100 per bound of the inverse.
 */
#ifndef TAUPERP_BIDIAGONAL_H
#define TAUPERP_BIDIAGONAL_H

#include "num.h"

#define BIDIAGONAL_MAX_ROWS      6u
#define BIDIAGONAL_MAX_SWEEPS    24u
#define BIDIAGONAL_MAX_ROTATIONS (BIDIAGONAL_MAX_SWEEPS * (BIDIAGONAL_MAX_ROWS - 1u))

typedef struct {
    num_t diagonal[BIDIAGONAL_MAX_ROWS];
    num_t above[BIDIAGONAL_MAX_ROWS]; /* above[i] is in row i and column i + 1; that of the last row is outside B (see
                                         below) */
    uint32_t rows;
} bidiagonal_t;

/* One rotation of the rows `first` and `first` + 1 (num_turned_first, num_turned_second). */
typedef struct {
    num_unit_t cos, sin;
    uint32_t first;
} bidiagonal_rotation_t;

/* Result of bidiagonal_diagonalise. */
typedef struct {
    bidiagonal_rotation_t rotation[BIDIAGONAL_MAX_ROTATIONS]; /* in order of application */
    uint32_t rotations;
    uint32_t sweeps;
    uint32_t open_rows; /* the first rows, not diagonal: all their singular values are above the tolerance */
    num_t
        ratio; /* tolerance / (lower bound of these singular values, at most sqrt(open_rows) too low); 0 without rows */
    bool done;
} bidiagonal_path_t;

/* For a matrix with more columns than rows, whose last row has an entry one column beyond: rotates above[rows - 1] into
 * the diagonal. These are rotations of columns and are not recorded. Otherwise above[rows - 1] must be zero. */
void bidiagonal_square(bidiagonal_t *self, uint32_t *saturations);

/* Rows from path->open_rows on become diagonal; all rows with `all`. The singular values are the absolute values on the
 * diagonal. */
void bidiagonal_diagonalise(bidiagonal_t *self, num_t tolerance, bool all, bidiagonal_path_t *path,
                            uint32_t *saturations);

/* Transforms vectors (length at most 1) from the coordinates of the final rows back to those of the original rows. */
void bidiagonal_rotate_back(const bidiagonal_path_t *path, uint32_t count, num_t vector[][BIDIAGONAL_MAX_ROWS]);

#endif
