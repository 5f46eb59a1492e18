#include "soft.h"

#include "core_fixture.h"

#define N 7u
#define K SUBSPACE_MAX_COLUMNS

static soft_t soft;
static num_t column[K][ROBOT_MAX_JOINTS];

void setUp(void) {
    soft_init(&soft);
    memset(column, 0, sizeof(column));
}
void tearDown(void) {
    TEST_ASSERT_EQUAL(0, soft.saturations);
}

static void step(uint32_t k, double s) {
    soft_step(&soft, k, (const num_t(*)[ROBOT_MAX_JOINTS])column, num_of(s));
}

static void any_columns(uint32_t k, double size) {
    for (uint32_t c = 0; c < k; ++c) {
        for (uint32_t i = 0; i < N; ++i) {
            column[c][i] = num_of(size * random_one());
        }
    }
}

/* x with (I + A A^T / s^2) x = tau, by Gauss' elimination in double. */
static void solve(uint32_t k, double s, const double tau[N], double x[N]) {
    double m[N][N + 1u];
    for (uint32_t i = 0; i < N; ++i) {
        for (uint32_t j = 0; j < N; ++j) {
            m[i][j] = (i == j) ? 1.0 : 0.0;
            for (uint32_t c = 0; c < k; ++c) {
                m[i][j] += value_of(column[c][i]) * value_of(column[c][j]) / (s * s);
            }
        }
        m[i][N] = tau[i];
    }
    for (uint32_t p = 0; p < N; ++p) { /* positive definite: no pivoting */
        for (uint32_t i = 0; i < N; ++i) {
            const double factor = (i == p) ? 0.0 : (m[i][p] / m[p][p]);
            for (uint32_t j = 0; j <= N; ++j) {
                m[i][j] -= factor * m[p][j];
            }
        }
    }
    for (uint32_t i = 0; i < N; ++i) {
        x[i] = m[i][N] / m[i][i];
    }
}

static void test_the_remainder_solves_the_normal_equations(void) {
    random_start(301);
    for (int round = 0; round < DRAWS(3000); ++round) {
        const uint32_t k = (uint32_t)round % (K + 1u);
        const double s = (round % 2 == 0) ? 0.005 : 0.05;
        double tau[N], expected[N];
        num_t torque[ROBOT_MAX_JOINTS] = {NUM(0)}, rejected[ROBOT_MAX_JOINTS];
        any_columns(k, (round % 3 == 0) ? 0.02 : 0.8);
        for (uint32_t i = 0; i < N; ++i) {
            torque[i] = num_of(30.0 * random_one());
            tau[i] = value_of(torque[i]);
        }
        step(k, s);
        soft_reject(&soft, torque, rejected, 0u, NULL);
        solve(k, value_of(num_of(s)), tau, expected);
        for (uint32_t i = 0; i < N; ++i) {
            ASSERT_CLOSE(expected[i], value_of(rejected[i]), IF_FIXED(5e-3, 5e-4));
        }
    }
}

static void test_the_first_columns_alone_give_their_own_projection(void) {
    random_start(302);
    for (int round = 0; round < DRAWS(300); ++round) {
        num_t torque[ROBOT_MAX_JOINTS] = {NUM(0)}, all[ROBOT_MAX_JOINTS], alone[ROBOT_MAX_JOINTS];
        num_t part[ROBOT_MAX_JOINTS], whole[ROBOT_MAX_JOINTS];
        any_columns(K, 0.8);
        for (uint32_t i = 0; i < N; ++i) {
            torque[i] = num_of(30.0 * random_one());
        }
        step(K, 0.01);
        soft_reject(&soft, torque, whole, 0u, NULL);
        soft_reject(&soft, torque, all, 3u, part);
        TEST_ASSERT_EQUAL_MEMORY(whole, all, N * sizeof(num_t));
        step(3u, 0.01);
        soft_reject(&soft, torque, alone, 0u, NULL);
        TEST_ASSERT_EQUAL_MEMORY(alone, part, N * sizeof(num_t));
        soft_reject(&soft, torque, all, 3u, part); /* the first columns are all columns */
        TEST_ASSERT_EQUAL_MEMORY(alone, part, N * sizeof(num_t));
        TEST_ASSERT_EQUAL_MEMORY(alone, all, N * sizeof(num_t));
    }
}

