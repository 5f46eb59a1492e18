#include "jacobi.h"

enum { ROWS = ROBOT_JOINTS, COLUMNS = SUBSPACE_MAX_COLUMNS };

#define ORTHOGONAL_BITS 21u /* a pair this close to a right angle is left alone */
#define CONVERGED_BITS  10u
/* Of a square, relative to the largest: below the first a column is zero but for rounding, and has no direction. Below
 * the second rounding keeps it from CONVERGED_BITS; such a direction is below every tolerance. */
#define NEGLIGIBLE_BITS 42u
#define WEAK_BITS       20u

void jacobi_init(jacobi_t *self) {
    *self = (jacobi_t){0};
}

/* Multiplies A by 2^headroom (num.h), into `direction`. */
static int32_t take_columns(jacobi_t *self, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS]) {
    num_t size = NUM(0);
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

/* The longer column comes first: so the sweeps sort them, and fewer are enough. */
static void rotate(num_rotation_t by, bool in_order, num_t x[], num_t y[]) {
    for (uint32_t i = 0; i < (uint32_t)ROWS; ++i) {
        const num_t first = num_unit_turned(by.cos, by.sin, x[i], y[i]);
        const num_t second = num_unit_turned(by.cos, -by.sin, y[i], x[i]);
        x[i] = in_order ? first : second;
        y[i] = in_order ? second : first;
    }
}

static num_wide_t largest_square(const jacobi_t *self, uint32_t k) {
    num_wide_t largest = num_widen(NUM(0));
    for (uint32_t c = 0; c < k; ++c) {
        const num_wide_t square = inner(self->direction[c], self->direction[c]);
        largest = (square > largest) ? square : largest;
    }
    return largest;
}

/* True if every pair was orthogonal to CONVERGED_BITS before its rotation. */
static bool sweep(jacobi_t *self, uint32_t k, num_wide_t largest) {
    const num_wide_t nothing = num_wide_share(largest, NEGLIGIBLE_BITS);
    const num_wide_t weak = num_wide_share(largest, WEAK_BITS);
    bool close = true;
    for (uint32_t p = 0; p < k; ++p) {
        for (uint32_t q = p + 1u; q < k; ++q) {
            num_t *const x = self->direction[p];
            num_t *const y = self->direction[q];
            const num_wide_t first = inner(x, x);
            const num_wide_t second = inner(y, y);
            const num_wide_t along = inner(x, y);
            const num_wide_t shorter = (first < second) ? first : second;
            if ((shorter > nothing) && !num_is_orthogonal(along, first, second, ORTHOGONAL_BITS)) {
                close = close && ((shorter <= weak) || num_is_orthogonal(along, first, second, CONVERGED_BITS));
                rotate(num_symmetric_rotation(first, second, along), first >= second, x, y);
            }
        }
    }
    return close;
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
    uint32_t held = 0; /* saturations at values above any singular value: ignored */
    const int32_t headroom = take_columns(self, k, column);
    const num_t limit = num_shift(tolerance, headroom, &held);
    const num_t soft = num_shift(s, headroom, &held);
    const num_wide_t largest = largest_square(self, k);
    num_wide_t square[COLUMNS];
    self->columns = k;
    self->directions = (n < k) ? n : k;
    self->converged = true;
    self->smallest = NUM(0);
    self->rank = 0;
    for (uint32_t turn = 0; turn < JACOBI_SWEEPS; ++turn) {
        self->converged = sweep(self, k, largest);
    }
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
