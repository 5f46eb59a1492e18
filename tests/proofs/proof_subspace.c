/* firmware/core/subspace.c: any columns of any numbers. Each step is shown alone, for each constant `at`; the next one
 * up calls stubs that assert what the step requires (proofs.toml). bidiagonal.h: proof_bidiagonal.c. */
#include "reflector_stub.h"
#include "stub_object.h"

/* Each product of subspace.c has an entry of a reflector or of a direction as a factor. */
static inline num_wide_t stub_small(num_t a, num_t b) {
    HOLDS(stub_either(a, b, 23u), "a factor below 2");
    return stub_product(54u);
}

#undef num_wide
#define num_wide(a, b) stub_small((a), (b))
#define num_widen(a)   ((void)(a), stub_product(53u))

#include "subspace.c"

static subspace_t self;
static work_t work;
static num_t columns[COLUMNS][ROBOT_MAX_JOINTS], vector[ROBOT_MAX_JOINTS];
static uint32_t n, k, saturations;

/* The directions that subspace_reject removes have entries below 2: rotations keep the length 1 (proofs.md). */
static bool directions_are_made(void) {
    bool made = true;
    for (uint32_t d = 0; d < COLUMNS; ++d) {
        for (uint32_t i = 0; i < COLUMNS; ++i) {
            made = made && stub_below(self.unexplained[d][i], 23u);
        }
    }
    return made;
}

static bool is_made(void) {
    bool made = (self.directions <= COLUMNS) && (self.rank <= self.directions);
    for (uint32_t d = 0; d < COLUMNS; ++d) {
        made = made && is_reflector(self.reflector[d], d);
    }
    return made;
}

static void any_step(void) {
    __CPROVER_havoc_object(&self);
    __CPROVER_havoc_object(&work);
    __CPROVER_havoc_object(columns);
    __CPROVER_havoc_object(vector);
    __CPROVER_havoc_object(&n);
    __CPROVER_havoc_object(&k);
    __CPROVER_havoc_object(&saturations);
    ASSUME((n >= 1u) && (n <= ROWS) && (k <= COLUMNS));
}

void proof_subspace_clear_row(void) {
    any_step();
    ASSUME(k >= 3u);
    clear_row(&work, k, 0, &saturations);
    REACHED;
}

void proof_subspace_clear_rows(void) {
    any_step();
    ASSUME(k >= 4u);
    clear_row(&work, k, 1, &saturations);
    ASSUME(k >= 5u);
    clear_row(&work, k, 2, &saturations);
    ASSUME(k >= 6u);
    clear_row(&work, k, 3, &saturations);
    REACHED;
}

/* Instead of clear_row. It leaves the entries alone: they are any numbers already. */
void stub_clear_row(work_t *of, uint32_t count, uint32_t at, uint32_t *sat) {
    HOLDS(((at + 2u) < count) && (count <= COLUMNS) && (sat != NULL), "a row beyond whose next entry is another one");
    HOLDS(__CPROVER_w_ok(of, sizeof(*of)), "the room to work in");
}

static void clear_at(const num_t from[][ROBOT_MAX_JOINTS], const uint32_t at) {
    clear_column_and_row(&self, &work, k, from, at);
    HOLDS((at >= self.directions) || is_reflector(self.reflector[at], at), "a reflector");
}

/* The first step reads the columns themselves, or scaled ones. */
void proof_subspace_clear_column(void) {
    any_step();
    ASSUME((self.directions <= k) && (self.directions <= n));
    clear_at((const num_t(*)[ROBOT_MAX_JOINTS])columns, 0);
    clear_at((const num_t(*)[ROBOT_MAX_JOINTS])work.column, 0);
    REACHED;
}

void proof_subspace_clear_columns(void) {
    any_step();
    ASSUME((self.directions <= k) && (self.directions <= n));
    const num_t(*const reduced)[ROBOT_MAX_JOINTS] = (const num_t(*)[ROBOT_MAX_JOINTS])work.column;
    clear_at(reduced, 1);
    clear_at(reduced, 2);
    clear_at(reduced, 3);
    clear_at(reduced, 4);
    clear_at(reduced, 5);
    REACHED;
}

void proof_subspace_scaled(void) {
    any_step();
    const num_t(*const from)[ROBOT_MAX_JOINTS] =
        scaled_columns(&self, &work, k, (const num_t(*)[ROBOT_MAX_JOINTS])columns);
    HOLDS((from == (const num_t(*)[ROBOT_MAX_JOINTS])columns) ||
              (from == (const num_t(*)[ROBOT_MAX_JOINTS])work.column),
          "the columns, or scaled ones");
    HOLDS((work.headroom >= -4) && (work.headroom <= 26), "a shift");
    work.bidiagonal.rows = k;
    HOLDS(made_of_numbers(&work.bidiagonal), "fixed-point numbers are finite");
    REACHED;
}