/* A zero column at the end is dropped, although the task counts it among its first ones. */
static void test_columns_that_are_zero_explain_nothing(void) {
    num_t torque[ROBOT_MAX_JOINTS] = {NUM(0)}, all[ROBOT_MAX_JOINTS], part[ROBOT_MAX_JOINTS];
    random_start(303);
    any_columns(3u, 0.8);
    step(3u, 0.01);
    memset(column[1], 0, 2u * sizeof(column[1]));
    torque[0] = NUM(20);
    step(3u, 0.01);
    TEST_ASSERT_EQUAL(1, soft.columns);
    soft_reject(&soft, torque, all, 3u, part);
    TEST_ASSERT_EQUAL_MEMORY(all, part, N * sizeof(num_t));
    memset(column, 0, sizeof(column));
    step(1u, 0.01);
    TEST_ASSERT_EQUAL(0, soft.columns);
}

/* A^T A w = smallest^2 w for the direction w that the iteration has reached. */
static void test_the_smallest_singular_value_belongs_to_its_direction(void) {
    random_start(304);
    any_columns(K, 0.8);
    for (uint32_t k = 0; k < 300u; ++k) {
        step(K, 0.05);
    }
    double stretched[N] = {0.0};
    for (uint32_t i = 0; i < N; ++i) {
        for (uint32_t c = 0; c < K; ++c) {
            stretched[i] += value_of(column[c][i]) * value_of(soft.weakest[c]);
        }
    }
    const double square = value_of(soft.smallest) * value_of(soft.smallest);
    for (uint32_t c = 0; c < K; ++c) {
        double along = 0.0;
        for (uint32_t i = 0; i < N; ++i) {
            along += value_of(column[c][i]) * stretched[i];
        }
        ASSERT_CLOSE(square * value_of(soft.weakest[c]), along, 1e-4);
    }
}

/* Rounding may bring its square below zero. */
static void test_columns_that_depend_on_each_other_have_a_smallest_singular_value_of_nearly_zero(void) {
    random_start(305);
    for (uint32_t round = 0; round < 40u; ++round) {
        any_columns(2u, 0.8);
        memcpy(column[1], column[0], sizeof(column[0]));
        for (uint32_t k = 0; k < 5u; ++k) {
            step(2u, 0.05);
        }
        TEST_ASSERT_TRUE((soft.smallest >= NUM(0)) && (soft.smallest < NUM(0.005)));
    }
}

static void test_columns_that_were_no_numbers_leave_nothing_behind(void) {
#ifdef TAUPERP_FIXED
    TEST_PASS_MESSAGE("every bit pattern is a number here");
#else
    random_start(306);
    any_columns(3u, 0.8);
    const num_t before = column[1][2];
    column[1][2] = (num_t)NAN;
    step(3u, 0.05);
    column[1][2] = before;
    step(3u, 0.05);
    step(3u, 0.05);
    TEST_ASSERT_TRUE((soft.smallest > NUM(0)) && (soft.smallest < NUM(4)));
#endif
}

/* Two columns at an angle that goes to zero and back: the rank drops to one and returns. */
static void test_the_index_is_continuous_through_a_change_of_rank(void) {
    const double s = 0.005, force = 60.0;
    double before = 0.0;
    for (int k = -1000; k <= 1000; ++k) { /* sigma_min from 0.1 to 0 and back */
        const double angle = 1e-4 * k;
        num_t torque[ROBOT_MAX_JOINTS] = {NUM(0)}, rejected[ROBOT_MAX_JOINTS];
        column[0][0] = NUM(1);
        column[1][0] = num_of(cos(angle));
        column[1][1] = num_of(sin(angle));
        for (uint32_t i = 0; i < N; ++i) { /* the force along the second column alone */
            torque[i] = num_of(force * value_of(column[1][i]));
        }
        step(2u, s);
        soft_reject(&soft, torque, rejected, 0u, NULL);
        const double left = value_of(rejected[1]);
        TEST_ASSERT_TRUE(fabs(left) <= force * s / 2.0 + 1e-3);
        TEST_ASSERT_TRUE((k == -1000) || (fabs(left - before) <= 0.05));
        before = left;
    }
}

