#include "subspace.h"

#include "reflector.h"

#define ROWS    REFLECTOR_ROWS
#define COLUMNS SUBSPACE_MAX_COLUMNS

/* A while it is made bidiagonal. Step `at` clears the column of that number below its diagonal entry, and then the row
 * beyond the next entry: what it works on are rows from `at` on, and each `at` is worth a copy of the code that loops
 * along them (NUM_STEP). Loops go to the full length: what is not there is zero. Everything is multiplied by
 * 2^headroom (num.h). */
typedef struct {
    num_t column[COLUMNS][ROBOT_MAX_JOINTS];
    bidiagonal_t bidiagonal;
    int32_t headroom;
} work_t;

/* Where everything is explained, but with a singular value below this, in the unit of A, the reflectors are made anew
 * by QR alone: what the reflections from the right add to the rounding shows in such a direction. */
static const num_t weak = NUM(0.01);

void subspace_init(subspace_t *self) {
    *self = (subspace_t){0};
}

/* Clears row `at` beyond its next entry by a reflection from the right, which turns no direction of torque. */
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
        const num_t share = v[c];
        for (uint32_t i = at + 1u; i < ROWS; ++i) {
            x[i] = num_narrow(num_widen(x[i]) - num_wide(scale[i], share), saturations);
        }
    }
}

/* Step `at`, if there is one. Its columns are read from `from`. */
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

/* The columns multiplied by 2^headroom: as they are where that is 0, as for any float. */
static const num_t (*scaled_columns(subspace_t *self, work_t *work, uint32_t k,
                                    const num_t column[][ROBOT_MAX_JOINTS]))[ROBOT_MAX_JOINTS] {
    num_t size = NUM(0);
    for (uint32_t c = 0; c < k; ++c) {
        for (uint32_t i = 0; i < ROWS; ++i) {
            size = num_max(size, num_abs(column[c][i]));
        }
    }
    work->headroom = num_headroom(size);
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

/* One entry of A that is not a number spoils every row of B. */
static bool made_of_numbers(const bidiagonal_t *b) {
    bool finite = true;
    for (uint32_t i = 0; i < b->rows; ++i) {
        finite = finite && num_finite(b->diagonal[i]);
    }
    return finite;
}

NUM_STEP void reflect_by(subspace_t *self, uint32_t count, num_t x[], const uint32_t at) {
    if (at < count) {
        reflector_apply(self->reflector[at], x, x, at, &self->saturations);
    }
}

/* x by the directions that the first `count` reflectors lead to. */
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

/* The reflectors of QR: one column after the other, by those that there are. For no more columns than rows. */
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
    const num_t(*const left)[ROBOT_MAX_JOINTS] = (const num_t(*)[ROBOT_MAX_JOINTS])work->column;
    clear_column_and_row(self, work, k, left, 1);
    clear_column_and_row(self, work, k, left, 2);
    clear_column_and_row(self, work, k, left, 3);
    clear_column_and_row(self, work, k, left, 4);
    clear_column_and_row(self, work, k, left, 5);
    if (n < k) {
        bidiagonal_square(b, &self->saturations);
    }
    if (!made_of_numbers(b)) {
        return;
    }
    uint32_t held = 0; /* at a size that no singular value has */
    const num_t limit = num_shift(tolerance, work->headroom, &held);
    bidiagonal_path_t *const path = &self->path;
    bidiagonal_diagonalise(b, limit, all, path, &self->saturations);
    num_t smallest = (path->share > NUM(0)) ? num_div(limit, path->share, &held) : NUM(511);
    self->converged = path->done;
    uint32_t unexplained = 0;
    for (uint32_t i = path->left; i < b->rows; ++i) {
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
    bidiagonal_turn_back(path, unexplained, self->unexplained);
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

/* What is left of the first coordinates x when the explained directions are taken out of them. */
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
