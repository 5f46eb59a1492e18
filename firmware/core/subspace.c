#include "subspace.h"

#define ROWS    ROBOT_MAX_JOINTS
#define COLUMNS SUBSPACE_MAX_COLUMNS

/* Every loop along a column or a row has its full length, so that it unrolls: what is not there is zero. */

/* One of the columns while they are reflected: what is left of it in the rows that R does not have yet. */
typedef struct {
    num_t entry[ROWS];
    num_wide_t square; /* its squared length, about */
} column_t;

typedef struct {
    num_t entry[COLUMNS];
} row_t;

/* R, one row for each direction; its rows become orthogonal, and then as long as the singular values. What is behind
 * the last direction is never read. */
typedef struct {
    row_t row[COLUMNS];
    num_wide_t square[COLUMNS]; /* squared length of each row */
    uint32_t certain;           /* so many of the first rows are explained, whatever the others are */
    num_t share;                /* tolerance / (lower bound of these rows' singular values), below 1 */
} triangle_t;

/* Angles, as 2^-bits: a pair of rows that is nearer to orthogonal than `straight` stays as it is. A sweep without a
 * rotation beyond `settled` is the last one: another would turn by its square. Pairs of certain rows only keep the
 * others from converging: within `loose` they stay as they are. */
static const num_angle_t straight = NUM_ANGLE(20);
static const num_t settled = NUM(2.4e-4);
static const num_angle_t loose = NUM_ANGLE(8);
static const uint32_t loose_sweeps = 4; /* if these were not enough, the others converge slowly: on with every pair */

/* A column this short is zero: the square of what rounding leaves of a zero may have no exact float. */
static const num_t nothing = NUM(1e-15);

void subspace_init(subspace_t *self) {
    *self = (subspace_t){0};
}

static inline num_wide_t square_of(const num_t x[]) {
    num_wide_t sum = num_wide(x[0], x[0]);
    for (uint32_t i = 1; i < ROWS; ++i) {
        sum += num_wide(x[i], x[i]);
    }
    return sum;
}

/* x <- (I - u u^T) x for the reflector u. */
static inline void reflect(const num_t u[restrict], num_t x[restrict], uint32_t *saturations) {
    num_wide_t along = num_wide(u[0], x[0]);
    for (uint32_t i = 1; i < ROWS; ++i) {
        along += num_wide(u[i], x[i]);
    }
    const num_t scale = num_narrow(along, saturations);
    for (uint32_t i = 0; i < ROWS; ++i) {
        x[i] = num_subtract(x[i], num_mul(scale, u[i], saturations), saturations);
    }
}

/* The vector u, of squared length 2, whose reflection sends x onto the axis of row `at`, before which x is zero; zero
 * when x is. Returns what x becomes there. */
static num_t make_reflector(num_t u[restrict], uint32_t at, const num_t x[restrict], uint32_t *saturations) {
    num_t size = NUM(0);
    for (uint32_t i = 0; i < ROWS; ++i) {
        size = num_max(size, num_abs(x[i]));
    }
    const int32_t shift = num_headroom(size);
    for (uint32_t i = 0; i < ROWS; ++i) {
        u[i] = num_shift(x[i], shift, saturations);
    }
    const num_t length = num_root(square_of(u));
    const num_t image = (u[at] < NUM(0)) ? length : -length; /* the sign that cancels nothing */
    u[at] -= image;
    const num_inverse_t inverse = num_inverse_root(num_wide(length, num_abs(u[at])));
    for (uint32_t i = 0; i < ROWS; ++i) {
        u[i] = (length <= nothing) ? NUM(0) : num_times(u[i], inverse, saturations);
    }
    return num_shift(image, -shift, saturations);
}

/* Exchanges two of the columns, in R's first rows as well. */
static void exchange(triangle_t *r, uint32_t rows, column_t left[], uint32_t a, uint32_t b) {
    const column_t column = left[a];
    left[a] = left[b];
    left[b] = column;
    for (uint32_t i = 0; i < rows; ++i) {
        const num_t entry = r->row[i].entry[a];
        r->row[i].entry[a] = r->row[i].entry[b];
        r->row[i].entry[b] = entry;
    }
}

/* QR with column pivoting, from the longest column on: the reflectors and R. */
static void factor(subspace_t *self, triangle_t *r, column_t left[], uint32_t k, uint32_t longest) {
    for (uint32_t j = 0; j < self->directions; ++j) {
        row_t *const row = &r->row[j];
        if (longest != j) {
            exchange(r, j, left, longest, j);
        }
        for (uint32_t c = 0; c < COLUMNS; ++c) {
            row->entry[c] = NUM(0);
        }
        row->entry[j] = make_reflector(self->reflector[j], j, left[j].entry, &self->saturations);
        longest = j + 1u;
        for (uint32_t c = j + 1u; c < k; ++c) {
            reflect(self->reflector[j], left[c].entry, &self->saturations);
            const num_t entry = left[c].entry[j];
            row->entry[c] = entry;
            left[c].entry[j] = NUM(0);
            left[c].square -= num_wide(entry, entry);
            longest = (left[c].square > left[longest].square) ? c : longest;
        }
    }
}

