#include "subspace.h"

#include "reflector.h"

#define ROWS    REFLECTOR_ROWS
#define COLUMNS SUBSPACE_MAX_COLUMNS

/* A during the bidiagonalisation. Step `at` clears column `at` below the diagonal, then row `at` beyond the next entry.
 * The code is specialised for each constant `at` (NUM_STEP). Loops run to the full length, over zeros. All entries are
 * multiplied by 2^headroom (num.h). */
typedef struct {
    num_t column[COLUMNS][ROBOT_MAX_JOINTS];
    bidiagonal_t bidiagonal;
    int32_t headroom;
} work_t;

/* If everything is explained but a singular value is below this (unit of A), QR computes the reflectors again, without
 * the rounding of the reflections from the right. In float the mean error of such a direction is up to 30 percent less;
 * in Q9.22 it is the same. */
static const num_t weak = NUM(0.01);

void subspace_init(subspace_t *self) {
    *self = (subspace_t){0};
}

/* Clears row `at` beyond its next entry by a reflection from the right, which leaves directions of torque unchanged. */
NUM_STEP void clear_row(work_t *work, uint32_t k, const uint32_t at, uint32_t *saturations) {
    num_t v[COLUMNS];
    num_wide_t along[ROWS];
    num_t scale[ROWS];
    for (uint32_t c = at + 1u; c < k; ++c) {
        v[c] = work->column[c][at];
    }
    work->bidiagonal.above[at] = reflector_make(v, at + 1u, k, saturations);
    for (uint32_t i = at + 1u; i < ROWS; ++i) {
        along[i] = num_wide(v[at + 1u], work->column[at + 1u][i]);
    }
    for (uint32_t c = at + 2u; c < k; ++c) {
        for (uint32_t i = at + 1u; i < ROWS; ++i) {
            along[i] += num_wide(v[c], work->column[c][i]);
        }
    }
    for (uint32_t i = at + 1u; i < ROWS; ++i) {
        scale[i] = num_narrow(along[i], saturations);
    }
    for (uint32_t c = at + 1u; c < k; ++c) {
        num_t *const x = work->column[c];
        const num_t weight = v[c];
        for (uint32_t i = at + 1u; i < ROWS; ++i) {
            x[i] = num_narrow(num_widen(x[i]) - num_wide(scale[i], weight), saturations);
        }
    }
}

/* Step `at`, if A has as many directions. Reads the columns from `from`. */
NUM_STEP void clear_column_and_row(subspace_t *self, work_t *work, uint32_t k, const num_t from[][ROBOT_MAX_JOINTS],
                                   const uint32_t at) {
    if (at >= self->directions) {
        return;
    }
    bidiagonal_t *const b = &work->bidiagonal;
    num_t u[ROWS];
    for (uint32_t i = at; i < ROWS; ++i) {
        u[i] = from[at][i];
    }
    b->diagonal[at] = reflector_make(u, at, ROWS, &self->saturations);
    for (uint32_t i = at; i < ROWS; ++i) {
        self->reflector[at][i] = u[i];
    }
    for (uint32_t c = at + 1u; c < k; ++c) {
        reflector_apply(u, from[c], work->column[c], at, &self->saturations);
    }
    if ((at + 2u) < k) {
        clear_row(work, k, at, &self->saturations);
    } else {
        b->above[at] = ((at + 1u) < k) ? work->column[at + 1u][at] : NUM(0);
    }
}

/* The columns multiplied by 2^headroom; unchanged if headroom is 0, as always in float. */
static const num_t (*scaled_columns(subspace_t *self, work_t *work, uint32_t k,
                                    const num_t column[][ROBOT_MAX_JOINTS]))[ROBOT_MAX_JOINTS] {
    num_t size = NUM(0);
    for (uint32_t c = 0; c < k; ++c) {
        for (uint32_t i = 0; i < ROWS; ++i) {
            size = num_max(size, num_abs(column[c][i]));
        }
    }
    work->headroom = num_headroom(size);
    /* Uncovered in float, 5 lines: 7 regions, 5 branches. The headroom of a float is 0. */
    if (work->headroom == 0) {
        return column;
    }
    for (uint32_t c = 0; c < k; ++c) {
        for (uint32_t i = 0; i < ROWS; ++i) {
            work->column[c][i] = num_shift(column[c][i], work->headroom, &self->saturations);
        }
    }
    return (const num_t(*)[ROBOT_MAX_JOINTS])work->column;
}

/* A NaN in A reaches every row of B. */
static bool made_of_numbers(const bidiagonal_t *b) {
    bool finite = true;
    for (uint32_t i = 0; i < b->rows; ++i) {
        /* Uncovered in fixed: 2 branches, 2 conditions. Every pattern of Q9.22 is a number. */
        finite = finite && num_finite(b->diagonal[i]);
    }
    return finite;
}

NUM_STEP void reflect_by(subspace_t *self, uint32_t count, num_t x[], const uint32_t at) {
    if (at < count) {
        reflector_apply(self->reflector[at], x, x, at, &self->saturations);
    }
}

/* x in the coordinates of the first `count` reflectors. */
static __attribute__((noinline)) void into_directions(subspace_t *self, uint32_t count, num_t x[]) {
    reflect_by(self, count, x, 0);
    reflect_by(self, count, x, 1);
    reflect_by(self, count, x, 2);
    reflect_by(self, count, x, 3);
    reflect_by(self, count, x, 4);
    reflect_by(self, count, x, 5);
}

