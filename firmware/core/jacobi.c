#include "jacobi.h"

#include "square.h"

enum { ROWS = ROBOT_JOINTS, COLUMNS = SUBSPACE_MAX_COLUMNS };

#define ORTHOGONAL_BITS 16u /* a pair this close to a right angle is left alone */
#define CONVERGED_BITS  10u
/* Of a square, relative to the largest of them and of the bound: below the first a column is zero but for rounding, and
 * has no direction. Below the second rounding keeps it from CONVERGED_BITS; such a direction explains nothing. */
#define NEGLIGIBLE_BITS 42u
#define WEAK_BITS       20u

void jacobi_init(jacobi_t *self) {
    *self = (jacobi_t){0};
}

/* Multiplies A by 2^headroom (num.h), into `direction`. `bound` has that headroom, too. */
static int32_t take_columns(jacobi_t *self, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t bound) {
    num_t size = bound;
    for (uint32_t c = 0; c < k; ++c) {
        for (uint32_t i = 0; i < (uint32_t)ROWS; ++i) {
            size = num_max(size, num_abs(column[c][i]));
        }
    }
    const int32_t headroom = num_headroom(size);
    for (uint32_t c = 0; c < k; ++c) {
        for (uint32_t i = 0; i < (uint32_t)ROWS; ++i) {
            self->direction[c][i] = num_shift(column[c][i], headroom, &self->saturations);
        }
    }
    return headroom;
}

static num_wide_t inner(const num_t x[], const num_t y[]) {
    num_wide_t sum = num_widen(NUM(0));
    for (uint32_t i = 0; i < (uint32_t)ROWS; ++i) {
        sum += num_wide(x[i], y[i]);
    }
    return sum;
}

/* x' = a x + b y, y' = c x + d y. */
NUM_STEP void turn(num_unit_t a, num_unit_t b, num_unit_t c, num_unit_t d, num_t x[], num_t y[]) {
    for (uint32_t i = 0; i < (uint32_t)ROWS; ++i) {
        const num_t first = x[i];
        const num_t second = y[i];
        x[i] = num_unit_turned(a, b, first, second);
        y[i] = num_unit_turned(c, d, first, second);
    }
}

/* Makes columns p and q orthogonal. The longer one comes first: so the sweeps sort them, and fewer are enough. `swap`:
 * column q is the longer one. */
static void rotate(jacobi_t *self, square_t square[], uint32_t p, uint32_t q, num_wide_t along, bool swap) {
    num_t *const x = self->direction[p];
    num_t *const y = self->direction[q];
    square_t longer = swap ? square[q] : square[p];
    square_t shorter = swap ? square[p] : square[q];
    const num_rotation_t by = square_orthogonalise(&longer, &shorter, along);
    if (swap) {
        turn(by.sin, by.cos, by.cos, -by.sin, x, y);
    } else {
        turn(by.cos, by.sin, -by.sin, by.cos, x, y);
    }
    square[p] = longer;
    square[q] = shorter;
}

/* What a sweep found before its rotations. A swap leaves pairs that this sweep does not see. */
typedef struct {
    bool settled; /* every pair was orthogonal to CONVERGED_BITS, and none was swapped */
    bool close;   /* the same, but for directions too weak to become orthogonal */
} found_t;

/* One rotation per pair that is not orthogonal. Columns far shorter than `bound` explain nothing. */
static found_t sweep(jacobi_t *self, uint32_t k, num_t bound) {
    square_t square[COLUMNS];
    square_size_t largest = square_size(square_of(num_wide(bound, bound)));
    found_t found = {.settled = true, .close = true};
    for (uint32_t c = 0; c < k; ++c) {
        square[c] = square_of(inner(self->direction[c], self->direction[c]));
        largest = (square_size(square[c]) > largest) ? square_size(square[c]) : largest;
    }
    const square_size_t nothing = square_share(largest, NEGLIGIBLE_BITS);
    const square_size_t weak = square_share(largest, WEAK_BITS);
    for (uint32_t p = 0; p < k; ++p) {
        for (uint32_t q = p + 1u; q < k; ++q) {
            const square_size_t first = square_size(square[p]);
            const square_size_t second = square_size(square[q]);
            const square_size_t shorter = (first < second) ? first : second;
            if (shorter > nothing) {
                const num_wide_t along = inner(self->direction[p], self->direction[q]);
                if (!square_is_orthogonal(along, square[p], square[q], ORTHOGONAL_BITS)) {
                    const bool swap = square_is_longer(square[q], square[p]);
                    const bool near = !swap && square_is_orthogonal(along, square[p], square[q], CONVERGED_BITS);
                    found.settled = found.settled && near;
                    found.close = found.close && (near || (shorter <= weak));
                    rotate(self, square, p, q, along, swap);
                }
            }
        }
    }
    return found;
}

