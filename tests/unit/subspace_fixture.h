/* subspace_fixture: matrices of known singular values, and the projector of a step. */
#ifndef SUBSPACE_FIXTURE_H
#define SUBSPACE_FIXTURE_H

#include "core_fixture.h"
#include "subspace.h"

#define N 8u
#define K SUBSPACE_MAX_COLUMNS

static subspace_t subspace;
static num_t column[K][ROBOT_MAX_JOINTS];
static num_t singular[K];
static double projector[N][N]; /* of the last step, column by column */

static inline void start(void) {
    subspace_init(&subspace);
    memset(column, 0, sizeof(column));
}

static inline void step(uint32_t n, uint32_t k, double tolerance) {
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
static inline void orthonormal(uint32_t n, uint32_t count, double vector[][N]) {
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
static inline void compose(uint32_t n, uint32_t k, const double sigma[], double left[][N]) {
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
static inline double projector_error(uint32_t n, uint32_t rank, double left[][N]) {
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

static inline void assert_identity(uint32_t n) {
    TEST_ASSERT_EQUAL(0, subspace.rank);
    for (uint32_t i = 0; i < n; ++i) {
        for (uint32_t j = 0; j < n; ++j) {
            TEST_ASSERT_TRUE(projector[i][j] == ((i == j) ? 1.0 : 0.0)); /* to the bit: nothing is explained */
        }
    }
}

/* All singular values, measured in addition to the step. The step's own smallest must agree with them. */
static inline void measure(uint32_t n, uint32_t k, double tolerance) {
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

static inline bool has_singular(double value, double tolerance) {
    bool found = false;
    for (uint32_t i = 0; i < subspace.directions; ++i) {
        found = found || (fabs(value_of(singular[i]) - value) <= tolerance);
    }
    return found;
}

#endif
