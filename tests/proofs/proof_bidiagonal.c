/* firmware/core/bidiagonal.c: any matrix of any numbers. */
#include "num_sizes.h"

#include "bidiagonal.c"

enum { PAIRS = BIDIAGONAL_MAX_ROWS - 1u };

static bool block_is_valid(const bidiagonal_t *b, block_t block) {
    return (block.first < block.last) && (block.last < b->rows) && (b->rows <= BIDIAGONAL_MAX_ROWS);
}

static bool path_has_room(const bidiagonal_path_t *path) {
    return (path->sweeps < BIDIAGONAL_MAX_SWEEPS) && (path->rotations <= (path->sweeps * PAIRS));
}

static bool is_unit(num_unit_t a) {
    return (a >= -1073741830) && (a <= 1073741830);
}

/* What bidiagonal_rotate_back and a projector rely on. */
static bool is_rotation(const bidiagonal_rotation_t *rotation) {
    return (rotation->first < PAIRS) && is_unit(rotation->cos) && is_unit(rotation->sin);
}

/* Any block of any matrix, in the last sweep that the path has room for: an earlier one writes to a lower index. */
void proof_bidiagonal_sweep(void) {
    bidiagonal_t b;
    bidiagonal_path_t path;
    block_t block;
    int64_t shift;
    num_t negligible;
    bool shifted;
    uint32_t saturations;
    ASSUME(block_is_valid(&b, block));
    const uint32_t rows = b.rows, open_rows = path.open_rows;
    const uint32_t first = (BIDIAGONAL_MAX_SWEEPS - 1u) * PAIRS;
    path.sweeps = BIDIAGONAL_MAX_SWEEPS - 1u;
    path.rotations = first;
    path.done = false;
    (void)sweep(&b, &path, block, shift, shifted, negligible, &saturations);
    HOLDS((b.rows == rows) && (path.open_rows == open_rows) && !path.done, "what the iteration counts stays");
    HOLDS(path.sweeps == BIDIAGONAL_MAX_SWEEPS, "one sweep more");
    HOLDS(path.rotations == (first + (block.last - block.first)), "a rotation for each pair of rows");
    for (uint32_t r = 0; r < PAIRS; ++r) {
        HOLDS(((first + r) >= path.rotations) || is_rotation(&path.rotation[first + r]), "a rotation of two rows");
    }
    REACHED;
}

void proof_bidiagonal_block(void) {
    bidiagonal_t b;
    uint32_t last, sweeps, saturations;
    num_t negligible;
    ASSUME((b.rows <= BIDIAGONAL_MAX_ROWS) && (last < b.rows));
    const uint32_t rows = b.rows;
    const block_t block = block_of(&b, last, negligible);
    HOLDS((block.first <= block.last) && (block.last == last), "a block of these rows");
    HOLDS(b.rows == rows, "the rows stay");
    (void)wants_shift(&b, block, sweeps, &saturations);
    ASSUME(block.first < block.last);
    (void)shift_of(&b, block);
    REACHED;
}

void proof_bidiagonal_negligible(void) {
    bidiagonal_t b;
    uint32_t saturations;
    ASSUME(b.rows <= BIDIAGONAL_MAX_ROWS);
    (void)negligible_beside(&b, &saturations);
    REACHED;
}

void proof_bidiagonal_short_inverse(void) {
    bidiagonal_t b;
    uint32_t rows, saturations;
    num_t tolerance, ratio;
    ASSUME((b.rows <= BIDIAGONAL_MAX_ROWS) && (rows <= b.rows));
    (void)short_inverse(&b, rows, tolerance, &ratio, &saturations);
    REACHED;
}

/* Instead of these functions in the iteration (proofs.toml). */
static const bidiagonal_path_t *iterated;
static uint32_t turn; /* of the iteration */

block_t stub_block(bidiagonal_t *self, uint32_t last, num_t negligible) {
    block_t block;
    (void)negligible;
    HOLDS((self->rows <= BIDIAGONAL_MAX_ROWS) && (last < self->rows), "the last row of a block");
    ASSUME((block.first <= block.last) && (block.last == last));
    const uint32_t open_rows = iterated->open_rows;
    const bool counted = (open_rows >= 1u) && (open_rows <= self->rows) && (iterated->sweeps < BIDIAGONAL_MAX_SWEEPS) &&
                         ((iterated->sweeps + (self->rows - open_rows)) == turn);
    HOLDS(counted, "each turn is a sweep or ends a row");
    ASSUME(counted);
    ++turn;
    return block;
}

