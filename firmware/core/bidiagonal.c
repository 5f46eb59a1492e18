#include "bidiagonal.h"

/* Rows first to last. All entries above the diagonal are significant, except that of the last row. */
typedef struct {
    uint32_t first, last;
} block_t;

/* The first sweeps have no shift: they isolate a singular value that is small compared with the next one. */
static const uint32_t unshifted_sweeps = 2;
static const uint32_t late_sweeps = 8; /* rarely reached */

/* Smaller entries count as zero, because their squares may be subnormal. */
static const num_t nothing = NUM(1e-15);

void bidiagonal_square(bidiagonal_t *self, uint32_t *saturations) {
    num_t beyond = self->above[self->rows - 1u];
    self->above[self->rows - 1u] = NUM(0);
    for (uint32_t i = self->rows; i-- > 0u;) {
        const num_rotation_t right = num_rotation(self->diagonal[i], beyond, saturations);
        self->diagonal[i] = right.length;
        if (i > 0u) {
            beyond = num_unit_times(-right.sin, self->above[i - 1u]);
            self->above[i - 1u] = num_unit_times(right.cos, self->above[i - 1u]);
        }
    }
}

/* True if *ratio = tolerance * |B^-1|_F of the first `rows` rows is below 1. The norm of row i of the inverse is sqrt(1
 * + (above_i * norm of row i+1)^2) / |diagonal_i|. */
static bool short_inverse(const bidiagonal_t *self, uint32_t rows, num_t tolerance, num_t *ratio,
                          uint32_t *saturations) {
    const num_wide_t square = num_wide(tolerance, tolerance);
    num_wide_t sum = num_widen(NUM(0));
    num_t row = NUM(0);
    for (uint32_t i = rows; i-- > 0u;) {
        const num_t size = num_abs(self->diagonal[i]);
        const num_t along = num_mul(self->above[i], row, saturations);
        const num_t length = num_root(square + num_wide(along, along));
        if (!(length < size)) { /* keeps the quotient in range */
            return false;
        }
        row = num_div(length, size, saturations);
        sum += num_wide(row, row);
    }
    *ratio = num_root(sum);
    return sum < num_widen(NUM(1));
}

/* The block that ends in row `last`: it begins where every entry above the diagonal exceeds `negligible`. The
 * negligible entry before the block becomes zero. */
static block_t block_of(bidiagonal_t *self, uint32_t last, num_t negligible) {
    block_t block = {.first = last, .last = last};
    while ((block.first > 0u) && (num_abs(self->above[block.first - 1u]) > negligible)) {
        --block.first;
    }
    if (block.first > 0u) {
        self->above[block.first - 1u] = NUM(0);
    }
    return block;
}

/* Whether the next sweep uses a shift. In fixed point a small row before a large last row can lose the shift, so late
 * sweeps have none there. */
static bool wants_shift(const bidiagonal_t *self, block_t block, uint32_t sweeps, uint32_t *saturations) {
    bool wants = sweeps >= unshifted_sweeps;
    if (sweeps >= late_sweeps) {
        const num_t small = num_mul(NUM(0.125), num_abs(self->diagonal[block.last]), saturations);
        for (uint32_t i = block.first; i < block.last; ++i) {
            wants = wants && (num_abs(self->diagonal[i]) > small);
        }
    }
    return wants;
}

/* The shift: the smaller eigenvalue of the last two rows of B^T B, so that the small singular values converge first. */
static num_wide_t shift_of(const bidiagonal_t *self, block_t block) {
    const uint32_t last = block.last;
    const num_t before = ((last - 1u) > block.first) ? self->above[last - 2u] : NUM(0);
    const num_t entry = self->diagonal[last - 1u];
    const num_t above = self->above[last - 1u];
    return num_smaller_eigenvalue(num_wide(entry, entry) + num_wide(before, before),
                                  num_wide(self->diagonal[last], self->diagonal[last]) + num_wide(above, above),
                                  num_wide(entry, above));
}

/* Restart of the bulge chase after a rotation that was numerically the identity. Unshifted: equivalent to continuing.
 * Shifted: valid only if the fill-in beside `before`, the entry above the diagonal in the previous row, is negligible;
 * otherwise *lost is set. */
static num_rotation_t restarted_chase(num_t before, num_t entry, num_t above, num_wide_t shift, bool shifted,
                                      num_t negligible, bool *lost, uint32_t *saturations) {
    if (!shifted) {
        return num_rotation(entry, above, saturations);
    }
    const num_rotation_t right = num_shifted_rotation(entry, above, shift, saturations);
    const bool aside = num_abs(num_unit_times(right.sin, before)) <= negligible;
    *lost = *lost || !aside;
    return aside ? right : num_rotation(NUM(1), NUM(0), saturations); /* none */
}

