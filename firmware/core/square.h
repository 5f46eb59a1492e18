/* square: squared lengths of two vectors, and the rotation that makes the two orthogonal (jacobi.h).
 *
 * square_of takes an inner product of a vector with itself, below 2^18. In Q9.22 a square keeps its highest 31 bits.
 *
 * square_size is a measure that can be compared: the square itself, or its number of bits. square_share is the size of
 * 2^-bits times a square; bits below 63.
 *
 * square_is_orthogonal is true if |along|, an inner product, is at most 2^-bits times the roots of both squares; bits
 * below 31. In Q9.22 it may be false from a quarter of that on.
 *
 * square_orthogonalise returns the rotation by at most an eighth of a turn after which two vectors are orthogonal, by
 * half the angle of (difference of the squares, twice the inner product `along`); its length is 0. Both squares
 * follow it, to 2e-4 of the longer one. Precondition: the first square is not the shorter one.
 */
#ifndef TAUPERP_SQUARE_H
#define TAUPERP_SQUARE_H

#include "num.h"

#ifdef TAUPERP_FIXED
#include "square_fixed.h"
#else
#include "square_float.h"
#endif

#endif
