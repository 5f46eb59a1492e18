#include "subspace.h"

/* R, one row of k entries for each direction; its rows become orthogonal, and then as long as the singular values. */
typedef struct {
    num_t row[SUBSPACE_MAX_COLUMNS][SUBSPACE_MAX_COLUMNS];
    num_wide_t square[SUBSPACE_MAX_COLUMNS]; /* squared length of each row */
    int32_t headroom;                        /* every entry is multiplied by 2^headroom (num.h) */
} triangle_t;

void subspace_init(subspace_t *self) {
    *self = (subspace_t){0};
}

/* A column this short is zero: the square of what rounding leaves of a zero may have no exact float. */
static const num_t nothing = NUM(1e-15);

static num_t largest(const num_t x[], uint32_t from, uint32_t n) {
    num_t size = NUM(0);
    for (uint32_t i = from; i < n; ++i) {
        size = num_max(size, num_abs(x[i]));
    }
    return size;
}

/* x <- (I - u u^T) x for the reflector u, which is zero before row `from`. */
static inline void reflect(const num_t u[], uint32_t from, uint32_t n, num_t x[], uint32_t *saturations) {
    num_wide_t along = num_widen(NUM(0));
    for (uint32_t i = from; i < n; ++i) {
        along += num_wide(u[i], x[i]);
    }
    const num_t scale = num_narrow(along, saturations);
    for (uint32_t i = from; i < n; ++i) {
        x[i] = num_subtract(x[i], num_mul(scale, u[i], saturations), saturations);
    }
}

/* The vector u, of squared length 2, whose reflection sends x, from row `from` on, onto that row's axis; zero when x is
 * zero there. NaN or infinity in x is in u too. */
static void make_reflector(num_t u[], uint32_t from, uint32_t n, const num_t x[], uint32_t *saturations) {
    num_wide_t square = num_widen(NUM(0));
    const int32_t shift = num_headroom(largest(x, from, n));
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        const bool inside = (i >= from) && (i < n);
        u[i] = inside ? num_shift(x[i], shift, saturations) : NUM(0);
        square += num_wide(u[i], u[i]);
    }
    const num_t length = num_root(square);
    u[from] += (u[from] < NUM(0)) ? -length : length; /* the sign that cancels nothing */
    const num_inverse_t inverse = num_inverse_root(num_wide(length, num_abs(u[from])));
    for (uint32_t i = from; i < n; ++i) {
        u[i] = (length <= nothing) ? NUM(0) : num_times(u[i], inverse, saturations);
    }
}

static void factor(subspace_t *self, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], triangle_t *r) {
    num_t x[ROBOT_MAX_JOINTS];
    for (uint32_t c = 0; c < k; ++c) {
        for (uint32_t i = 0; i < self->rows; ++i) {
            x[i] = num_shift(column[c][i], r->headroom, &self->saturations);
        }
        for (uint32_t j = 0; (j < c) && (j < self->directions); ++j) {
            reflect(self->reflector[j], j, self->rows, x, &self->saturations);
        }
        if (c < self->directions) {
            make_reflector(self->reflector[c], c, self->rows, x, &self->saturations);
            reflect(self->reflector[c], c, self->rows, x, &self->saturations);
        }
        for (uint32_t i = 0; i < self->directions; ++i) {
            r->row[i][c] = (i <= c) ? x[i] : NUM(0);
        }
    }
}

static num_wide_t inner_product(const num_t a[], const num_t b[], uint32_t k) {
    num_wide_t sum = num_widen(NUM(0));
    for (uint32_t c = 0; c < k; ++c) {
        sum += num_wide(a[c], b[c]);
    }
    return sum;
}

static num_wide_t measure(triangle_t *r, uint32_t m, uint32_t k) {
    num_wide_t longest = num_widen(NUM(0));
    for (uint32_t i = 0; i < m; ++i) {
        r->square[i] = inner_product(r->row[i], r->row[i], k);
        longest = (r->square[i] > longest) ? r->square[i] : longest;
    }
    return longest;
}

static void turn_rows(num_t first[], num_t second[], uint32_t k, num_rotation_t turn, uint32_t *saturations) {
    for (uint32_t c = 0; c < k; ++c) {
        const num_t a = first[c];
        const num_t b = second[c];
        first[c] = num_narrow(num_wide(turn.cos, a) - num_wide(turn.sin, b), saturations);
        second[c] = num_narrow(num_wide(turn.sin, a) + num_wide(turn.cos, b), saturations);
    }
}