static bool made_of_numbers(const num_wide_t square[], uint32_t k) {
    bool finite = true;
    for (uint32_t c = 0; c < k; ++c) {
        /* Uncovered in fixed: 2 branches, 2 conditions. Every pattern of Q9.22 is a number. */
        finite = finite && num_wide_finite(square[c]);
    }
    return finite;
}

/* The largest first; what is beyond `directions` is zero but for rounding. */
static void sort(num_t singular[], uint32_t k) {
    for (uint32_t c = 1; c < k; ++c) {
        const num_t value = singular[c];
        uint32_t at = c;
        while ((at > 0u) && (singular[at - 1u] < value)) {
            singular[at] = singular[at - 1u];
            --at;
        }
        singular[at] = value;
    }
}

static void scale(num_t x[], num_inverse_t inverse, uint32_t *saturations) {
    for (uint32_t i = 0; i < (uint32_t)ROWS; ++i) {
        x[i] = num_times(x[i], inverse, saturations);
    }
}

/* Directions are explained above `tolerance`, of which each loses its s^2 / (sigma^2 + s^2). */
static void decompose(jacobi_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t tolerance,
                      num_t s) {
    const int32_t headroom = take_columns(self, k, column, num_max(tolerance, s));
    const num_t limit = num_shift(tolerance, headroom, &self->saturations);
    const num_t soft = num_shift(s, headroom, &self->saturations);
    num_wide_t square[COLUMNS];
    found_t found = {.settled = false, .close = false};
    self->columns = k;
    self->directions = (n < k) ? n : k;
    self->smallest = NUM(0);
    self->rank = 0;
    for (uint32_t sweeps = 0; (sweeps < JACOBI_SWEEPS) && !found.settled; ++sweeps) {
        found = sweep(self, k, num_max(limit, soft));
    }
    self->converged = found.close;
    for (uint32_t c = 0; c < k; ++c) {
        square[c] = inner(self->direction[c], self->direction[c]);
    }
    /* Uncovered in fixed, 2 lines: 2 regions, 1 branch. Every pattern of Q9.22 is a number. */
    if (!made_of_numbers(square, k)) {
        self->converged = false;
        self->columns = 0;
        return;
    }
    for (uint32_t c = 0; c < k; ++c) {
        const num_t singular = num_root(square[c]);
        const bool explained = singular > limit;
        /* Uncovered in float, 2 lines: 1 branch, 1 condition. No matrix of numbers is known that is not orthogonal
         * after JACOBI_SWEEPS sweeps. */
        /* Uncovered in fixed, 2 lines: 1 branch, 2 conditions. The same reason as in float. */
        const num_inverse_t inverse =
            (explained && self->converged) ? num_inverse_root(square[c] + num_wide(soft, soft)) : NUM_INVERSE_NONE;
        scale(self->direction[c], inverse, &self->saturations);
        self->singular[c] = num_shift(singular, -headroom, &self->saturations);
        /* Uncovered in both: 1 branch, 1 condition. The reason is the one above. */
        self->rank += (explained && self->converged && (singular > soft)) ? 1u : 0u;
    }
    sort(self->singular, k);
    self->smallest = (self->directions > 0u) ? self->singular[self->directions - 1u] : NUM(0);
}

void jacobi_hard(jacobi_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t tolerance) {
    decompose(self, n, k, column, tolerance, NUM(0));
}

void jacobi_soft(jacobi_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t s) {
    decompose(self, n, k, column, NUM(0), s);
}

void jacobi_reject(jacobi_t *self, const num_t tau[], num_t rejected[]) {
    num_t x[ROWS];
    for (uint32_t i = 0; i < (uint32_t)ROWS; ++i) {
        x[i] = tau[i];
    }
    for (uint32_t c = 0; c < self->columns; ++c) {
        const num_t along = num_narrow(inner(self->direction[c], x), &self->saturations);
        for (uint32_t i = 0; i < (uint32_t)ROWS; ++i) {
            x[i] = num_narrow(num_widen(x[i]) - num_wide(along, self->direction[c][i]), &self->saturations);
        }
    }
    for (uint32_t i = 0; i < (uint32_t)ROWS; ++i) {
        rejected[i] = x[i];
    }
}
