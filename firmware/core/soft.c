#include "soft.h"

enum { ROWS = ROBOT_JOINTS, COLUMNS = SUBSPACE_MAX_COLUMNS };

void soft_init(soft_t *self) {
    *self = (soft_t){0};
}

static uint32_t without_zeros(uint32_t k, const num_t column[][ROBOT_MAX_JOINTS]) {
    uint32_t count = k;
    bool zero = true;
    while (zero && (count > 0u)) {
        for (uint32_t i = 0; i < (uint32_t)ROWS; ++i) {
            zero = zero && (column[count - 1u][i] == NUM(0));
        }
        count -= zero ? 1u : 0u;
    }
    return count;
}

/* Replaces x by x - (u . x) u. Returns u . x. */
static __attribute__((noinline)) num_t reflect(const num_t u[], const num_t from[], num_t to[], uint32_t *saturations) {
    num_t x[ROWS];
    num_wide_t along = num_widen(NUM(0));
    for (uint32_t i = 0; i < (uint32_t)ROWS; ++i) {
        x[i] = from[i];
        along += num_wide(u[i], x[i]);
    }
    const num_t scale = num_narrow(along, saturations);
    for (uint32_t i = 0; i < (uint32_t)ROWS; ++i) {
        to[i] = num_narrow(num_widen(x[i]) - num_wide(scale, u[i]), saturations);
    }
    return scale;
}

/* Replaces x by the reflector that maps (x, s) onto the axis of s. Returns its entry on that axis. */
static num_t make(soft_t *self, num_t x[], num_t s, uint32_t at) {
    num_wide_t square = num_wide(s, s);
    for (uint32_t i = 0; i < (uint32_t)ROWS; ++i) {
        square += num_wide(x[i], x[i]);
    }
    const num_t length = num_root(square);
    const num_t sum = num_add(length, s, &self->saturations); /* both positive: no cancellation */
    const num_inverse_t inverse = num_inverse_root(num_wide(length, sum));
    for (uint32_t i = 0; i < (uint32_t)ROWS; ++i) {
        x[i] = num_times(x[i], inverse, &self->saturations);
    }
    self->triangle[at][at] = length;
    return num_times(sum, inverse, &self->saturations);
}

/* Normalises w in place. Returns |w|. */
static num_t normalise(num_t w[], uint32_t count, uint32_t *ignored) {
    num_t size = NUM(0);
    for (uint32_t c = 0; c < count; ++c) {
        size = num_max(size, num_abs(w[c]));
    }
    const int32_t shift = num_headroom(size);
    num_wide_t square = num_widen(NUM(0));
    for (uint32_t c = 0; c < count; ++c) {
        w[c] = num_shift(w[c], shift, ignored);
        square += num_wide(w[c], w[c]);
    }
    const num_inverse_t inverse = num_inverse_root(square);
    for (uint32_t c = 0; c < count; ++c) {
        w[c] = num_times(w[c], inverse, ignored);
    }
    return num_shift(num_root(square), -shift, ignored);
}

/* A start vector with a component in every direction. */
static void start_weakest(soft_t *self) {
    uint32_t ignored = 0;
    for (uint32_t c = 0; c < (uint32_t)COLUMNS; ++c) {
        self->weakest[c] = NUM(1);
    }
    (void)normalise(self->weakest, self->columns, &ignored);
}

/* One inverse iteration on R^T R = A^T A + s^2 I. It starts from the last direction, because the arm turns little in a
 * tick. */
static void follow_weakest(soft_t *self, num_t s) {
    /* Ignored: this value is telemetry, and a saturation of it does not invalidate the projection. */
    uint32_t ignored = 0;
    const uint32_t k = self->columns;
    num_t *const w = self->weakest;
    num_t inverse[COLUMNS];
    for (uint32_t c = 0; c < k; ++c) {
        inverse[c] = num_div(NUM(1), self->triangle[c][c], &ignored);
        num_wide_t rest = num_widen(w[c]);
        for (uint32_t j = 0; j < c; ++j) {
            rest -= num_wide(self->triangle[c][j], w[j]);
        }
        w[c] = num_mul(num_narrow(rest, &ignored), inverse[c], &ignored);
    }
    const num_t stretched = normalise(w, k, &ignored); /* 1 / singular value of R */
    for (uint32_t c = k; c > 0u; --c) {
        num_wide_t rest = num_widen(w[c - 1u]);
        for (uint32_t j = c; j < k; ++j) {
            rest -= num_wide(self->triangle[j][c - 1u], w[j]);
        }
        w[c - 1u] = num_mul(num_narrow(rest, &ignored), inverse[c - 1u], &ignored);
    }
    (void)normalise(w, k, &ignored);
    /* Uncovered in fixed: 1 region, 1 branch. Every pattern of Q9.22 is a number. */
    if (!num_finite(stretched)) {
        start_weakest(self);
        return;
    }
    const num_t singular = num_div(NUM(1), stretched, &ignored);
    const num_wide_t square = num_wide(singular, singular) - num_wide(s, s);
    self->smallest = (square > num_widen(NUM(0))) ? num_root(square) : NUM(0);
}

void soft_step(soft_t *self, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t s) {
    const uint32_t count = without_zeros(k, column);
    const bool other = count != self->columns;
    num_t last[COLUMNS]; /* per reflection, its entry in the row of s I */
    self->columns = count;
    self->smallest = NUM(0);
    for (uint32_t c = 0; c < count; ++c) {
        num_t *const x = self->reflector[c];
        const num_t *from = column[c];
        for (uint32_t j = 0; j < c; ++j) {
            const num_t scale = reflect(self->reflector[j], from, x, &self->saturations);
            self->triangle[c][j] = num_mul(scale, last[j], &self->saturations);
            from = x;
        }
        for (uint32_t i = 0; i < (uint32_t)ROWS; ++i) {
            x[i] = from[i];
        }
        last[c] = make(self, x, s, c);
    }
    if (other) {
        start_weakest(self);
    }
    if (count > 0u) {
        follow_weakest(self, s);
    }
}

static void reflect_back(soft_t *self, uint32_t count, num_t x[]) {
    for (uint32_t c = count; c > 0u; --c) {
        (void)reflect(self->reflector[c - 1u], x, x, &self->saturations);
    }
}

void soft_reject(soft_t *self, const num_t tau[], num_t rejected[], uint32_t first, num_t first_rejected[]) {
    const num_t *from = tau;
    for (uint32_t c = 0; c < self->columns; ++c) {
        num_t *const to = (c < first) ? first_rejected : rejected;
        (void)reflect(self->reflector[c], from, to, &self->saturations);
        from = to;
    }
    if (from != rejected) {
        for (uint32_t i = 0; i < (uint32_t)ROWS; ++i) {
            rejected[i] = from[i];
        }
    }
    if (first > 0u) {
        if (self->columns == 0u) {
            for (uint32_t i = 0; i < (uint32_t)ROWS; ++i) {
                first_rejected[i] = tau[i];
            }
        }
        reflect_back(self, (first < self->columns) ? first : self->columns, first_rejected);
    }
    reflect_back(self, self->columns, rejected);
}