/* One sweep over all pairs of rows. True when no pair needed a rotation. */
static bool sweep(triangle_t *r, uint32_t m, uint32_t k, num_rotation_t turn[], uint32_t *saturations) {
    const num_wide_t longest = measure(r, m, k);
    bool still = true;
    uint32_t pair = 0;
    for (uint32_t i = 0; i + 1u < m; ++i) {
        for (uint32_t j = i + 1u; j < m; ++j) {
            const num_wide_t inner = inner_product(r->row[i], r->row[j], k);
            num_rotation_t rotation = {.sin = NUM(0), .cos = NUM(1)};
            if (!num_orthogonal(r->square[i], r->square[j], inner, longest)) {
                rotation = num_orthogonalise(&r->square[i], &r->square[j], inner);
                turn_rows(r->row[i], r->row[j], k, rotation, saturations);
                still = false;
            }
            turn[pair] = rotation;
            ++pair;
        }
    }
    return still;
}

static void orthogonalise(subspace_t *self, uint32_t k, triangle_t *r) {
    self->converged = false;
    self->sweeps = 0;
    for (uint32_t s = 0; (s < SUBSPACE_MAX_SWEEPS) && !self->converged; ++s) {
        self->converged = sweep(r, self->directions, k, self->turn[s], &self->saturations);
        self->sweeps = s + 1u;
    }
}

void subspace_step(subspace_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t tolerance) {
    triangle_t r;
    self->rows = n;
    self->directions = (n < k) ? n : k;
    num_t size = NUM(0);
    for (uint32_t c = 0; c < k; ++c) {
        size = num_max(size, largest(column[c], 0, n));
    }
    r.headroom = num_headroom(size);
    factor(self, k, column, &r);
    orthogonalise(self, k, &r);
    (void)measure(&r, self->directions, k);
    self->rank = 0;
    for (uint32_t i = 0; i < SUBSPACE_MAX_COLUMNS; ++i) {
        self->singular[i] =
            (i < self->directions) ? num_shift(num_root(r.square[i]), -r.headroom, &self->saturations) : NUM(0);
        self->converged = self->converged && num_finite(self->singular[i]);
    }
    for (uint32_t i = 0; i < SUBSPACE_MAX_COLUMNS; ++i) {
        self->explained[i] = self->converged && (i < self->directions) && (self->singular[i] > tolerance);
        self->rank += self->explained[i] ? 1u : 0u;
    }
}

/* Applies sweep s to a vector of direction coordinates, forwards or backwards. */
static void replay(const subspace_t *self, uint32_t s, bool forwards, num_t b[], uint32_t *saturations) {
    const uint32_t m = self->directions;
    uint32_t pair = forwards ? 0u : (m * (m - 1u)) / 2u;
    for (uint32_t a = 0; a + 1u < m; ++a) {
        const uint32_t i = forwards ? a : (m - 2u) - a;
        for (uint32_t step = 0; i + 1u + step < m; ++step) {
            const uint32_t j = forwards ? i + 1u + step : (m - 1u) - step;
            pair -= forwards ? 0u : 1u;
            num_rotation_t turn = self->turn[s][pair];
            turn.sin = forwards ? turn.sin : -turn.sin;
            turn_rows(&b[i], &b[j], 1u, turn, saturations);
            pair += forwards ? 1u : 0u;
        }
    }
}

/* Takes the explained directions out of the coordinates b; the rest stays. */
static void clear_explained(const subspace_t *self, num_t b[], uint32_t *saturations) {
    if (self->rank == self->directions) { /* the usual case: no need to turn to the singular directions and back */
        for (uint32_t i = 0; i < self->directions; ++i) {
            b[i] = NUM(0);
        }
    } else if (self->rank > 0u) {
        for (uint32_t s = 0; s < self->sweeps; ++s) {
            replay(self, s, true, b, saturations);
        }
        for (uint32_t i = 0; i < self->directions; ++i) {
            b[i] = self->explained[i] ? NUM(0) : b[i];
        }
        for (uint32_t s = self->sweeps; s-- > 0u;) {
            replay(self, s, false, b, saturations);
        }
    } else {
        /* nothing is explained */
    }
}

void subspace_reject(subspace_t *self, const num_t tau[], num_t rejected[]) {
    num_t x[ROBOT_MAX_JOINTS];
    const uint32_t n = self->rows;
    for (uint32_t i = 0; i < n; ++i) {
        x[i] = tau[i];
    }
    if (self->rank > 0u) {
        for (uint32_t j = 0; j < self->directions; ++j) {
            reflect(self->reflector[j], j, n, x, &self->saturations);
        }
        clear_explained(self, x, &self->saturations);
        for (uint32_t j = self->directions; j-- > 0u;) {
            reflect(self->reflector[j], j, n, x, &self->saturations);
        }
    }
    for (uint32_t i = 0; i < n; ++i) {
        rejected[i] = x[i];
    }
}

num_t subspace_smallest(const subspace_t *self) {
    num_t smallest = (self->directions > 0u) ? self->singular[0] : NUM(0);
    for (uint32_t i = 1; i < self->directions; ++i) {
        smallest = num_min(smallest, self->singular[i]);
    }
    return smallest;
}
