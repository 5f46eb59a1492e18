/* firmware/core/jacobi.c: columns of any numbers. After the shift by the headroom every entry is within 32, so the sum
 * of all squares is at most 48 * 32^2. A rotation keeps this sum: no entry is beyond 32 sqrt(48) = 222, and no inner
 * product of two columns is beyond 222^2, far below 2^18 (proofs.md). The rotation itself: proof_square.c. */
#include "num_sizes.h"
#include "soft.h"
#include "square_any.h"
#include "stub_object.h"

#define ENTRY_BITS     30u /* a column's entry is below 256 */
#define DIRECTION_BITS 23u /* a direction's entry is below 2 */

static bool stub_unit(num_unit_t a) {
    const int32_t one = (int32_t)1 << 30;
    return (a >= -one) && (a <= one);
}

/* Two entries below 256, of which a sum may hold eight; or one factor below 2. */
static inline num_wide_t jacobi_wide(num_t a, num_t b) {
    const bool by_direction = stub_either(a, b, DIRECTION_BITS);
    HOLDS(by_direction || stub_both(a, b, ENTRY_BITS), "a product of entries below 256, or with a factor below 2");
    const num_wide_t any = by_direction ? stub_product(54u) : stub_product(60u);
    return ((a == b) && (any < 0)) ? (-1 - any) : any;
}

/* A rotation keeps the length of the pair (first, second): the result is an entry again. */
static inline num_t jacobi_turned(num_unit_t cosine, num_unit_t sine, num_t first, num_t second) {
    num_t result;
    HOLDS(stub_unit(cosine) && stub_unit(sine), "a cosine and a sine");
    HOLDS(stub_both(first, second, ENTRY_BITS), "entries below 256");
    ASSUME(stub_below(result, ENTRY_BITS));
    return result;
}

/* A number over the length of its vector, or more, is at most 1 but for rounding (enumerate_newton.c). stub_scale
 * asserts that the inverse is such a one. */
static inline num_t jacobi_times(num_t a, uint32_t *saturations) {
    num_t result;
    HOLDS(stub_below(a, ENTRY_BITS), "an entry below 256");
    *saturations += 0u;
    ASSUME(stub_below(result, DIRECTION_BITS));
    return result;
}

/* A shift keeps the sign: proof_num_shift. */
static inline num_t jacobi_shifted(num_t a, int32_t shift, uint32_t *sat) {
    const num_t result = stub_shifted(a, shift, sat);
    ASSUME(((a < 0) || (result >= 0)) && ((a > 0) || (result <= 0)));
    return result;
}

static num_wide_t under; /* the last inverse root */

static inline num_inverse_t jacobi_inverse(num_wide_t square) {
    under = square;
    return stub_inverse(square);
}

#undef num_wide
#undef num_root
#undef num_inverse_root
#undef num_times
#undef num_unit_turned
#undef num_shift
#define num_wide(a, b)                               jacobi_wide((a), (b))
#define num_widen(a)                                 (((a) == 0) ? 0 : stub_product(53u))
#define num_root(square)                             stub_sized_root(square)
#define num_inverse_root(square)                     jacobi_inverse(square)
#define num_times(a, inverse, saturations)           ((void)(inverse), jacobi_times((a), (saturations)))
#define num_shift(a, shift, saturations)             jacobi_shifted((a), (shift), (saturations))
#define num_unit_turned(cosine, sine, first, second) jacobi_turned((cosine), (sine), (first), (second))

#include "jacobi.c"

static jacobi_t jacobi;
static num_t columns[COLUMNS][ROBOT_MAX_JOINTS], torque[ROBOT_MAX_JOINTS], rejected[ROBOT_MAX_JOINTS];
static uint32_t saturations;

static bool are_below(const num_t x[], uint32_t bits) {
    bool below = true;
    for (uint32_t i = 0; i < (uint32_t)ROWS; ++i) {
        below = below && stub_below(x[i], bits);
    }
    return below;
}

static bool directions_are_below(uint32_t count, uint32_t bits) {
    bool below = true;
    for (uint32_t c = 0; c < (uint32_t)COLUMNS; ++c) {
        below = below && ((c >= count) || are_below(jacobi.direction[c], bits));
    }
    return below;
}

static void any_jacobi(void) {
    __CPROVER_havoc_object(&jacobi);
    __CPROVER_havoc_object(columns);
    __CPROVER_havoc_object(torque);
    __CPROVER_havoc_object(&saturations);
}

