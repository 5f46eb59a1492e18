#include "jacobi.h"

#include "core_fixture.h"
#include "soft.h"

#define N 7u
#define K SUBSPACE_MAX_COLUMNS

static jacobi_t jacobi;
static num_t column[K][ROBOT_MAX_JOINTS];

void setUp(void) {
    jacobi_init(&jacobi);
    memset(column, 0, sizeof(column));
}
void tearDown(void) {
    TEST_ASSERT_EQUAL(0, jacobi.saturations);
}

/* Columns of sizes over one and a half decades; every fifth matrix gives its first column twice, and every seventh has
 * zeros in half of its places. */
static void draw(int round, uint32_t n, uint32_t k) {
    memset(column, 0, sizeof(column));
    for (uint32_t c = 0; c < k; ++c) {
        const double size = (round % 3 == 0) ? 1.0 : pow(10.0, 0.75 * (random_one() - 1.0));
        for (uint32_t i = 0; i < n; ++i) {
            const bool zero = (round % 7 == 0) && (random_one() > 0.0);
            column[c][i] = zero ? NUM(0) : num_of(size * random_one());
        }
    }
    if ((round % 5 == 0) && (k > 1u)) {
        memcpy(column[k - 1u], column[0], sizeof(column[0]));
    }
}

static void draw_torque(uint32_t n, num_t tau[]) {
    for (uint32_t i = 0; i < n; ++i) {
        tau[i] = num_of(10.0 * random_one());
    }
}

static double largest_difference(const num_t a[], const num_t b[]) {
    double worst = 0.0;
    for (uint32_t i = 0; i < N; ++i) {
        worst = fmax(worst, fabs(value_of(a[i]) - value_of(b[i])));
    }
    return worst;
}

/* The hard projector of Golub and Kahan, which it returns, and that of Jacobi: d by each. */
static subspace_t hard_by_both(uint32_t k, const num_t tau[], num_t own[], num_t others[]) {
    subspace_t other;
    subspace_init(&other);
    subspace_step(&other, N, k, (const num_t(*)[ROBOT_MAX_JOINTS])column, NUM(0.005));
    subspace_reject(&other, tau, others);
    jacobi_hard(&jacobi, N, k, (const num_t(*)[ROBOT_MAX_JOINTS])column, NUM(0.005));
    jacobi_reject(&jacobi, tau, own);
    TEST_ASSERT_TRUE(jacobi.converged);
    return other;
}

/* The soft projector of the reflections, and that of Jacobi: d by each. */
static void soft_by_both(uint32_t k, const num_t tau[], num_t own[], num_t others[]) {
    soft_t other;
    soft_init(&other);
    soft_step(&other, k, (const num_t(*)[ROBOT_MAX_JOINTS])column, NUM(0.02));
    soft_reject(&other, tau, others, 0u, others);
    jacobi_soft(&jacobi, N, k, (const num_t(*)[ROBOT_MAX_JOINTS])column, NUM(0.02));
    jacobi_reject(&jacobi, tau, own);
    TEST_ASSERT_TRUE(jacobi.converged);
}

/* docs/decisions/channels.md rests on these two figures: at 10 Nm per joint the difference is at most 4e-5 of |tau|. */
static void test_the_hard_projector_agrees_with_that_of_golub_and_kahan(void) {
    double worst = 0.0;
    random_start(51);
    for (int round = 0; round < DRAWS(30000); ++round) {
        num_t tau[ROBOT_MAX_JOINTS] = {0}, own[ROBOT_MAX_JOINTS], others[ROBOT_MAX_JOINTS];
        const uint32_t k = 1u + (uint32_t)round % K;
        draw(round, N, k);
        draw_torque(N, tau);
        const subspace_t other = hard_by_both(k, tau, own, others);
        if (fabs(value_of(other.smallest) - 0.005) > 1e-5) { /* otherwise both ranks are right */
            TEST_ASSERT_EQUAL(other.rank, jacobi.rank);
            worst = fmax(worst, largest_difference(own, others));
        }
    }
    printf("hard: largest difference %.2g Nm\n", worst);
    TEST_ASSERT_TRUE(worst < 4e-4);
}