bool stub_wants(const bidiagonal_t *self, block_t block, uint32_t sweeps, uint32_t *saturations) {
    bool wants;
    (void)sweeps;
    (void)saturations;
    HOLDS(block_is_valid(self, block), "a block of the matrix");
    return wants;
}

num_wide_t stub_shift_of(const bidiagonal_t *self, block_t block) {
    int64_t shift;
    HOLDS(block_is_valid(self, block), "a block of the matrix");
    return shift;
}

bool stub_short(const bidiagonal_t *self, uint32_t rows, num_t tolerance, num_t *ratio, uint32_t *saturations) {
    num_t any;
    bool is_short;
    (void)tolerance;
    (void)saturations;
    HOLDS((self->rows <= BIDIAGONAL_MAX_ROWS) && (rows <= self->rows), "rows of the matrix");
    *ratio = any;
    return is_short;
}

num_t stub_negligible(const bidiagonal_t *self, uint32_t *saturations) {
    HOLDS(self->rows <= BIDIAGONAL_MAX_ROWS, "rows of the matrix");
    return stub_number(saturations);
}

bool stub_sweep(bidiagonal_t *self, bidiagonal_path_t *path, block_t block, num_wide_t shift, bool shifted,
                num_t negligible, uint32_t *saturations) {
    bool through;
    uint32_t any;
    (void)shift;
    (void)shifted;
    (void)negligible;
    (void)saturations;
    HOLDS(block_is_valid(self, block), "a block of the matrix");
    HOLDS(path_has_room(path), "the path has room");
    const uint32_t rotations = path->rotations + (block.last - block.first);
    ++path->sweeps;
    HOLDS(rotations <= (path->sweeps * PAIRS), "a sweep has a rotation for each pair of rows");
    ASSUME(any <= (path->sweeps * PAIRS));
    path->rotations = any;
    return through;
}

/* The stubs leave the entries of the matrix alone, because no other function of the iteration reads them. */
void proof_bidiagonal(void) {
    bidiagonal_t b;
    bidiagonal_path_t path;
    num_t tolerance;
    uint32_t saturations;
    bool all;
    ASSUME(b.rows <= BIDIAGONAL_MAX_ROWS);
    iterated = &path;
    turn = 0;
    bidiagonal_diagonalise(&b, tolerance, all, &path, &saturations);
    HOLDS(path.rotations <= BIDIAGONAL_MAX_ROTATIONS, "the rotations fit");
    HOLDS((path.sweeps <= BIDIAGONAL_MAX_SWEEPS) && (path.open_rows <= b.rows), "the path fits");
    REACHED;
}

void proof_bidiagonal_square(void) {
    bidiagonal_t b;
    uint32_t saturations;
    ASSUME((b.rows >= 1u) && (b.rows <= BIDIAGONAL_MAX_ROWS));
    bidiagonal_square(&b, &saturations);
    REACHED;
}

void proof_bidiagonal_pairs(void) {
    bidiagonal_rotation_t rotation;
    num_t vector[BIDIAGONAL_MAX_ROWS][BIDIAGONAL_MAX_ROWS];
    uint32_t count;
    ASSUME((count <= BIDIAGONAL_MAX_ROWS) && is_rotation(&rotation));
    rotate_pairs_back(rotation, count, vector);
    REACHED;
}

/* Instead of rotate_pairs_back. That each rotation of a path is one of two rows: proof_bidiagonal_sweep. */
void stub_pairs(bidiagonal_rotation_t rotation, uint32_t count, num_t vector[][BIDIAGONAL_MAX_ROWS]) {
    (void)rotation;
    HOLDS((count <= BIDIAGONAL_MAX_ROWS) && __CPROVER_w_ok(vector, count * sizeof(*vector)), "the vectors are there");
}

void proof_bidiagonal_rotate_back(void) {
    bidiagonal_path_t path;
    num_t vector[BIDIAGONAL_MAX_ROWS][BIDIAGONAL_MAX_ROWS];
    uint32_t count;
    ASSUME((count <= BIDIAGONAL_MAX_ROWS) && (path.rotations <= BIDIAGONAL_MAX_ROTATIONS));
    bidiagonal_rotate_back(&path, count, vector);
    REACHED;
}
