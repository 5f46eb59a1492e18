/* bidiagonal: what is left of a matrix when reflections from both sides have cleared all but its diagonal and the
 * entries right of it; and the rotations that make it diagonal.
 *
 * The implicit QR iteration of Golub and Kahan (1965), with Wilkinson's shift but for the first sweeps (Demmel and
 * Kahan 1990: without a shift the smallest singular values come out by themselves, and first). It goes no further than
 * it must. Where B^-1 is short, 1 / |B^-1|_F being at most B's smallest singular value, all singular values are above
 * the tolerance, and which row belongs to which does not matter: those rows stay as they are.
 *
 * Sweeps are bounded; `done` tells whether the bound was enough. It was for all of 200,000 random matrices in float,
 * and in fixed point as far as the tolerance asks; where all singular values are asked for, 6 of 20,000 in fixed point
 * want more (tests/unit/test_bidiagonal.c). Entries below 128 in size. NaN and infinity are the caller's. Cost on a
 * Cortex-M4F, float: about 70 instructions for every turn, 100 for every look at the inverse.
 */
#ifndef TAUPERP_BIDIAGONAL_H
#define TAUPERP_BIDIAGONAL_H

#include "num.h"

#define BIDIAGONAL_MAX_ROWS   6u
#define BIDIAGONAL_MAX_SWEEPS 24u
#define BIDIAGONAL_MAX_TURNS  (BIDIAGONAL_MAX_SWEEPS * (BIDIAGONAL_MAX_ROWS - 1u))

typedef struct {
    num_t diagonal[BIDIAGONAL_MAX_ROWS];
    num_t above[BIDIAGONAL_MAX_ROWS]; /* above[i] is in row i and column i + 1; the last row's is not B's (see below) */
    uint32_t rows;
} bidiagonal_t;

/* One rotation of a row and the next (num_turned_first, num_turned_second). */
typedef struct {
    num_unit_t cos, sin;
    uint32_t first;
} bidiagonal_turn_t;

/* What bidiagonal_diagonalise did. */
typedef struct {
    bidiagonal_turn_t turn[BIDIAGONAL_MAX_TURNS]; /* in their order */
    uint32_t turns;
    uint32_t sweeps;
    uint32_t left; /* so many of the first rows are not diagonal, and have only singular values above the tolerance */
    num_t share;   /* tolerance / (lower bound of these singular values, low by sqrt(left) at most); 0 without rows */
    bool done;
} bidiagonal_path_t;

/* Of a matrix with more columns than rows, the last row goes on one column beyond: turns above[rows - 1] into the
 * diagonal, by rotations of columns, which have no part in the path. Otherwise above[rows - 1] is to be zero. */
void bidiagonal_square(bidiagonal_t *self, uint32_t *saturations);

/* Rows from path->left on become diagonal; all of them with `all`. Singular values are the sizes on the diagonal. */
void bidiagonal_diagonalise(bidiagonal_t *self, num_t tolerance, bool all, bidiagonal_path_t *path,
                            uint32_t *saturations);

/* Vectors by what B's rows became, each at most of length 1: turned back into vectors by what they were. */
void bidiagonal_turn_back(const bidiagonal_path_t *path, uint32_t count, num_t vector[][BIDIAGONAL_MAX_ROWS]);

#endif
