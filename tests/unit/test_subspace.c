#include "subspace.h"

#include "core_fixture.h"

#define N 8u
#define K SUBSPACE_MAX_COLUMNS

static subspace_t subspace;
static num_t column[K][ROBOT_MAX_JOINTS];
static num_t singular[K];
static double projector[N][N]; /* of the last step, column by column */

void setUp(void) {
    subspace_init(&subspace);
    memset(column, 0, sizeof(column));
}
void tearDown(void) {
    TEST_ASSERT_EQUAL(0, subspace.saturations);
}

static void step(uint32_t n, uint32_t k, double tolerance) {
    subspace_step(&subspace, n, k, (const num_t(*)[ROBOT_MAX_JOINTS])column, num_of(tolerance));
    for (uint32_t j = 0; j < n; ++j) {
        num_t unit[ROBOT_MAX_JOINTS] = {0};
        unit[j] = NUM(1);
        subspace_reject(&subspace, unit, unit);
        for (uint32_t i = 0; i < n; ++i) {
            projector[i][j] = value_of(unit[i]);
        }
    }
}

/* `count` orthonormal vectors of n, by Gram and Schmidt, twice. */
static void orthonormal(uint32_t n, uint32_t count, double vector[][N]) {
    for (uint32_t c = 0; c < count; ++c) {
        for (uint32_t i = 0; i < n; ++i) {
            vector[c][i] = random_one();
        }
        for (int pass = 0; pass < 2; ++pass) {
            for (uint32_t d = 0; d <= c; ++d) {
                double inner = 0.0;
                for (uint32_t i = 0; i < n; ++i) {
                    inner += vector[c][i] * vector[d][i];
                }
                const double scale = (d == c) ? (1.0 - 1.0 / sqrt(inner)) : inner;
                for (uint32_t i = 0; i < n; ++i) {
                    vector[c][i] -= scale * vector[d][i];
                }
            }
        }
    }
}

/* A = U diag(sigma) V^T with random U, V; returns U's columns in `left`. */
static void compose(uint32_t n, uint32_t k, const double sigma[], double left[][N]) {
    double right[N][N];
    const uint32_t m = (n < k) ? n : k;
    orthonormal(n, m, left);
    orthonormal(k, m, right);
    for (uint32_t c = 0; c < k; ++c) {
        for (uint32_t i = 0; i < n; ++i) {
            double entry = 0.0;
            for (uint32_t s = 0; s < m; ++s) {
                entry += left[s][i] * sigma[s] * right[s][c];
            }
            column[c][i] = num_of(entry);
        }
    }
}

/* Largest difference of the projector to I - U U^T over the first `rank` of U. */
static double projector_error(uint32_t n, uint32_t rank, double left[][N]) {
    double worst = 0.0;
    for (uint32_t i = 0; i < n; ++i) {
        for (uint32_t j = 0; j < n; ++j) {
            double expected = (i == j) ? 1.0 : 0.0;
            for (uint32_t s = 0; s < rank; ++s) {
                expected -= left[s][i] * left[s][j];
            }
            worst = fmax(worst, fabs(projector[i][j] - expected));
        }
    }
    return worst;
}

static void assert_identity(uint32_t n) {
    TEST_ASSERT_EQUAL(0, subspace.rank);
    for (uint32_t i = 0; i < n; ++i) {
        for (uint32_t j = 0; j < n; ++j) {
            TEST_ASSERT_TRUE(projector[i][j] == ((i == j) ? 1.0 : 0.0)); /* to the bit: nothing is explained */
        }
    }
}

/* All singular values, measured beside the step. The step's own smallest must agree with them. */
static void measure(uint32_t n, uint32_t k, double tolerance) {
    subspace_t apart;
    subspace_init(&apart);
    subspace_measure(&apart, n, k, (const num_t(*)[ROBOT_MAX_JOINTS])column, num_of(tolerance), singular);
    TEST_ASSERT_TRUE(apart.converged);
    TEST_ASSERT_EQUAL(subspace.rank, apart.rank);
    TEST_ASSERT_EQUAL(0, apart.saturations);
    const double low = value_of(subspace.smallest), exact = value_of(apart.smallest);
    TEST_ASSERT_TRUE(low <= exact + IF_FIXED(3e-5, 5e-6));
    TEST_ASSERT_TRUE((k > n) || (low >= exact / sqrt((double)subspace.directions) - 5e-6));
    if (subspace.rank < subspace.directions) {
        ASSERT_CLOSE(exact, low, 5e-6);
    }
}

static bool has_singular(double value, double tolerance) {
    bool found = false;
    for (uint32_t i = 0; i < subspace.directions; ++i) {
        found = found || (fabs(value_of(singular[i]) - value) <= tolerance);
    }
    return found;
}