static void out_of_directions(subspace_t *self, uint32_t count, num_t x[]) {
    reflect_by(self, count, x, 5);
    reflect_by(self, count, x, 4);
    reflect_by(self, count, x, 3);
    reflect_by(self, count, x, 2);
    reflect_by(self, count, x, 1);
    reflect_by(self, count, x, 0);
}

/* The reflectors of QR, column by column. Precondition: no more columns than rows. */
static void factor(subspace_t *self, const num_t column[][ROBOT_MAX_JOINTS], int32_t headroom) {
    for (uint32_t at = 0; at < self->directions; ++at) {
        num_t *const u = self->reflector[at];
        for (uint32_t i = 0; i < ROWS; ++i) {
            u[i] = num_shift(column[at][i], headroom, &self->saturations);
        }
        into_directions(self, at, u);
        (void)reflector_make(u, at, ROWS, &self->saturations);
    }
}

static void decompose(subspace_t *self, work_t *work, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS],
                      num_t tolerance, bool all) {
    bidiagonal_t *const b = &work->bidiagonal;
    self->directions = (n < k) ? n : k;
    self->converged = false;
    self->smallest = NUM(0);
    self->rank = 0;
    b->rows = self->directions;
    const num_t(*const from)[ROBOT_MAX_JOINTS] = scaled_columns(self, work, k, column);
    clear_column_and_row(self, work, k, from, 0);
    const num_t(*const reduced)[ROBOT_MAX_JOINTS] = (const num_t(*)[ROBOT_MAX_JOINTS])work->column;
    clear_column_and_row(self, work, k, reduced, 1);
    clear_column_and_row(self, work, k, reduced, 2);
    clear_column_and_row(self, work, k, reduced, 3);
    clear_column_and_row(self, work, k, reduced, 4);
    clear_column_and_row(self, work, k, reduced, 5);
    if (n < k) {
        bidiagonal_square(b, &self->saturations);
    }
    /* Uncovered in fixed: 1 region, 1 branch. Every pattern of Q9.22 is a number. */
    if (!made_of_numbers(b)) {
        return;
    }
    uint32_t ignored = 0; /* saturations above any singular value */
    const num_t limit = num_shift(tolerance, work->headroom, &ignored);
    bidiagonal_path_t *const path = &self->path;
    bidiagonal_diagonalise(b, limit, all, path, &self->saturations);
    num_t smallest = (path->ratio > NUM(0)) ? num_div(limit, path->ratio, &ignored) : NUM(511);
    self->converged = path->done;
    uint32_t unexplained = 0;
    for (uint32_t i = path->open_rows; i < b->rows; ++i) {
        const num_t singular = num_abs(b->diagonal[i]);
        smallest = num_min(smallest, singular);
        if (!(singular > limit)) {
            num_t *const direction = self->unexplained[unexplained];
            for (uint32_t c = 0; c < COLUMNS; ++c) {
                direction[c] = (c == i) ? NUM(1) : NUM(0);
            }
            ++unexplained;
        }
    }
    bidiagonal_rotate_back(path, unexplained, self->unexplained);
    /* Uncovered in float: 1 region, 1 branch. No matrix of float32 is known that wants more sweeps than there are. */
    self->rank = path->done ? (b->rows - unexplained) : 0u;
    self->smallest = (b->rows > 0u) ? num_shift(smallest, -work->headroom, &self->saturations) : NUM(0);
    if ((path->sweeps == 0u) && (self->rank == k) && (self->smallest < weak)) {
        factor(self, column, work->headroom);
    }
}

void subspace_step(subspace_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t tolerance) {
    work_t work;
    decompose(self, &work, n, k, column, tolerance, false);
}

void subspace_measure(subspace_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t tolerance,
                      num_t singular[]) {
    work_t work;
    decompose(self, &work, n, k, column, tolerance, true);
    for (uint32_t i = 0; i < self->directions; ++i) {
        singular[i] = num_shift(num_abs(work.bidiagonal.diagonal[i]), -work.headroom, &self->saturations);
    }
}

/* Removes the explained directions from the leading coordinates of x. */
static void clear_explained(subspace_t *self, num_t x[]) {
    num_t sum[COLUMNS] = {NUM(0)};
    for (uint32_t d = 0; d < (self->directions - self->rank); ++d) {
        const num_t *const direction = self->unexplained[d];
        num_wide_t along = num_widen(NUM(0));
        for (uint32_t i = 0; i < self->directions; ++i) {
            along += num_wide(direction[i], x[i]);
        }
        const num_t scale = num_narrow(along, &self->saturations);
        for (uint32_t i = 0; i < self->directions; ++i) {
            sum[i] = num_narrow(num_widen(sum[i]) + num_wide(scale, direction[i]), &self->saturations);
        }
    }
    for (uint32_t i = 0; i < self->directions; ++i) {
        x[i] = sum[i];
    }
}

void subspace_reject(subspace_t *self, const num_t tau[], num_t rejected[]) {
    num_t x[ROWS];
    for (uint32_t i = 0; i < ROWS; ++i) {
        x[i] = tau[i];
    }
    if (self->rank > 0u) {
        into_directions(self, self->directions, x);
        clear_explained(self, x);
        out_of_directions(self, self->directions, x);
    }
    for (uint32_t i = 0; i < ROWS; ++i) {
        rejected[i] = x[i];
    }
}