/* One sweep over a block: alternating rotations of two columns and two rows. The first acts on the first column of
 * B^T B minus the shift. Each of the others moves the bulge of the previous one. False if the shift was lost, which can
 * happen in fixed point. */
static bool sweep(bidiagonal_t *self, bidiagonal_path_t *path, block_t block, num_wide_t shift, bool shifted,
                  num_t negligible, uint32_t *saturations) {
    bidiagonal_rotation_t *rotation = &path->rotation[path->rotations];
    num_t entry = self->diagonal[block.first];
    num_t above = self->above[block.first];
    num_rotation_t right =
        shifted ? num_shifted_rotation(entry, above, shift, saturations) : num_rotation(entry, above, saturations);
    bool lost = false;
    for (uint32_t i = block.first; i < block.last; ++i) {
        const num_t next = self->diagonal[i + 1u];
        const num_t after = self->above[i + 1u];
        const num_t turned = num_turned_first(right.cos, right.sin, entry, above, saturations);
        const num_t beside = num_turned_second(right.cos, right.sin, entry, above, saturations);
        const num_t below = num_unit_times(right.cos, next);
        const num_rotation_t left = num_rotation(turned, num_unit_times(right.sin, next), saturations);
        self->diagonal[i] = left.length;
        self->above[i] = num_turned_first(left.cos, left.sin, beside, below, saturations);
        entry = num_turned_second(left.cos, left.sin, beside, below, saturations);
        *rotation = (bidiagonal_rotation_t){.cos = left.cos, .sin = left.sin, .first = i};
        ++rotation;
        if ((i + 1u) < block.last) {
            const num_t bulge = num_unit_times(left.sin, after); /* beside this row's `above` */
            above = num_unit_times(left.cos, after);
            if (bulge != NUM(0)) {
                right = num_rotation(self->above[i], bulge, saturations);
                self->above[i] = right.length;
            } else {
                right = restarted_chase(self->above[i], entry, above, shift, shifted, negligible, &lost, saturations);
            }
        }
    }
    self->diagonal[block.last] = entry;
    path->rotations += block.last - block.first;
    ++path->sweeps;
    return !lost;
}

/* Rounding error relative to the norm of B. A share of each square: twelve of them exceed the range of a sum. */
static num_t negligible_beside(const bidiagonal_t *self, uint32_t *saturations) {
    num_wide_t share = num_widen(NUM(0)); /* a sixteenth of the squared norm */
    for (uint32_t i = 0; i < self->rows; ++i) {
        share += num_wide_share(
            num_wide(self->diagonal[i], self->diagonal[i]) + num_wide(self->above[i], self->above[i]), 4u);
    }
    return num_max(num_mul(num_root(share), 4 * NUM(1.2e-7), saturations), nothing);
}

void bidiagonal_diagonalise(bidiagonal_t *self, num_t tolerance, bool all, bidiagonal_path_t *path,
                            uint32_t *saturations) {
    path->rotations = 0;
    path->sweeps = 0;
    path->open_rows = self->rows;
    path->ratio = NUM(0);
    path->done = (self->rows == 0u) || (!all && short_inverse(self, self->rows, tolerance, &path->ratio, saturations));
    if (path->done) {
        return;
    }
    const num_t negligible = negligible_beside(self, saturations);
    bool through = true;
    while (!path->done && (path->sweeps < BIDIAGONAL_MAX_SWEEPS)) {
        const block_t block = block_of(self, path->open_rows - 1u, negligible);
        if (block.first == block.last) {
            --path->open_rows;
            path->ratio = NUM(0);
            path->done = (path->open_rows == 0u) ||
                         (!all && short_inverse(self, path->open_rows, tolerance, &path->ratio, saturations));
        } else {
            const bool shifted = through && wants_shift(self, block, path->sweeps, saturations);
            const num_wide_t shift = shifted ? shift_of(self, block) : num_widen(NUM(0));
            through = sweep(self, path, block, shift, shifted, negligible, saturations);
        }
    }
}

static void rotate_pairs_back(bidiagonal_rotation_t rotation, uint32_t count, num_t vector[][BIDIAGONAL_MAX_ROWS]) {
    for (uint32_t v = 0; v < count; ++v) {
        num_t *const pair = &vector[v][rotation.first];
        const num_t first = pair[0];
        const num_t second = pair[1];
        pair[0] = num_unit_turned(rotation.cos, -rotation.sin, first, second);
        pair[1] = num_unit_turned(rotation.sin, rotation.cos, first, second);
    }
}

void bidiagonal_rotate_back(const bidiagonal_path_t *path, uint32_t count, num_t vector[][BIDIAGONAL_MAX_ROWS]) {
    for (uint32_t r = path->rotations; r-- > 0u;) {
        rotate_pairs_back(path->rotation[r], count, vector);
    }
}
