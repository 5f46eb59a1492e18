/* The projector of a matrix: its remainder, and the directions that count. Unusual columns: test_subspace_columns.c. */
#include "subspace_fixture.h"

void setUp(void) {
    start();
}
void tearDown(void) {
    TEST_ASSERT_EQUAL(0, subspace.saturations);
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

static void test_rank_deficient_columns_leave_the_complement_of_their_span(void) {
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

/* Largest entry that the reflectors leave below the diagonal; those of QR leave none, because they are made of columns
 * that no reflection from the right has mixed. */
static double below_the_diagonal(uint32_t k) {
    double worst = 0.0;
    for (uint32_t c = 0; c < k; ++c) {
        double x[N];
        for (uint32_t i = 0; i < 7u; ++i) {
            x[i] = value_of(column[c][i]);
        }
        for (uint32_t at = 0; at <= c; ++at) {
            double along = 0.0;
            for (uint32_t i = at; i < 7u; ++i) {
                along += value_of(subspace.reflector[at][i]) * x[i];
            }
            for (uint32_t i = at; i < 7u; ++i) {
                x[i] -= along * value_of(subspace.reflector[at][i]);
            }
        }
        for (uint32_t i = c + 1u; i < 7u; ++i) {
            worst = fmax(worst, fabs(x[i]));
        }
    }
    return worst;
}

static void test_qr_makes_the_reflectors_of_a_weak_direction_that_is_explained(void) {
    double left[N][N];
    random_start(46);
    for (int round = 0; round < 20; ++round) {
        for (uint32_t k = 3; k <= K; ++k) {
            double sigma[] = {1.3, 0.9, 0.7, 0.6, 0.5, 0.4};
            compose(7, k, sigma, left);
            step(7, k, 0.005);
            TEST_ASSERT_TRUE(below_the_diagonal(k) > 1e-3); /* no direction is weak */
            sigma[k - 1u] = 0.007;
            compose(7, k, sigma, left);
            step(7, k, 0.005);
            TEST_ASSERT_EQUAL(k, subspace.rank);
            ASSERT_CLOSE(0.0, below_the_diagonal(k), 2e-6);
            ASSERT_CLOSE(0.0, projector_error(7, k, left), 1e-4);
            step(7, k, 0.1); /* with a direction that is not explained, the rotations belong to their own reflectors */
            TEST_ASSERT_EQUAL(k - 1u, subspace.rank);
            TEST_ASSERT_TRUE(below_the_diagonal(k) > 1e-3);
        }
    }
}

static void test_earlier_steps_have_no_influence(void) {
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

/* One column: its length is the singular value, and nothing along it is left. Columns behind it are not read. */
static void test_a_column_of_any_size_is_explained(void) {
    static const double sizes[] = {0.02, 0.5, 3.0, 6.0, 12.0, 20.0};
    random_start(99);
    for (uint32_t round = 0; round < 6u; ++round) {
        num_t torque[ROBOT_MAX_JOINTS] = {NUM(0)}, rejected[ROBOT_MAX_JOINTS];
        double square = 0.0, along = 0.0;
        start();
        for (uint32_t i = 0; i < 7u; ++i) {
            column[0][i] = num_of(sizes[round] * ((i == 2u) ? 1.0 : random_one()));
            column[1][i] = NUM(500);
            torque[i] = num_of(30.0 * random_one());
            square += value_of(column[0][i]) * value_of(column[0][i]);
        }
        subspace_measure(&subspace, 7u, 1u, (const num_t(*)[ROBOT_MAX_JOINTS])column, NUM(0.005), singular);
        ASSERT_CLOSE(sqrt(square), value_of(singular[0]), 4e-7 + 4e-7 * sqrt(square));
        TEST_ASSERT_EQUAL(1, subspace.rank);
        subspace_reject(&subspace, torque, rejected);
        for (uint32_t i = 0; i < 7u; ++i) {
            along += value_of(column[0][i]) * value_of(rejected[i]) / sqrt(square);
        }
        ASSERT_CLOSE(0.0, along, 5e-5);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_column_of_any_size_is_explained);
    RUN_TEST(test_full_rank_leaves_the_complement);
    RUN_TEST(test_the_tolerance_decides_which_directions_count);
    RUN_TEST(test_a_direction_just_above_the_tolerance_is_explained_and_one_just_below_is_not);
    RUN_TEST(test_rank_deficient_columns_leave_the_complement_of_their_span);
    RUN_TEST(test_the_projector_is_symmetric_idempotent_and_never_lengthens);
    RUN_TEST(test_more_columns_than_joints_explain_everything);
    RUN_TEST(test_more_columns_than_joints_of_low_rank_leave_a_complement);
    RUN_TEST(test_qr_makes_the_reflectors_of_a_weak_direction_that_is_explained);
    RUN_TEST(test_earlier_steps_have_no_influence);
    RUN_TEST(test_the_torque_may_be_rejected_in_place);
    RUN_TEST(test_the_sweeps_are_bounded_and_nearly_always_enough);
    return UNITY_END();
}