static bool is_number_of_columns(uint32_t k) {
    return k <= (uint32_t)COLUMNS;
}

void proof_jacobi_init(void) {
    any_jacobi();
    jacobi_init(&jacobi);
    HOLDS((jacobi.columns == 0u) && (jacobi.rank == 0u), "no column at first");
    REACHED;
}

static num_t maximum;                            /* so far: it never decreases (stub_join) */
static num_t joined[COLUMNS * ROBOT_MAX_JOINTS]; /* what it was compared with */
static uint32_t joined_count, shifted_count;

/* Instead of num_max: one step of the search for the maximum. So the maximum is no less than each number of `joined`,
 * which CBMC does not decide for 48 of them at once. */
num_t stub_join(num_t a, num_t b) {
    const num_t result = (b > a) ? b : a;
    HOLDS(a == maximum, "the search continues with the maximum");
    HOLDS((result >= a) && (result >= b), "a maximum is no less than both");
    joined[joined_count] = b;
    ++joined_count;
    maximum = result;
    return result;
}

/* Instead of stub_shifted: a number up to a size, shifted by the headroom of that size, is at most 32. */
num_t stub_joined(num_t a, int32_t shift, uint32_t *sat) {
    HOLDS((shift == headroom) && (headroom_size == maximum), "the headroom of the maximum");
    HOLDS(num_abs(a) == joined[shifted_count], "a number that was compared with the maximum");
    ++shifted_count;
    stub_shift(shift);
    return stub_saturated(NUM(32), sat);
}

/* Any columns, each number of them as a constant. */
void proof_jacobi_take(void) {
    for (uint32_t k = 0; k <= (uint32_t)COLUMNS; ++k) {
        num_t bound;
        any_jacobi();
        ASSUME(bound >= 0);
        maximum = bound;
        joined_count = 0;
        shifted_count = 0;
        const int32_t room = take_columns(&jacobi, k, (const num_t(*)[ROBOT_MAX_JOINTS])columns, bound);
        HOLDS(directions_are_below(k, 28u), "every entry is within 32");
        HOLDS((room == headroom) && (headroom_size == maximum), "the headroom of the maximum");
        HOLDS((joined_count == (8u * k)) && (shifted_count == joined_count), "every entry");
    }
    REACHED;
}

/* Instead of take_columns (proofs.toml). */
int32_t stub_take(jacobi_t *self, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t bound) {
    HOLDS(bound >= 0, "a bound");
    stub_columns(k, column);
    stub_object(self->direction, sizeof(self->direction));
    ASSUME((headroom >= -31) && (headroom <= 31) && (headroom_size >= bound));
    ASSUME(directions_are_below(k, 28u));
    return headroom;
}

void proof_jacobi_inner(void) {
    any_jacobi();
    ASSUME(directions_are_below(2u, ENTRY_BITS));
    (void)inner(jacobi.direction[0], jacobi.direction[1]);
    HOLDS(inner(jacobi.direction[0], jacobi.direction[0]) >= 0, "a square is not negative");
    ASSUME(directions_are_below(1u, DIRECTION_BITS));
    (void)inner(jacobi.direction[0], torque);
    REACHED;
}

static num_wide_t length[COLUMNS]; /* of each direction, squared */

/* Instead of inner: of columns. No inner product is beyond 222^2, because rotations keep lengths. */
num_wide_t stub_inner(const num_t x[], const num_t y[]) {
    const num_wide_t product = stub_product(62u);
    HOLDS(are_below(x, ENTRY_BITS) && are_below(y, ENTRY_BITS), "columns");
    ASSUME((x != y) || (product >= 0));
    for (uint32_t c = 0; c < (uint32_t)COLUMNS; ++c) {
        if ((x == y) && (x == jacobi.direction[c])) {
            length[c] = product;
        }
    }
    return product;
}

/* Instead of inner: of a direction and a torque, eight products below 2^54. */
num_wide_t stub_along(const num_t x[], const num_t y[]) {
    HOLDS(are_below(x, DIRECTION_BITS), "a direction");
    HOLDS(__CPROVER_r_ok(y, ROWS * sizeof(*y)), "the torque is there");
    return stub_product(57u);
}