static void test_full_rank_leaves_the_complement(void) {
    const double sigma[] = {1.3, 0.9, 0.5, 0.3, 0.1, 0.05};
    double left[N][N];
    random_start(31);
    for (int round = 0; round < 300; ++round) {
        for (uint32_t k = 1; k <= K; ++k) {
            compose(7, k, sigma, left);
            step(7, k, 0.005);
            TEST_ASSERT_TRUE(subspace.converged);
            TEST_ASSERT_EQUAL(k, subspace.rank);
            ASSERT_CLOSE(0.0, projector_error(7, k, left), 2e-5); /* mostly the rounding of the entries */
            measure(7, k, 0.005);
            for (uint32_t s = 0; s < k; ++s) {
                TEST_ASSERT_TRUE(has_singular(sigma[s], 3e-6));
            }
        }
    }
}

static void test_the_tolerance_decides_which_directions_count(void) {
    const double sigma[] = {1.2, 0.7, 0.04, 0.006, 0.004, 0.0005};
    const double tolerance[] = {0.0001, 0.002, 0.005, 0.02, 0.3, 1.0, 2.0};
    const uint32_t rank[] = {6, 5, 4, 3, 2, 1, 0};
    double left[N][N];
    random_start(32);
    for (int round = 0; round < 200; ++round) {
        compose(7, 6, sigma, left);
        for (uint32_t t = 0; t < 7u; ++t) {
            step(7, 6, tolerance[t]);
            TEST_ASSERT_TRUE(subspace.converged);
            TEST_ASSERT_EQUAL(rank[t], subspace.rank);
            /* The accuracy of a direction depends on the gap to its neighbours. */
            ASSERT_CLOSE(0.0, projector_error(7, rank[t], left), IF_FIXED(1.5e-3, 8e-4));
            measure(7, 6, tolerance[t]);
        }
    }
}

static void test_a_direction_just_above_the_tolerance_is_explained_and_one_just_below_is_not(void) {
    const double sigma[] = {1.0, 0.00505, 0.00495};
    double left[N][N];
    random_start(33);
    for (int round = 0; round < 200; ++round) {
        compose(6, 3, sigma, left);
        step(6, 3, 0.005);
        TEST_ASSERT_EQUAL(2, subspace.rank);
    }
}

static void test_rank_deficient_columns_leave_the_complement_of_what_they_span(void) {
    const double sigma[] = {1.1, 0.8, 0.4, 0.2, 0.0, 0.0};
    double left[N][N];
    random_start(34);
    for (int round = 0; round < 500; ++round) {
        for (uint32_t k = 5; k <= K; ++k) {
            compose(7, k, sigma, left);
            step(7, k, 0.005);
            TEST_ASSERT_TRUE(subspace.converged);
            TEST_ASSERT_EQUAL(4, subspace.rank);
            ASSERT_CLOSE(0.0, projector_error(7, 4, left), 5e-6);
            ASSERT_CLOSE(0.0, value_of(subspace.smallest), 2e-6);
        }
    }
}