/* Finds how many of the first rows are certain: their triangle's inverse, times the tolerance, is shorter than 1
 * (Frobenius), so that none of its singular values is as large. One column of it after the other, by substitution. */
static void certify(triangle_t *r, uint32_t m, num_t tolerance, uint32_t *saturations) {
    num_t x[COLUMNS];
    num_wide_t sum = num_widen(NUM(0));
    for (uint32_t j = 0; j < m; ++j) {
        num_t image = tolerance;
        for (uint32_t i = j + 1u; i-- > 0u;) {
            if (!(num_abs(image) < num_abs(r->row[i].entry[i]))) {
                return; /* so that no quotient is too large for its type */
            }
            x[i] = num_div(image, r->row[i].entry[i], saturations);
            sum += num_wide(x[i], x[i]);
            if (i > 0u) {
                num_wide_t inner = num_widen(NUM(0));
                for (uint32_t l = i; l <= j; ++l) {
                    inner -= num_wide(r->row[i - 1u].entry[l], x[l]);
                }
                image = num_narrow(inner, saturations);
            }
        }
        if (!(sum < num_widen(NUM(1)))) {
            return;
        }
        r->certain = j + 1u;
        r->share = num_root(sum);
    }
}

static inline num_wide_t inner_product(const row_t *a, const row_t *b) {
    num_wide_t sum = num_wide(a->entry[0], b->entry[0]);
    for (uint32_t c = 1; c < COLUMNS; ++c) {
        sum += num_wide(a->entry[c], b->entry[c]);
    }
    return sum;
}

static void square_rows(triangle_t *r, uint32_t m) {
    for (uint32_t i = 0; i < m; ++i) {
        r->square[i] = inner_product(&r->row[i], &r->row[i]);
    }
}

static inline void turn_pair(num_t *first, num_t *second, num_rotation_t rotation, uint32_t *saturations) {
    const num_t a = *first;
    const num_t b = *second;
    *first = num_narrow(num_wide(rotation.cos, a) - num_wide(rotation.sin, b), saturations);
    *second = num_narrow(num_wide(rotation.sin, a) + num_wide(rotation.cos, b), saturations);
}

/* One sweep over all pairs of rows. True when it was the last one. */
static bool sweep(subspace_t *self, triangle_t *r) {
    bool last = true;
    square_rows(r, self->directions);
    for (uint32_t j = 1; j < self->directions; ++j) {
        const bool certain = (j < r->certain) && (self->sweeps < loose_sweeps);
        const num_angle_t enough = certain ? loose : straight;
        row_t b = r->row[j]; /* in registers */
        num_wide_t square = r->square[j];
        for (uint32_t i = 0; i < j; ++i) {
            row_t *const a = &r->row[i];
            const num_wide_t inner = inner_product(a, &b);
            if (!num_orthogonal(r->square[i], square, inner, enough)) {
                const num_rotation_t rotation = num_orthogonalise(&r->square[i], &square, inner);
                last = last && (num_abs(rotation.sin) < settled);
                for (uint32_t c = 0; c < COLUMNS; ++c) {
                    turn_pair(&a->entry[c], &b.entry[c], rotation, &self->saturations);
                }
                self->turn[self->turns] = (subspace_turn_t){.rotation = rotation, .first = i, .second = j};
                ++self->turns;
            }
        }
        r->row[j] = b;
        r->square[j] = square;
    }
    return last;
}

/* Certain rows are explained, and there are as many singular values above the bound of theirs. These are the rows'
 * own, unless another row is that long. */
static bool certain_rows_hold(const triangle_t *r, uint32_t m, num_t tolerance, uint32_t *saturations) {
    bool hold = true;
    for (uint32_t i = r->certain; i < m; ++i) {
        hold = hold && (num_mul(num_root(r->square[i]), r->share, saturations) < tolerance);
    }
    return hold;
}

/* Jacobi to the end: rows become orthogonal, but for certain ones among themselves. */
static void orthogonalise(subspace_t *self, triangle_t *r, num_t tolerance) {
    const uint32_t m = self->directions;
    for (uint32_t s = 0; (s < SUBSPACE_MAX_SWEEPS) && !self->converged; ++s) {
        self->converged = sweep(self, r);
        self->sweeps = s + 1u;
        if (self->converged && (r->certain > 0u) && !certain_rows_hold(r, m, tolerance, &self->saturations)) {
            self->converged = false;
            r->certain = 0;
        }
    }
    square_rows(r, m);
}