void proof_jacobi_turn(void) {
    num_unit_t a, b, c, d;
    any_jacobi();
    ASSUME(stub_unit(a) && stub_unit(b) && stub_unit(c) && stub_unit(d));
    ASSUME(directions_are_below(2u, ENTRY_BITS));
    turn(a, b, c, d, jacobi.direction[0], jacobi.direction[1]);
    HOLDS(directions_are_below(2u, ENTRY_BITS), "entries below 256");
    REACHED;
}

/* Instead of turn. */
void stub_turn(num_unit_t a, num_unit_t b, num_unit_t c, num_unit_t d, num_t x[], num_t y[]) {
    HOLDS(stub_unit(a) && stub_unit(b) && stub_unit(c) && stub_unit(d), "cosines and sines");
    HOLDS(are_below(x, ENTRY_BITS) && are_below(y, ENTRY_BITS) && (x != y), "two columns");
    stub_object(x, ROWS * sizeof(*x));
    stub_object(y, ROWS * sizeof(*y));
    ASSUME(are_below(x, ENTRY_BITS) && are_below(y, ENTRY_BITS));
}

/* Instead of square_orthogonalise: proof_square_orthogonalise. */
num_rotation_t stub_orthogonalise(square_t *longer, square_t *shorter, num_wide_t along) {
    num_rotation_t by;
    HOLDS(is_square(*longer) && is_square(*shorter) && !square_is_longer(*shorter, *longer), "the longer one first");
    HOLDS(along > INT64_MIN, "an inner product");
    *longer = any_square();
    *shorter = any_square();
    ASSUME((by.cos >= ((int32_t)1 << 29)) && stub_unit(by.cos) && stub_unit(by.sin));
    return by;
}

static bool pair_is_below(uint32_t p, uint32_t q) {
    return are_below(jacobi.direction[p], ENTRY_BITS) && are_below(jacobi.direction[q], ENTRY_BITS);
}

/* Each pair of columns, as constants. */
void proof_jacobi_rotate(void) {
    for (uint32_t p = 0; p < (uint32_t)COLUMNS; ++p) {
        for (uint32_t q = p + 1u; q < (uint32_t)COLUMNS; ++q) {
            square_t square[COLUMNS];
            num_wide_t along;
            any_jacobi();
            square[p] = any_square();
            square[q] = any_square();
            ASSUME((along > INT64_MIN) && pair_is_below(p, q));
            rotate(&jacobi, square, p, q, along, square_is_longer(square[q], square[p]));
            HOLDS(is_square(square[p]) && is_square(square[q]), "two squares");
            HOLDS(pair_is_below(p, q), "entries below 256");
        }
    }
    REACHED;
}

/* Instead of rotate. */
void stub_rotate(jacobi_t *self, square_t square[], uint32_t p, uint32_t q, num_wide_t along, bool swap) {
    HOLDS((p < q) && (q < (uint32_t)COLUMNS), "two columns");
    HOLDS(is_square(square[p]) && is_square(square[q]), "two squares");
    HOLDS((swap == square_is_longer(square[q], square[p])) && (along > INT64_MIN), "the longer one, an inner product");
    HOLDS(are_below(self->direction[p], ENTRY_BITS) && are_below(self->direction[q], ENTRY_BITS), "entries below 256");
    stub_object(self->direction[p], sizeof(self->direction[p]));
    stub_object(self->direction[q], sizeof(self->direction[q]));
    ASSUME(are_below(self->direction[p], ENTRY_BITS) && are_below(self->direction[q], ENTRY_BITS));
    square[p] = any_square();
    square[q] = any_square();
}

/* Each number of columns as a constant. */
static void sweep_once(uint32_t k) {
    num_t bound;
    any_jacobi();
    ASSUME((bound >= 0) && (bound <= NUM(32)) && directions_are_below(k, ENTRY_BITS));
    const found_t found = sweep(&jacobi, k, bound);
    HOLDS(!found.settled || found.close, "what has settled is close");
    HOLDS(directions_are_below(k, ENTRY_BITS), "entries below 256");
}

void proof_jacobi_sweep(void) {
    for (uint32_t k = 0; k <= (uint32_t)COLUMNS; ++k) {
        sweep_once(k);
    }
    REACHED;
}