static void test_the_projector_is_symmetric_idempotent_and_never_lengthens(void) {
    random_start(35);
    for (int round = 0; round < 500; ++round) {
        for (uint32_t c = 0; c < K; ++c) {
            const double size = pow(10.0, 1.5 * random_one());
            for (uint32_t i = 0; i < 7u; ++i) {
                column[c][i] = num_of(size * random_one());
            }
        }
        step(7, 1u + (uint32_t)round % K, 0.5);
        for (uint32_t i = 0; i < 7u; ++i) {
            double length = 0.0;
            for (uint32_t j = 0; j < 7u; ++j) {
                double twice = 0.0;
                for (uint32_t l = 0; l < 7u; ++l) {
                    twice += projector[i][l] * projector[l][j];
                }
                ASSERT_CLOSE(projector[i][j], projector[j][i], 5e-6);
                ASSERT_CLOSE(projector[i][j], twice, 5e-6);
                length += projector[j][i] * projector[j][i];
            }
            TEST_ASSERT_TRUE(length <= 1.0 + 1e-5);
        }
    }
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

static void test_more_columns_than_joints_explain_everything(void) {
    random_start(38);
    for (uint32_t n = 1; n < K; ++n) {
        for (uint32_t c = 0; c < K; ++c) {
            for (uint32_t i = 0; i < n; ++i) {
                column[c][i] = num_of(random_one());
            }
        }
        step(n, K, 0.005);
        TEST_ASSERT_EQUAL(n, subspace.directions);
        TEST_ASSERT_EQUAL(n, subspace.rank);
        for (uint32_t i = 0; i < n; ++i) {
            for (uint32_t j = 0; j < n; ++j) {
                ASSERT_CLOSE(0.0, projector[i][j], 2e-6);
            }
        }
    }
}

static void test_more_columns_than_joints_of_low_rank_leave_a_complement(void) {
    const double sigma[] = {1.0, 0.3, 0.0, 0.0};
    double left[N][N];
    random_start(39);
    for (int round = 0; round < 200; ++round) {
        compose(4, 6, sigma, left);
        step(4, 6, 0.005);
        TEST_ASSERT_EQUAL(2, subspace.rank);
        ASSERT_CLOSE(0.0, projector_error(4, 2, left), 5e-6);
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

static void test_tiny_columns_are_as_nothing(void) {
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
static void test_vanishing_columns_beside_good_ones_change_nothing(void) {
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
static void test_what_is_not_a_number_explains_nothing(void) {
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
                assert_identity(n);
#else
                TEST_ASSERT_TRUE(subspace.rank >= 1u);
#endif
            }
        }
    }
    subspace.saturations = 0; /* INT32_MIN is beyond the symmetric range */
}

static void test_the_steps_before_leave_no_trace(void) {
    const double sigma[] = {1.0, 0.5, 0.1};
    double left[N][N];
    random_start(43);
    for (uint32_t c = 0; c < K; ++c) {
        for (uint32_t i = 0; i < N; ++i) {
            column[c][i] = num_of(random_one());
        }
    }
    step(8, 6, 0.005);
    memset(column, 0, sizeof(column));
    compose(5, 3, sigma, left);
    step(5, 3, 0.005);
    const subspace_t used = subspace;
    subspace_init(&subspace);
    step(5, 3, 0.005);
    TEST_ASSERT_EQUAL(used.rank, subspace.rank);
    TEST_ASSERT_EQUAL(used.path.sweeps, subspace.path.sweeps);
    TEST_ASSERT_TRUE(used.smallest == subspace.smallest);
    for (uint32_t i = 0; i < subspace.directions; ++i) {
        TEST_ASSERT_TRUE(used.unexplained[0][i] == subspace.unexplained[0][i]);
    }
}

static void test_the_torque_may_be_rejected_in_place(void) {
    const double sigma[] = {1.0, 0.5, 0.1, 0.0};
    double left[N][N];
    num_t tau[ROBOT_MAX_JOINTS] = {0}, apart[ROBOT_MAX_JOINTS];
    random_start(44);
    compose(7, 4, sigma, left);
    step(7, 4, 0.005);
    for (uint32_t i = 0; i < 7u; ++i) {
        tau[i] = num_of(20.0 * random_one());
    }
    subspace_reject(&subspace, tau, apart);
    subspace_reject(&subspace, tau, tau);
    TEST_ASSERT_EQUAL_MEMORY(apart, tau, 7 * sizeof(num_t));
}

/* The bound of the longest tick, and how many of all matrices need more. */
static void test_the_sweeps_are_bounded_and_nearly_always_enough(void) {
    uint32_t unconverged = 0, total = 0;
    random_start(45);
    for (int round = 0; round < DRAWS(20000); ++round) {
        const uint32_t n = 5u + (uint32_t)round % 4u;
        const uint32_t k = 1u + (uint32_t)round % K;
        memset(column, 0, sizeof(column));
        for (uint32_t c = 0; c < k; ++c) {
            for (uint32_t i = 0; i < n; ++i) {
                column[c][i] = num_of(random_one() * ((round % 3 == 0) ? pow(10.0, 3.0 * random_one() - 3.0) : 1.0));
            }
            if ((round % 5 == 0) && (c > 0u)) {
                memcpy(column[c], column[c - 1u], sizeof(column[c]));
            }
        }
        subspace_step(&subspace, n, k, (const num_t(*)[ROBOT_MAX_JOINTS])column, NUM(0.005));
        TEST_ASSERT_TRUE(subspace.path.sweeps <= BIDIAGONAL_MAX_SWEEPS);
        unconverged += subspace.converged ? 0u : 1u;
        ++total;
    }
    printf("%u of %u random matrices wanted more sweeps\n", (unsigned)unconverged, (unsigned)total);
    TEST_ASSERT_EQUAL(0, unconverged);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_full_rank_leaves_the_complement);
    RUN_TEST(test_the_tolerance_decides_which_directions_count);
    RUN_TEST(test_a_direction_just_above_the_tolerance_is_explained_and_one_just_below_is_not);
    RUN_TEST(test_rank_deficient_columns_leave_the_complement_of_what_they_span);
    RUN_TEST(test_the_projector_is_symmetric_idempotent_and_never_lengthens);
    RUN_TEST(test_a_zero_matrix_explains_nothing);
    RUN_TEST(test_no_columns_explain_nothing);
    RUN_TEST(test_zero_columns_change_nothing);
    RUN_TEST(test_a_column_given_twice_counts_once);
    RUN_TEST(test_more_columns_than_joints_explain_everything);
    RUN_TEST(test_more_columns_than_joints_of_low_rank_leave_a_complement);
    RUN_TEST(test_one_joint_is_explained_or_not);
    RUN_TEST(test_tiny_columns_are_as_nothing);
    RUN_TEST(test_vanishing_columns_beside_good_ones_change_nothing);
    RUN_TEST(test_what_is_not_a_number_explains_nothing);
    RUN_TEST(test_the_steps_before_leave_no_trace);
    RUN_TEST(test_the_torque_may_be_rejected_in_place);
    RUN_TEST(test_the_sweeps_are_bounded_and_nearly_always_enough);
    return UNITY_END();
}