static void test_the_soft_projector_agrees_with_that_of_the_reflections(void) {
    double worst = 0.0;
    random_start(52);
    for (int round = 0; round < DRAWS(30000); ++round) {
        num_t tau[ROBOT_MAX_JOINTS] = {0}, own[ROBOT_MAX_JOINTS], others[ROBOT_MAX_JOINTS];
        const uint32_t k = 1u + (uint32_t)round % K;
        draw(round, N, k);
        draw_torque(N, tau);
        soft_by_both(k, tau, own, others);
        worst = fmax(worst, largest_difference(own, others));
    }
    printf("soft: largest difference %.2g Nm\n", worst);
    TEST_ASSERT_TRUE(worst < 4e-4);
}

static void test_the_singular_values_are_those_of_a_known_matrix_in_order(void) {
    /* Three orthogonal columns of length 0.3, 0.9 and 0.5, turned among themselves. */
    const double sigma[3] = {0.3, 0.9, 0.5};
    const double turn[3][3] = {
        {2.0 / 3, -1.0 / 3, 2.0 / 3}, {2.0 / 3, 2.0 / 3, -1.0 / 3}, {-1.0 / 3, 2.0 / 3, 2.0 / 3}};
    for (uint32_t c = 0; c < 3u; ++c) {
        for (uint32_t i = 0; i < 3u; ++i) {
            column[c][2u * i] = num_of(sigma[i] * turn[i][c]);
        }
    }
    jacobi_hard(&jacobi, N, 3, (const num_t(*)[ROBOT_MAX_JOINTS])column, NUM(0.4));
    TEST_ASSERT_EQUAL(2, jacobi.rank);
    ASSERT_CLOSE(0.9, value_of(jacobi.singular[0]), 2e-6);
    ASSERT_CLOSE(0.5, value_of(jacobi.singular[1]), 2e-6);
    ASSERT_CLOSE(0.3, value_of(jacobi.smallest), 2e-6);
}

static void test_a_direction_just_above_the_tolerance_is_explained_and_one_just_below_is_not(void) {
    column[0][1] = NUM(1);
    column[1][3] = NUM(0.00501);
    column[2][5] = NUM(0.00499);
    jacobi_hard(&jacobi, N, 3, (const num_t(*)[ROBOT_MAX_JOINTS])column, NUM(0.005));
    TEST_ASSERT_EQUAL(2, jacobi.rank);
    num_t tau[ROBOT_MAX_JOINTS] = {NUM(1), NUM(1), NUM(1), NUM(1), NUM(1), NUM(1)};
    jacobi_reject(&jacobi, tau, tau);
    ASSERT_CLOSE(0.0, value_of(tau[3]), 1e-4);
    ASSERT_CLOSE(1.0, value_of(tau[5]), 1e-6);
}

static void test_a_singular_value_of_exactly_the_bound_does_not_count(void) {
    num_t tau[ROBOT_MAX_JOINTS] = {NUM(1), NUM(1), NUM(1), NUM(1), NUM(1), NUM(1)};
    column[0][1] = NUM(1);
    column[1][3] = NUM(0.005);
    jacobi_soft(&jacobi, N, 2, (const num_t(*)[ROBOT_MAX_JOINTS])column, NUM(0.005));
    TEST_ASSERT_EQUAL(1, jacobi.rank);
    jacobi_hard(&jacobi, N, 2, (const num_t(*)[ROBOT_MAX_JOINTS])column, NUM(0.005));
    TEST_ASSERT_EQUAL(1, jacobi.rank);
    jacobi_reject(&jacobi, tau, tau);
    TEST_ASSERT_TRUE(tau[3] == NUM(1));
}

static void take(const double values[][N], uint32_t k) {
    for (uint32_t c = 0; c < k; ++c) {
        for (uint32_t i = 0; i < N; ++i) {
            column[c][i] = num_of(values[c][i]);
        }
    }
}

