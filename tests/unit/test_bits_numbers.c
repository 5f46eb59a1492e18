/* The bits of numbers and projections (bits.h). */
#include "bits.h"
#include "jacobi.h"
#include "soft.h"
#include "square.h"
#include "subspace.h"

void setUp(void) {}
void tearDown(void) {}

/* --- numbers ------------------------------------------------------------------------------------------------------ */

/* From 2^-22 to 2^8 in size, both signs; each size is as likely as any other. */
static num_t of_any_size(void) {
    double number = random_one();
    for (uint32_t halvings = (uint32_t)random_in(0.0, 30.0); halvings > 0u; --halvings) {
        number *= 0.5;
    }
    return num_of(256.0 * number);
}

static void fold_wide_number(num_wide_t number) {
#ifdef TAUPERP_FIXED
    fold((uint32_t)number);
    fold((uint32_t)((uint64_t)number >> 32));
#else
    fold_number(number);
#endif
}

static void fold_rotation(num_rotation_t rotation) {
#ifdef TAUPERP_FIXED
    fold((uint32_t)rotation.cos);
    fold((uint32_t)rotation.sin);
#else
    fold_number(rotation.cos);
    fold_number(rotation.sin);
#endif
    fold_number(rotation.length);
}

static void test_products_quotients_and_roots(void) {
    uint32_t saturations = 0;
    start_hash(701);
    for (int i = 0; i < 2000; ++i) {
        const num_t a = of_any_size(), b = of_any_size();
        const num_wide_t square = num_wide(a, a) + num_wide(b, b);
        fold_number(num_mul(a, b, &saturations));
        fold_number(num_div(a, b, &saturations));
        fold_number(num_root(square));
        fold_number(num_times(a, num_inverse_root(square), &saturations));
        fold((uint32_t)num_headroom(num_abs(a)));
        fold_number(num_shift(a, (int32_t)(i % 9) - 4, &saturations));
        const num_sincos_t turn = num_sincos(a);
        fold_number(turn.sin);
        fold_number(turn.cos);
    }
    fold(saturations);
    assert_hash(IF_FIXED(0xAAC8D172u, 0x2BA2FCFCu));
}

static void test_rotations_and_eigenvalues(void) {
    uint32_t saturations = 0;
    start_hash(702);
    for (int i = 0; i < 2000; ++i) {
        const num_t a = of_any_size() / 16, b = of_any_size() / 16, c = of_any_size() / 16;
        const num_wide_t first = num_wide(a, a), second = num_wide(b, b);
        const num_wide_t along = num_wide(a, b) / (num_wide_t)(1 + (i % 3));
        fold_rotation(num_rotation(a, b, &saturations));
        fold_rotation(num_shifted_rotation(a, b, num_wide(c, c), &saturations));
        square_t longer = square_of((first > second) ? first : second);
        square_t shorter = square_of((first > second) ? second : first);
        fold(square_is_orthogonal(along / (num_wide_t)(1 + (1 << (i % 20))), longer, shorter, 10u) ? 1u : 0u);
        fold_rotation(square_orthogonalise(&longer, &shorter, along));
        fold(square_is_longer(longer, shorter) ? 1u : 0u);
        fold_wide_number(num_smaller_eigenvalue(first, second, along));
    }
    fold(saturations);
    assert_hash(IF_FIXED(0xDFF03E87u, 0xCE768AA7u));
}

/* --- decompositions ----------------------------------------------------------------------------------------------- */

static num_t column[COLUMNS][ROBOT_MAX_JOINTS], tau[ROBOT_MAX_JOINTS], rejected[ROBOT_MAX_JOINTS];