/* Instead of sweep. */
found_t stub_sweep(jacobi_t *self, uint32_t k, num_t bound) {
    found_t found;
    HOLDS(is_number_of_columns(k) && (bound >= 0) && (bound <= NUM(32)), "columns and a bound");
    HOLDS(directions_are_below(k, ENTRY_BITS), "entries below 256");
    stub_object(self->direction, sizeof(self->direction));
    ASSUME(directions_are_below(k, ENTRY_BITS));
    return found;
}

void proof_jacobi_numbers(void) {
    num_wide_t square[COLUMNS];
    uint32_t k;
    ASSUME(is_number_of_columns(k));
    HOLDS(made_of_numbers(square, k), "a fixed-point number is finite");
    REACHED;
}

/* Instead of made_of_numbers. */
bool stub_numbers(const num_wide_t square[], uint32_t k) {
    bool finite;
    HOLDS(__CPROVER_r_ok(square, k * sizeof(*square)), "the squares are there");
    return finite;
}

void proof_jacobi_sort(void) {
    num_t singular[COLUMNS];
    uint32_t k;
    ASSUME(is_number_of_columns(k));
    sort(singular, k);
    for (uint32_t c = 1; c < k; ++c) {
        HOLDS(singular[c - 1u] >= singular[c], "the largest first");
    }
    REACHED;
}

/* Instead of sort. */
void stub_sort(num_t singular[], uint32_t k) {
    HOLDS(is_number_of_columns(k), "the values are there");
    stub_object(singular, COLUMNS * sizeof(*singular));
}

void proof_jacobi_scale(void) {
    num_inverse_t inverse;
    any_jacobi();
    ASSUME(are_below(jacobi.direction[0], ENTRY_BITS));
    scale(jacobi.direction[0], inverse, &saturations);
    HOLDS(are_below(jacobi.direction[0], DIRECTION_BITS), "a direction");
    REACHED;
}

/* Instead of scale. */
void stub_scale(num_t x[], num_inverse_t inverse, uint32_t *sat) {
    HOLDS(are_below(x, ENTRY_BITS), "a column");
    for (uint32_t c = 0; c < (uint32_t)COLUMNS; ++c) {
        HOLDS((x != jacobi.direction[c]) || (inverse.mantissa == 0u) || (under >= length[c]),
              "the inverse of the column's length, or of more");
    }
    *sat += 0u;
    stub_object(x, ROWS * sizeof(*x));
    ASSUME(are_below(x, DIRECTION_BITS));
}

/* Any tolerance without a softness, or any softness: each number of columns as a constant. */
void proof_jacobi_decompose(void) {
    for (uint32_t k = 0; k <= (uint32_t)COLUMNS; ++k) {
        uint32_t n;
        num_t tolerance, s;
        any_jacobi();
        __CPROVER_havoc_object(&headroom);
        __CPROVER_havoc_object(&headroom_size);
        ASSUME(s >= 0);
        decompose(&jacobi, n, k, (const num_t(*)[ROBOT_MAX_JOINTS])columns, tolerance, s);
        HOLDS((jacobi.columns <= k) && (jacobi.directions <= k) && (jacobi.rank <= k), "no more than there are");
        HOLDS(directions_are_below(jacobi.columns, DIRECTION_BITS), "directions");
        HOLDS(jacobi.converged || (jacobi.rank == 0u), "nothing is explained without convergence");
    }
    REACHED;
}

/* Instead of decompose. */
void stub_decompose(jacobi_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t tolerance,
                    num_t s) {
    stub_columns(k, column);
    HOLDS(s >= 0, "a softness");
    stub_object(self, sizeof(*self));
}

void proof_jacobi_steps(void) {
    uint32_t n, k;
    num_t tolerance, s;
    any_jacobi();
    ASSUME(is_number_of_columns(k) && (s >= NUM(SOFT_MIN)) && (s <= NUM(1)));
    jacobi_hard(&jacobi, n, k, (const num_t(*)[ROBOT_MAX_JOINTS])columns, tolerance);
    jacobi_soft(&jacobi, n, k, (const num_t(*)[ROBOT_MAX_JOINTS])columns, s);
    REACHED;
}

void proof_jacobi_reject(void) {
    any_jacobi();
    ASSUME(is_number_of_columns(jacobi.columns) && directions_are_below(jacobi.columns, DIRECTION_BITS));
    jacobi_reject(&jacobi, torque, rejected);
    jacobi_reject(&jacobi, torque, torque);
    REACHED;
}