static void assert_agrees_with_that_of_golub_and_kahan(uint32_t k) {
    num_t tau[ROBOT_MAX_JOINTS] = {NUM(1), NUM(-2), NUM(3), NUM(4), NUM(-5), NUM(6), NUM(7)};
    num_t own[ROBOT_MAX_JOINTS], others[ROBOT_MAX_JOINTS];
    const subspace_t other = hard_by_both(k, tau, own, others);
    TEST_ASSERT_EQUAL(other.rank, jacobi.rank);
    ASSERT_CLOSE(0.0, largest_difference(own, others), 1e-4);
}

/* Rounding keeps the first two columns from 2^-16 of a right angle, so that every sweep turns them: 2^-10 is enough. */
static void test_columns_that_stay_beside_a_right_angle_count_as_orthogonal(void) {
    static const double values[3][N] = {{-0.00264, -0.00039, -0.00268, -0.00046, -0.00117, -0.00148, 0.00197},
                                        {-0.00106, -0.00016, -0.00108, -0.00018, -0.00047, -0.00059, 0.00079},
                                        {-0.00019, -0.00014, -0.00013, 0.00004, 0.00004, 0.00019, 0.0002}};
    take(values, 3);
    assert_agrees_with_that_of_golub_and_kahan(3);
}

/* In Q9.22 five sweeps leave a pair farther than 2^-10 from a right angle. */
static void test_a_matrix_that_needs_every_sweep(void) {
    static const double values[5][N] = {{0, 0.488673925, 0, 0, 0.092703104, 0, 0},
                                        {0, 0, 0, 0, -0.779669285, 0, 0},
                                        {-0.669700861, 0, -0.777369976, 0, 0, 0.482418299, 0},
                                        {0, -0.265048504, 0.867970943, 0.0678517818, 0, 0, 0},
                                        {-0.529821634, 0.845059633, 0.323350191, 0, 0, 0, 0.328633308}};
    take(values, 5);
    assert_agrees_with_that_of_golub_and_kahan(5);
}

/* The second pair of the first sweep changes places, so this sweep never sees the first column beside the longest. */
static void test_a_pair_that_changes_places_is_not_forgotten(void) {
    static const double values[3][N] = {{-0.002, 0, 0, -0.3363, 0, 0, 0.2405},
                                        {-0.03577, -0.17295, 0.12769, 0, 0, 0.18349, 0},
                                        {0, 0.88969, -0.28339, 0, 0, 0, 0}};
    num_t tau[ROBOT_MAX_JOINTS] = {NUM(1), NUM(-2), NUM(3), NUM(4), NUM(-5), NUM(6), NUM(7)};
    num_t own[ROBOT_MAX_JOINTS], others[ROBOT_MAX_JOINTS];
    take(values, 3);
    soft_by_both(3, tau, own, others);
    ASSERT_CLOSE(0.0, largest_difference(own, others), 1e-4);
}

static void test_more_columns_than_joints_explain_everything(void) {
    random_start(53);
    for (uint32_t n = 1; n < K; ++n) {
        num_t tau[ROBOT_MAX_JOINTS] = {0}, zero[ROBOT_MAX_JOINTS] = {0};
        draw(1, n, K);
        draw_torque(n, tau);
        jacobi_hard(&jacobi, n, K, (const num_t(*)[ROBOT_MAX_JOINTS])column, NUM(0.0005));
        TEST_ASSERT_EQUAL(n, jacobi.directions);
        TEST_ASSERT_EQUAL(n, jacobi.rank);
        TEST_ASSERT_TRUE(jacobi.smallest > NUM(0.0005));
        jacobi_reject(&jacobi, tau, tau);
        ASSERT_CLOSE(0.0, largest_difference(tau, zero), 1e-3);
    }
}

