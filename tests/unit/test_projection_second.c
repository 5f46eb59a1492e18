/* The projectors of the second channel, which take Jacobi rotations. This program contains its own projection.c. */
#include <stdbool.h>

#include "jacobi.h"

static unsigned calls, failing; /* the number of the decomposition that does not converge; 0: all do */

/* jacobi_soft, and whether it converges. */
static void counted_soft(jacobi_t *self, uint32_t n, uint32_t k, const num_t columns[][ROBOT_MAX_JOINTS], num_t s) {
    jacobi_soft(self, n, k, columns, s);
    ++calls;
    if (calls == failing) {
        self->converged = false;
    }
}
#define jacobi_soft counted_soft

#define TAUPERP_SECOND         1
#define projection_init        second_projection_init
#define projection_hard        second_projection_hard
#define projection_soft        second_projection_soft
#define projection_reject      second_projection_reject
#define projection_saturations second_projection_saturations
#include "../../firmware/core/projection.c"
#undef jacobi_soft

#include "core_fixture.h"

static projection_t projection;
static subspace_t subspace;
static soft_t soft;
static num_t column[3][ROBOT_MAX_JOINTS], tau[ROBOT_MAX_JOINTS];
static num_t rejected[ROBOT_MAX_JOINTS], first[ROBOT_MAX_JOINTS], expected[ROBOT_MAX_JOINTS];

#define DRAWN ((const num_t(*)[ROBOT_MAX_JOINTS])column)

void setUp(void) {
    calls = 0;
    failing = 0;
    projection_init(&projection);
    subspace_init(&subspace);
    soft_init(&soft);
    random_start(91);
    for (uint32_t i = 0; i < 7u; ++i) {
        for (uint32_t c = 0; c < 3u; ++c) {
            column[c][i] = num_of(random_one());
        }
        tau[i] = num_of(30.0 * random_one());
    }
}
void tearDown(void) {}

static void assert_close_to_expected(const num_t found[]) {
    for (uint32_t i = 0; i < 7u; ++i) {
        ASSERT_CLOSE(value_of(expected[i]), value_of(found[i]), 2e-4);
    }
}

static void assert_smallest_is_the_singular_value(void) {
    num_t singular[3] = {NUM(0)};
    subspace_measure(&subspace, 7u, 3u, DRAWN, NUM(0.005), singular);
    ASSERT_CLOSE(value_of(singular[2]), value_of(projection.smallest), 1e-4);
}

static void test_it_begins_without_a_result(void) {
    projection_t dirty;
    memset(&dirty, 0xFF, sizeof(dirty));
    projection_init(&dirty);
    TEST_ASSERT_TRUE(dirty.smallest == NUM(0));
    TEST_ASSERT_EQUAL(0, dirty.rank);
    TEST_ASSERT_FALSE(dirty.converged);
    TEST_ASSERT_EQUAL(0, projection_saturations(&dirty));
}

static void test_the_hard_projector_is_that_of_the_first_channel(void) {
    subspace_step(&subspace, 7u, 3u, DRAWN, NUM(0.005));
    subspace_reject(&subspace, tau, expected);
    projection_hard(&projection, 7u, 3u, DRAWN, NUM(0.005), tau, rejected);
    assert_close_to_expected(rejected);
    TEST_ASSERT_EQUAL(3, projection.rank);
    TEST_ASSERT_TRUE(projection.converged);
    assert_smallest_is_the_singular_value();
    projection_reject(&projection, tau, first);
    TEST_ASSERT_EQUAL_MEMORY(rejected, first, 7u * sizeof(num_t));
}

static void test_the_soft_projector_is_that_of_the_first_channel(void) {
    soft_step(&soft, 3u, DRAWN, NUM(0.05));
    soft_reject(&soft, tau, expected, 0u, first);
    projection_soft(&projection, 7u, 3u, DRAWN, NUM(0.05), tau, rejected, 0u, first);
    assert_close_to_expected(rejected);
    TEST_ASSERT_EQUAL(1, calls);
    TEST_ASSERT_EQUAL(3, projection.rank);
    TEST_ASSERT_TRUE(projection.converged);
    assert_smallest_is_the_singular_value();
}

/* Two of the three columns are the smaller basis. The result of all three is the one that is kept. */
static void test_the_first_columns_have_their_own_result(void) {
    soft_step(&soft, 2u, DRAWN, NUM(0.05));
    soft_reject(&soft, tau, expected, 0u, first);
    projection_soft(&projection, 7u, 3u, DRAWN, NUM(0.05), tau, rejected, 2u, first);
    assert_close_to_expected(first);
    TEST_ASSERT_EQUAL(2, calls);
    TEST_ASSERT_EQUAL(3, projection.rank);
    soft_step(&soft, 3u, DRAWN, NUM(0.05));
    soft_reject(&soft, tau, expected, 0u, rejected);
    projection_reject(&projection, tau, rejected);
    assert_close_to_expected(rejected);
    soft_step(&soft, 1u, DRAWN, NUM(0.05));
    soft_reject(&soft, tau, expected, 0u, rejected);
    projection_soft(&projection, 7u, 3u, DRAWN, NUM(0.05), tau, rejected, 1u, first);
    assert_close_to_expected(first);
}

static void test_either_decomposition_that_does_not_converge_is_told(void) {
    for (unsigned i = 1; i <= 2u; ++i) {
        calls = 0;
        failing = i;
        projection_soft(&projection, 7u, 3u, DRAWN, NUM(0.05), tau, rejected, 2u, first);
        TEST_ASSERT_FALSE(projection.converged);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_it_begins_without_a_result);
    RUN_TEST(test_the_hard_projector_is_that_of_the_first_channel);
    RUN_TEST(test_the_soft_projector_is_that_of_the_first_channel);
    RUN_TEST(test_the_first_columns_have_their_own_result);
    RUN_TEST(test_either_decomposition_that_does_not_converge_is_told);
    return UNITY_END();
}
