/* Columns that are zero, tiny, repeated, or not numbers. */
#include "subspace_fixture.h"

void setUp(void) {
    start();
}
void tearDown(void) {
    TEST_ASSERT_EQUAL(0, subspace.saturations);
}

static void test_a_zero_matrix_explains_nothing(void) {
    for (uint32_t n = 1; n <= N; ++n) {
        for (uint32_t k = 1; k <= K; ++k) {
            step(n, k, 0.005);
            TEST_ASSERT_TRUE(subspace.converged);
            assert_identity(n);
            TEST_ASSERT_TRUE(subspace.smallest == NUM(0));
        }
    }
}

static void test_no_columns_explain_nothing(void) {
    column[0][0] = NUM(1);
    step(7, 2, 0.005);
    TEST_ASSERT_EQUAL(1, subspace.rank);
    step(7, 0, 0.005);
    TEST_ASSERT_TRUE(subspace.converged);
    TEST_ASSERT_EQUAL(0, subspace.directions);
    assert_identity(7);
    TEST_ASSERT_TRUE(subspace.smallest == NUM(0));
}

static void test_zero_columns_change_nothing(void) {
    const double sigma[] = {1.0, 0.5, 0.2};
    double left[N][N], without[N][N];
    random_start(36);
    for (uint32_t place = 0; place <= 3u; ++place) {
        compose(7, 3, sigma, left);
        step(7, 3, 0.005);
        memcpy(without, projector, sizeof(without));
        for (uint32_t c = 3; c > place; --c) {
            memcpy(column[c], column[c - 1u], sizeof(column[c]));
        }
        memset(column[place], 0, sizeof(column[place]));
        step(7, 4, 0.005);
        TEST_ASSERT_EQUAL(3, subspace.rank);
        for (uint32_t i = 0; i < 7u; ++i) {
            for (uint32_t j = 0; j < 7u; ++j) {
                ASSERT_CLOSE(without[i][j], projector[i][j], 3e-6);
            }
        }
    }
}

static void test_a_column_given_twice_counts_once(void) {
    const double sigma[] = {1.0, 0.6, 0.2};
    double left[N][N];
    random_start(37);
    for (int round = 0; round < 300; ++round) {
        compose(7, 3, sigma, left);
        memcpy(column[3], column[round % 3], sizeof(column[3]));
        for (uint32_t i = 0; i < 7u; ++i) {
            column[4][i] = -column[(round + 1) % 3][i];
        }
        step(7, 5, 0.005);
        TEST_ASSERT_TRUE(subspace.converged);
        TEST_ASSERT_EQUAL(3, subspace.rank);
        ASSERT_CLOSE(0.0, projector_error(7, 3, left), 5e-6);
    }
}

static void test_one_joint_is_explained_or_not(void) {
    column[0][0] = NUM(-0.3);
    column[1][0] = NUM(0.4);
    step(1, 2, 0.005);
    TEST_ASSERT_EQUAL(1, subspace.rank);
    measure(1, 2, 0.005);
    ASSERT_CLOSE(0.5, value_of(singular[0]), 1e-6);
    ASSERT_CLOSE(0.0, projector[0][0], 1e-6);
    step(1, 2, 0.6);
    assert_identity(1);
}

static void test_tiny_columns_explain_nothing(void) {
    random_start(40);
    for (int decade = -38; decade <= -4; ++decade) {
        for (uint32_t c = 0; c < K; ++c) {
            for (uint32_t i = 0; i < 7u; ++i) {
                column[c][i] = num_of(random_one() * pow(10.0, decade));
            }
        }
        step(7, 6, 0.005);
        TEST_ASSERT_TRUE(subspace.converged);
        assert_identity(7);
    }
}

/* The rounding residue of a zero column must not change the span of the others: its square has no exact float. */
static void test_vanishing_columns_next_to_good_ones_change_nothing(void) {
    const double sigma[] = {1.0, 0.4};
    double left[N][N];
    random_start(41);
    for (int decade = -40; decade <= -5; ++decade) {
        for (uint32_t place = 0; place < 3u; ++place) {
            compose(7, 2, sigma, left);
            for (uint32_t c = 2; c > place; --c) {
                memcpy(column[c], column[c - 1u], sizeof(column[c]));
            }
            for (uint32_t i = 0; i < 7u; ++i) {
                column[place][i] = num_of(random_one() * pow(10.0, decade));
            }
            step(7, 3, 0.005);
            TEST_ASSERT_TRUE(subspace.converged);
            TEST_ASSERT_EQUAL(2, subspace.rank);
            ASSERT_CLOSE(0.0, projector_error(7, 2, left), 2e-5);
        }
    }
}

/* NaN and infinity at any place. Fixed point has neither: any bits are numbers and give a projector. */
static void test_values_that_are_not_numbers_explain_nothing(void) {
#ifndef TAUPERP_FIXED
    const num_t bad[] = {NAN, INFINITY, -INFINITY};
#else
    const num_t bad[] = {INT32_MIN, INT32_MAX};
#endif
    random_start(42);
    for (uint32_t n = 1; n <= N; ++n) {
        for (uint32_t k = 1; k <= K; ++k) {
            for (uint32_t place = 0; place < n * k; ++place) {
                for (uint32_t c = 0; c < k; ++c) {
                    for (uint32_t i = 0; i < n; ++i) {
                        column[c][i] = num_of(random_one());
                    }
                }
                column[place / n][place % n] = bad[place % (sizeof(bad) / sizeof(bad[0]))];
                step(n, k, 0.005);
                TEST_ASSERT_TRUE(subspace.path.sweeps <= BIDIAGONAL_MAX_SWEEPS);
#ifndef TAUPERP_FIXED
                TEST_ASSERT_FALSE(subspace.converged);
                TEST_ASSERT_TRUE(subspace.smallest == NUM(0));
                assert_identity(n);
#else
                TEST_ASSERT_TRUE(subspace.rank >= 1u);
#endif
            }
        }
    }
    subspace.saturations = 0; /* INT32_MIN is beyond the symmetric range */
}

/* In Q9.22 the sweeps lose their shift here, until no more are allowed. In float they converge. */
static void test_without_convergence_nothing_is_explained(void) {
    static const int entries[5][6] = {
        {0, 3}, {-8}, {-3, -7}, {0, 0, 0, 0, 7}, {0, 0, 0, 0, -1, -3},
    };
    for (uint32_t c = 0; c < 5u; ++c) {
        for (uint32_t i = 0; i < 6u; ++i) {
            column[c][i] = num_of(entries[c][i]);
        }
    }
    step(7, 6, 0.005);
#ifdef TAUPERP_FIXED
    TEST_ASSERT_FALSE(subspace.converged);
    assert_identity(7);
#else
    TEST_ASSERT_TRUE(subspace.converged);
    TEST_ASSERT_EQUAL(4, subspace.rank);
#endif
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_zero_matrix_explains_nothing);
    RUN_TEST(test_no_columns_explain_nothing);
    RUN_TEST(test_zero_columns_change_nothing);
    RUN_TEST(test_a_column_given_twice_counts_once);
    RUN_TEST(test_one_joint_is_explained_or_not);
    RUN_TEST(test_tiny_columns_explain_nothing);
    RUN_TEST(test_vanishing_columns_next_to_good_ones_change_nothing);
    RUN_TEST(test_values_that_are_not_numbers_explain_nothing);
    RUN_TEST(test_without_convergence_nothing_is_explained);
    return UNITY_END();
}