static void test_the_smallest_singular_value_is_followed(void) {
    for (int k = 0; k <= 2000; ++k) {
        const double angle = 0.5 + 0.45 * sin(0.004 * k);
        column[0][0] = NUM(1);
        column[1][0] = num_of(cos(angle));
        column[1][1] = num_of(sin(angle));
        column[2][4] = NUM(2);
        step(3u, 0.005);
        const double exact = sqrt(1.0 - cos(angle)); /* of two unit vectors at this angle */
        if (k >= 20) {
            ASSERT_CLOSE(exact, value_of(soft.smallest), 0.02 * exact + IF_FIXED(1e-3, 1e-4));
        }
    }
}

static void test_columns_of_zeros_at_the_end_are_ignored(void) {
    const num_t torque[ROBOT_MAX_JOINTS] = {NUM(1), NUM(2), NUM(3)};
    num_t rejected[ROBOT_MAX_JOINTS];
    column[0][1] = NUM(0.5);
    step(4u, 0.005);
    TEST_ASSERT_EQUAL(1, soft.columns);
    ASSERT_CLOSE(0.5, value_of(soft.smallest), 1e-3);
    soft_reject(&soft, torque, rejected, 0u, NULL);
    ASSERT_CLOSE(1.0, value_of(rejected[0]), 1e-5);
    ASSERT_CLOSE(2.0 * 1e-4, value_of(rejected[1]), 1e-5);
    step(0u, 0.005);
    soft_reject(&soft, torque, rejected, 0u, NULL);
    TEST_ASSERT_EQUAL_MEMORY(torque, rejected, N * sizeof(num_t));
    TEST_ASSERT_TRUE(soft.smallest == NUM(0));
}

/* Signed overflow would end the test: in fixed point the sum of these squares is beyond 64 bits. */
static void test_a_direction_of_any_length_is_followed_again_from_the_next_step_on(void) {
    for (uint32_t c = 0; c < K; ++c) {
        column[c][c] = NUM(0.25);
    }
    column[5][5] = NUM(0.01);
    step(K, 0.005);
    for (uint32_t c = 0; c < K; ++c) {
        soft.weakest[c] = NUM(511);
    }
    step(K, 0.005);
    step(K, 0.005);
    ASSERT_CLOSE(0.01, value_of(soft.smallest), 1e-4);
}

static void test_a_value_that_is_not_a_number_explains_nothing_from_then_on(void) {
    num_t torque[ROBOT_MAX_JOINTS] = {NUM(1), NUM(2), NUM(3)};
    num_t rejected[ROBOT_MAX_JOINTS];
    any_columns(3u, 0.8);
#ifdef TAUPERP_FIXED
    column[1][2] = NUM(511); /* every bit pattern is a number there */
    step(3u, 0.005);
    soft_reject(&soft, torque, rejected, 0u, NULL);
#else
    column[1][2] = 0.0f / 0.0f;
    step(3u, 0.005);
    soft_reject(&soft, torque, rejected, 0u, NULL);
    TEST_ASSERT_FALSE(num_finite(rejected[0])); /* above every threshold */
#endif
    column[1][2] = NUM(0.5);
    step(3u, 0.005);
    soft_reject(&soft, torque, rejected, 0u, NULL);
    TEST_ASSERT_TRUE(num_finite(rejected[0]) && num_finite(soft.smallest));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_remainder_solves_the_normal_equations);
    RUN_TEST(test_the_first_columns_alone_give_their_own_projection);
    RUN_TEST(test_columns_that_are_zero_explain_nothing);
    RUN_TEST(test_the_smallest_singular_value_belongs_to_its_direction);
    RUN_TEST(test_columns_that_depend_on_each_other_have_a_smallest_singular_value_of_nearly_zero);
    RUN_TEST(test_columns_that_were_no_numbers_leave_nothing_behind);
    RUN_TEST(test_the_index_is_continuous_through_a_change_of_rank);
    RUN_TEST(test_the_smallest_singular_value_is_followed);
    RUN_TEST(test_columns_of_zeros_at_the_end_are_ignored);
    RUN_TEST(test_a_direction_of_any_length_is_followed_again_from_the_next_step_on);
    RUN_TEST(test_a_value_that_is_not_a_number_explains_nothing_from_then_on);
    return UNITY_END();
}
