/* firmware/core/soft.c: any torque, and columns as the other stages leave them. make is a stub: proof_soft_make.c. */
#include "num_sizes.h"
#include "stub_object.h"

/* A column of R has the length of a column and s: no entry is beyond 64 sqrt(8) + 1. */
#define SOFT_MOST 805306368 /* 192 */

/* Each product of reflect has an entry below 2 as a factor; each other one in a sum is by an entry of R, or a square
 * after the shift by num_headroom. */
static inline num_wide_t stub_square(uint32_t bits) {
    const num_wide_t any = stub_product(bits);
    return (any < 0) ? (-1 - any) : any;
}

static inline num_wide_t soft_wide(num_t a, num_t b) {
    if (stub_either(a, b, 23u)) {
        return stub_product(54u);
    }
    if (stub_both(a, b, 28u)) {
        return (a == b) ? stub_square(56u) : stub_product(56u);
    }
    if ((a >= -SOFT_MOST) && (a <= SOFT_MOST)) {
        return stub_product(60u) + stub_product(59u); /* 192 * 512 is 3 * 2^15 */
    }
    return (a == b) ? stub_square(62u) : stub_product(62u);
}

#undef num_wide
#define num_wide(a, b) soft_wide((a), (b))
#define num_widen(a)   ((void)(a), stub_product(53u))

#include "soft.c"

static soft_t soft;
static num_t columns[COLUMNS][ROBOT_MAX_JOINTS], torque[ROBOT_MAX_JOINTS], rejected[ROBOT_MAX_JOINTS];
static num_t first_rejected[ROBOT_MAX_JOINTS], s;
static uint32_t saturations, count;

static bool is_unit(const num_t u[]) {
    bool below = true;
    for (uint32_t i = 0; i < (uint32_t)ROWS; ++i) {
        below = below && stub_below(u[i], 23u);
    }
    return below;
}

static void any_soft(void) {
    __CPROVER_havoc_object(&soft);
    __CPROVER_havoc_object(columns);
    __CPROVER_havoc_object(torque);
    __CPROVER_havoc_object(rejected);
    __CPROVER_havoc_object(first_rejected);
    __CPROVER_havoc_object(&s);
    __CPROVER_havoc_object(&saturations);
    __CPROVER_havoc_object(&count);
    ASSUME((soft.columns <= (uint32_t)COLUMNS) && (count <= (uint32_t)COLUMNS));
    ASSUME((s >= NUM(SOFT_MIN)) && (s <= NUM(1)));
}

void proof_soft_reflect(void) {
    any_soft();
    ASSUME(is_unit(soft.reflector[0]));
    (void)reflect(soft.reflector[0], torque, rejected, &saturations);
    (void)reflect(soft.reflector[0], torque, torque, &saturations);
    REACHED;
}

/* Instead of reflect (proofs.toml). */
num_t stub_reflect(const num_t u[], const num_t from[], num_t to[], uint32_t *sat) {
    HOLDS(__CPROVER_r_ok(u, ROWS * sizeof(*u)) && __CPROVER_r_ok(from, ROWS * sizeof(*from)), "the vectors are there");
    HOLDS(__CPROVER_w_ok(to, ROWS * sizeof(*to)), "the result is there");
    for (uint32_t i = 0; i < (uint32_t)ROWS; ++i) {
        to[i] = stub_number(sat);
    }
    return stub_number(sat);
}

void proof_soft_reject(void) {
    uint32_t first;
    any_soft();
    ASSUME(first <= (uint32_t)COLUMNS);
    soft_reject(&soft, torque, rejected, first, first_rejected);
    soft_init(&soft);
    HOLDS((soft.columns == 0u) && is_unit(soft.reflector[0]), "no column at first");
    REACHED;
}

void proof_soft_zeros(void) {
    any_soft();
    HOLDS(without_zeros(count, (const num_t(*)[ROBOT_MAX_JOINTS])columns) <= count, "no more columns than given");
    REACHED;
}

void proof_soft_normalise(void) {
    any_soft();
    (void)normalise(soft.weakest, count, &saturations);
    start_weakest(&soft);
    REACHED;
}

/* Instead of normalise. */
num_t stub_normalise(num_t w[], uint32_t of, uint32_t *ignored) {
    HOLDS(of <= (uint32_t)COLUMNS, "the entries are there");
    stub_object(w, COLUMNS * sizeof(*w));
    return stub_number(ignored);
}

/* Any start vector, each number of columns as a constant. */
void proof_soft_follow(void) {
    for (uint32_t k = 1; k <= (uint32_t)COLUMNS; ++k) {
        any_soft();
        soft.columns = k;
        for (uint32_t c = 0; c < (uint32_t)COLUMNS; ++c) {
            for (uint32_t j = 0; j < (uint32_t)COLUMNS; ++j) {
                ASSUME((soft.triangle[c][j] >= -SOFT_MOST) && (soft.triangle[c][j] <= SOFT_MOST));
            }
        }
        follow_weakest(&soft, s);
    }
    REACHED;
}

/* Instead of the functions that the step calls. */
num_t stub_make(soft_t *self, num_t x[], num_t of, uint32_t at) {
    HOLDS((at < (uint32_t)COLUMNS) && (of >= NUM(SOFT_MIN)) && (of <= NUM(1)), "a column and a softness");
    HOLDS(__CPROVER_w_ok(x, ROWS * sizeof(*x)), "the column is there");
    return stub_number(&self->saturations);
}

static uint32_t left; /* by stub_zeros */

uint32_t stub_zeros(uint32_t k, const num_t column[][ROBOT_MAX_JOINTS]) {
    stub_columns(k, column);
    return left;
}

void stub_start(soft_t *self) {
    HOLDS(self->columns <= (uint32_t)COLUMNS, "the entries are there");
}

void stub_follow(soft_t *self, num_t of) {
    HOLDS((self->columns >= 1u) && (self->columns <= (uint32_t)COLUMNS) && (of >= NUM(SOFT_MIN)), "a triangle");
}

void proof_soft_step(void) {
    for (left = 0; left <= (uint32_t)COLUMNS; ++left) {
        any_soft();
        ASSUME(left <= count);
        soft_step(&soft, count, (const num_t(*)[ROBOT_MAX_JOINTS])columns, s);
        HOLDS(soft.columns == left, "the columns that are not zero");
    }
    REACHED;
}