static void test_zero_and_vanishing_columns_explain_nothing(void) {
    random_start(54);
    for (int decade = -40; decade <= -5; ++decade) {
        num_t tau[ROBOT_MAX_JOINTS] = {0}, before[ROBOT_MAX_JOINTS];
        for (uint32_t c = 0; c < K; ++c) {
            for (uint32_t i = 0; i < N; ++i) {
                column[c][i] = (decade == -40) ? NUM(0) : num_of(random_one() * pow(10.0, decade));
            }
        }
        draw_torque(N, tau);
        memcpy(before, tau, sizeof(before));
        jacobi_hard(&jacobi, N, K, (const num_t(*)[ROBOT_MAX_JOINTS])column, NUM(0.005));
        TEST_ASSERT_TRUE(jacobi.converged);
        TEST_ASSERT_EQUAL(0, jacobi.rank);
        jacobi_reject(&jacobi, tau, tau);
        TEST_ASSERT_EQUAL_MEMORY(before, tau, sizeof(tau));
    }
    jacobi_hard(&jacobi, N, 0, (const num_t(*)[ROBOT_MAX_JOINTS])column, NUM(0.005));
    TEST_ASSERT_TRUE(jacobi.converged);
    TEST_ASSERT_TRUE(jacobi.smallest == NUM(0));
}

/* 0.4 percent would be gone if s were held at the end of the scaled range. */
static void test_a_column_far_below_s_explains_nothing(void) {
    num_t tau[ROBOT_MAX_JOINTS] = {NUM(100)}, rest[ROBOT_MAX_JOINTS];
    column[0][0] = NUM(1e-5);
    jacobi_soft(&jacobi, N, 1, (const num_t(*)[ROBOT_MAX_JOINTS])column, NUM(0.02));
    jacobi_reject(&jacobi, tau, rest);
    TEST_ASSERT_TRUE(jacobi.converged);
    ASSERT_CLOSE(100.0, value_of(rest[0]), 1e-4);
}

static void test_values_that_are_not_numbers_explain_nothing(void) {
#ifdef TAUPERP_FIXED
    TEST_PASS_MESSAGE("every bit pattern is a number here");
#else
    const num_t bad[] = {NAN, INFINITY, -INFINITY};
    random_start(55);
    for (uint32_t place = 0; place < (K * N); ++place) {
        num_t tau[ROBOT_MAX_JOINTS] = {0}, rest[ROBOT_MAX_JOINTS];
        draw(1, N, K);
        draw_torque(N, tau);
        column[place / N][place % N] = bad[place % 3u];
        jacobi_hard(&jacobi, N, K, (const num_t(*)[ROBOT_MAX_JOINTS])column, NUM(0.005));
        TEST_ASSERT_FALSE(jacobi.converged);
        TEST_ASSERT_EQUAL(0, jacobi.rank);
        TEST_ASSERT_TRUE(jacobi.smallest == NUM(0));
        jacobi_reject(&jacobi, tau, rest);
        TEST_ASSERT_EQUAL_MEMORY(tau, rest, sizeof(tau));
    }
#endif
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_hard_projector_agrees_with_that_of_golub_and_kahan);
    RUN_TEST(test_the_soft_projector_agrees_with_that_of_the_reflections);
    RUN_TEST(test_the_singular_values_are_those_of_a_known_matrix_in_order);
    RUN_TEST(test_a_direction_just_above_the_tolerance_is_explained_and_one_just_below_is_not);
    RUN_TEST(test_a_singular_value_of_exactly_the_bound_does_not_count);
    RUN_TEST(test_columns_that_stay_beside_a_right_angle_count_as_orthogonal);
    RUN_TEST(test_a_matrix_that_needs_every_sweep);
    RUN_TEST(test_a_pair_that_changes_places_is_not_forgotten);
    RUN_TEST(test_more_columns_than_joints_explain_everything);
    RUN_TEST(test_zero_and_vanishing_columns_explain_nothing);
    RUN_TEST(test_a_column_far_below_s_explains_nothing);
    RUN_TEST(test_values_that_are_not_numbers_explain_nothing);
    return UNITY_END();
}