/* Every fourth matrix has columns that are small, every fifth a column twice. */
static void draw(int round, uint32_t n, uint32_t k) {
    memset(column, 0, sizeof(column));
    memset(tau, 0, sizeof(tau));
    for (uint32_t c = 0; c < k; ++c) {
        const double size = ((round % 4 == 0) && (c % 2u == 0u)) ? 0.01 : 1.0;
        for (uint32_t i = 0; i < n; ++i) {
            column[c][i] = num_of(size * random_one());
        }
    }
    if ((round % 5 == 0) && (k > 1u)) {
        memcpy(column[k - 1u], column[0], sizeof(column[0]));
    }
    for (uint32_t i = 0; i < n; ++i) {
        tau[i] = num_of(30.0 * random_one());
    }
}

#define DRAWN ((const num_t(*)[ROBOT_MAX_JOINTS])column)

static void test_the_hard_projector(void) {
    static subspace_t subspace;
    num_t singular[COLUMNS] = {NUM(0)};
    subspace_init(&subspace);
    start_hash(703);
    for (int round = 0; round < 300; ++round) {
        const uint32_t n = 1u + (uint32_t)round % ROBOT_MAX_JOINTS, k = (uint32_t)round % (COLUMNS + 1u);
        draw(round, n, k);
        subspace_step(&subspace, n, k, DRAWN, num_of((round % 2 == 0) ? 0.005 : 0.2));
        subspace_reject(&subspace, tau, rejected);
        fold_numbers(rejected, ROBOT_MAX_JOINTS);
        fold_number(subspace.smallest);
        fold(subspace.rank);
        fold(subspace.path.sweeps);
        fold(subspace.path.rotations);
        subspace_measure(&subspace, n, k, DRAWN, NUM(0.005), singular);
        fold_numbers(singular, (n < k) ? n : k);
    }
    fold(subspace.saturations);
    assert_hash(IF_FIXED(0x2009A6D8u, 0x0D647D4Cu));
}

static void test_the_soft_projector(void) {
    static soft_t soft;
    num_t first[ROBOT_MAX_JOINTS];
    soft_init(&soft);
    start_hash(704);
    for (int round = 0; round < 300; ++round) {
        const uint32_t k = (uint32_t)round % (COLUMNS + 1u);
        draw(round, 7u, k);
        soft_step(&soft, k, DRAWN, num_of((round % 2 == 0) ? 0.005 : 0.05));
        soft_reject(&soft, tau, rejected, k / 2u, first);
        fold_numbers(rejected, ROBOT_MAX_JOINTS);
        fold_numbers(first, (k > 1u) ? ROBOT_MAX_JOINTS : 0u);
        fold_number(soft.smallest);
        fold(soft.columns);
    }
    fold(soft.saturations);
    assert_hash(IF_FIXED(0x68DBDB38u, 0xEEDB287Bu));
}

static void test_both_projectors_by_jacobi_rotations(void) {
    static jacobi_t jacobi;
    jacobi_init(&jacobi);
    start_hash(705);
    for (int round = 0; round < 300; ++round) {
        const uint32_t n = 1u + (uint32_t)round % ROBOT_MAX_JOINTS, k = (uint32_t)round % (COLUMNS + 1u);
        draw(round, n, k);
        if (round % 2 == 0) {
            jacobi_hard(&jacobi, n, k, DRAWN, NUM(0.005));
        } else {
            jacobi_soft(&jacobi, n, k, DRAWN, NUM(0.05));
        }
        jacobi_reject(&jacobi, tau, rejected);
        fold_numbers(rejected, ROBOT_MAX_JOINTS);
        fold_numbers(jacobi.singular, jacobi.directions);
        fold_number(jacobi.smallest);
        fold(jacobi.rank);
        fold(jacobi.converged ? 1u : 0u);
    }
    fold(jacobi.saturations);
    assert_hash(IF_FIXED(0x0038D8A6u, 0x75885E3Cu));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_products_quotients_and_roots);
    RUN_TEST(test_rotations_and_eigenvalues);
    RUN_TEST(test_the_hard_projector);
    RUN_TEST(test_the_soft_projector);
    RUN_TEST(test_both_projectors_by_jacobi_rotations);
    return UNITY_END();
}