void proof_subspace_directions(void) {
    uint32_t count;
    any_step();
    ASSUME(is_made() && (count <= COLUMNS));
    into_directions(&self, count, vector);
    out_of_directions(&self, count, vector);
    REACHED;
}

/* Instead of the two. */
void stub_directions(subspace_t *of, uint32_t count, num_t x[]) {
    HOLDS((count <= COLUMNS) && __CPROVER_r_ok(of, sizeof(*of)), "the reflectors");
    stub_object(x, ROWS * sizeof(*x));
}

void proof_subspace_factor(void) {
    int32_t headroom;
    any_step();
    ASSUME(is_made() && (headroom >= -4) && (headroom <= 26));
    factor(&self, (const num_t(*)[ROBOT_MAX_JOINTS])columns, headroom);
    HOLDS(is_made(), "the reflectors");
    REACHED;
}

void proof_subspace_explained(void) {
    any_step();
    ASSUME((self.directions <= COLUMNS) && (self.rank <= self.directions) && directions_are_made());
    clear_explained(&self, vector);
    REACHED;
}

/* Instead of clear_explained. */
void stub_explained(subspace_t *of, num_t x[]) {
    HOLDS((of->directions <= COLUMNS) && (of->rank <= of->directions), "the directions");
    stub_object(x, of->directions * sizeof(*x));
}

void proof_subspace_reject(void) {
    any_step();
    num_t rejected[ROBOT_MAX_JOINTS];
    ASSUME((self.directions <= COLUMNS) && (self.rank <= self.directions));
    subspace_reject(&self, vector, rejected);
    subspace_reject(&self, vector, vector);
    subspace_init(&self);
    HOLDS(is_made() && directions_are_made(), "nothing is explained at first");
    REACHED;
}

/* Instead of the functions that the whole step calls. */
const num_t (*stub_scaled(subspace_t *of, work_t *to, uint32_t count,
                          const num_t column[][ROBOT_MAX_JOINTS]))[ROBOT_MAX_JOINTS] {
    int32_t headroom;
    HOLDS(__CPROVER_w_ok(of, sizeof(*of)), "the projector is there");
    stub_columns(count, column);
    ASSUME((headroom >= -4) && (headroom <= 26));
    to->headroom = headroom;
    return (headroom == 0) ? column : (const num_t(*)[ROBOT_MAX_JOINTS])to->column;
}

void stub_clear_column(subspace_t *of, work_t *in, uint32_t count, const num_t from[][ROBOT_MAX_JOINTS], uint32_t at) {
    HOLDS((at < COLUMNS) && (of->directions <= count) && (of->directions <= ROWS), "a step");
    HOLDS(__CPROVER_w_ok(in, sizeof(*in)), "the room to work in");
    stub_columns(count, from);
}

void stub_factor(subspace_t *of, const num_t column[][ROBOT_MAX_JOINTS], int32_t headroom) {
    HOLDS((headroom >= -4) && (headroom <= 26), "a shift");
    stub_columns(of->directions, column);
}

void bidiagonal_square(bidiagonal_t *b, uint32_t *sat) {
    HOLDS((b->rows >= 1u) && (b->rows <= BIDIAGONAL_MAX_ROWS) && (sat != NULL), "rows with an entry beyond");
}

void bidiagonal_diagonalise(bidiagonal_t *b, num_t tolerance, bool all, bidiagonal_path_t *path, uint32_t *sat) {
    uint32_t rotations, sweeps, open_rows;
    num_t ratio;
    bool done;
    (void)tolerance;
    (void)all;
    (void)sat;
    HOLDS(b->rows <= BIDIAGONAL_MAX_ROWS, "rows of a matrix");
    ASSUME((rotations <= BIDIAGONAL_MAX_ROTATIONS) && (sweeps <= BIDIAGONAL_MAX_SWEEPS) && (open_rows <= b->rows));
    path->rotations = rotations;
    path->sweeps = sweeps;
    path->open_rows = open_rows;
    path->ratio = ratio;
    path->done = done;
}

void bidiagonal_rotate_back(const bidiagonal_path_t *path, uint32_t count, num_t of[][BIDIAGONAL_MAX_ROWS]) {
    HOLDS(path->rotations <= BIDIAGONAL_MAX_ROTATIONS, "the rotations of a path");
    HOLDS((count <= BIDIAGONAL_MAX_ROWS) && __CPROVER_w_ok(of, count * sizeof(*of)), "the vectors are there");
}

/* The matrix has any entries, as the stubs leave them alone. */
void proof_subspace(void) {
    num_t tolerance, singular[COLUMNS];
    any_step();
    subspace_step(&self, n, k, (const num_t(*)[ROBOT_MAX_JOINTS])columns, tolerance);
    HOLDS((self.directions <= COLUMNS) && (self.rank <= self.directions), "as many directions as are explained");
    subspace_measure(&self, n, k, (const num_t(*)[ROBOT_MAX_JOINTS])columns, tolerance, singular);
    REACHED;
}