/* Reads the columns, multiplied by 2^headroom (num.h). False if one of them is not made of numbers. */
static bool read_columns(subspace_t *self, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], column_t left[],
                         int32_t *headroom) {
    num_t size = NUM(0);
    for (uint32_t c = 0; c < k; ++c) {
        for (uint32_t i = 0; i < ROWS; ++i) {
            size = num_max(size, num_abs(column[c][i]));
        }
    }
    *headroom = num_headroom(size);
    bool finite = true;
    for (uint32_t c = 0; c < k; ++c) {
        uint32_t ignored = 0;
        for (uint32_t i = 0; i < ROWS; ++i) {
            left[c].entry[i] = num_shift(column[c][i], *headroom, &self->saturations);
        }
        left[c].square = square_of(left[c].entry);
        finite = finite && num_finite(num_narrow(left[c].square, &ignored));
    }
    return finite;
}

/* Decomposes A. With `all`, no row is certain, and r's rows are as long as all of the singular values. Returns the
 * headroom. */
static int32_t decompose(subspace_t *self, triangle_t *r, uint32_t n, uint32_t k,
                         const num_t column[][ROBOT_MAX_JOINTS], num_t tolerance, bool all) {
    column_t left[COLUMNS];
    int32_t headroom;
    const uint32_t m = (n < k) ? n : k;
    r->certain = 0;
    r->share = NUM(0);
    self->directions = m;
    self->converged = false;
    self->smallest = NUM(0);
    self->rank = 0;
    self->sweeps = 0;
    self->turns = 0;
    if (!read_columns(self, k, column, left, &headroom)) {
        return headroom;
    }
    uint32_t held = 0; /* at a size that no singular value has */
    const num_t limit = num_shift(tolerance, headroom, &held);
    uint32_t longest = 0;
    for (uint32_t c = 1; c < k; ++c) {
        longest = (left[c].square > left[longest].square) ? c : longest;
    }
    factor(self, r, left, k, longest);
    if (!all) {
        certify(r, m, limit, &self->saturations);
    }
    self->converged = r->certain == m;
    if (!self->converged) {
        orthogonalise(self, r, limit);
    }
    num_t smallest = NUM(0);
    if (r->certain < m) {
        smallest = num_root(r->square[r->certain]);
    } else if (r->share > NUM(0)) {
        smallest = num_div(limit, r->share, &self->saturations);
    } else {
        /* no direction, or a tolerance of zero */
    }
    for (uint32_t i = 0; i < m; ++i) {
        const bool certain = i < r->certain;
        const num_t singular = certain ? smallest : num_root(r->square[i]);
        self->explained[i] = self->converged && (certain || (singular > limit));
        self->rank += self->explained[i] ? 1u : 0u;
        smallest = num_min(smallest, singular);
    }
    self->smallest = num_shift(smallest, -headroom, &self->saturations);
    return headroom;
}

void subspace_step(subspace_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t tolerance) {
    triangle_t r;
    (void)decompose(self, &r, n, k, column, tolerance, false);
}

void subspace_measure(subspace_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t tolerance,
                      num_t singular[]) {
    triangle_t r;
    const int32_t headroom = decompose(self, &r, n, k, column, tolerance, true);
    for (uint32_t i = 0; i < self->directions; ++i) {
        singular[i] = num_shift(num_root(r.square[i]), -headroom, &self->saturations);
    }
}

/* Takes the explained directions out of the coordinates b; the rest stays. */
static void clear_explained(const subspace_t *self, num_t b[], uint32_t *saturations) {
    for (uint32_t t = 0; t < self->turns; ++t) {
        const subspace_turn_t *const turn = &self->turn[t];
        turn_pair(&b[turn->first], &b[turn->second], turn->rotation, saturations);
    }
    for (uint32_t i = 0; i < self->directions; ++i) {
        b[i] = self->explained[i] ? NUM(0) : b[i];
    }
    for (uint32_t t = self->turns; t-- > 0u;) {
        const subspace_turn_t *const turn = &self->turn[t];
        const num_rotation_t back = {.sin = -turn->rotation.sin, .cos = turn->rotation.cos};
        turn_pair(&b[turn->first], &b[turn->second], back, saturations);
    }
}

void subspace_reject(subspace_t *self, const num_t tau[], num_t rejected[]) {
    num_t x[ROWS];
    for (uint32_t i = 0; i < ROWS; ++i) {
        x[i] = tau[i];
    }
    if (self->rank > 0u) {
        for (uint32_t j = 0; j < self->directions; ++j) {
            reflect(self->reflector[j], x, &self->saturations);
        }
        clear_explained(self, x, &self->saturations);
        for (uint32_t j = self->directions; j-- > 0u;) {
            reflect(self->reflector[j], x, &self->saturations);
        }
    }
    for (uint32_t i = 0; i < ROWS; ++i) {
        rejected[i] = x[i];
    }
}
