/* The projectors of the first channel: which one answers, its rank and its smallest singular value. */
#include "projection.h"

#include "core_fixture.h"

static projection_t projection;
static num_t column[2][ROBOT_MAX_JOINTS], tau[ROBOT_MAX_JOINTS];
static num_t rejected[ROBOT_MAX_JOINTS], again[ROBOT_MAX_JOINTS], first[ROBOT_MAX_JOINTS];

#define COLUMNS_OF ((const num_t(*)[ROBOT_MAX_JOINTS])column)

void setUp(void) {
    projection_init(&projection);
    memset(column, 0, sizeof(column));
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        tau[i] = num_of(1.0 + i);
    }
    column[0][0] = NUM(1);
    column[1][1] = NUM(0.5);
}
void tearDown(void) {
    TEST_ASSERT_EQUAL(0, projection_saturations(&projection));
}

static void soft(uint32_t k) {
    for (uint32_t step = 0; step < 30u; ++step) { /* the smallest value is followed from step to step */
        projection_soft(&projection, 7u, k, COLUMNS_OF, NUM(0.1), tau, rejected, 0u, first);
    }
}

static void test_it_begins_without_a_result(void) {
    memset(&projection, 0xFF, sizeof(projection));
    projection_init(&projection);
    TEST_ASSERT_TRUE(projection.smallest == NUM(0));
    TEST_ASSERT_EQUAL(0, projection.rank);
    TEST_ASSERT_FALSE(projection.converged);
    TEST_ASSERT_FALSE(projection.soft_projector);
}

static void test_the_rank_of_the_soft_projector_is_one_less_near_a_singularity(void) {
    soft(2u);
    TEST_ASSERT_EQUAL(2, projection.rank);
    ASSERT_CLOSE(0.5, value_of(projection.smallest), 1e-3);
    TEST_ASSERT_TRUE(projection.converged);
    column[1][1] = NUM(0.05);
    soft(2u);
    TEST_ASSERT_EQUAL(1, projection.rank);
    soft(1u);
    TEST_ASSERT_EQUAL(1, projection.rank);
    column[0][0] = NUM(0.05);
    soft(1u);
    TEST_ASSERT_EQUAL(0, projection.rank);
    soft(0u);
    TEST_ASSERT_EQUAL(0, projection.rank);
    TEST_ASSERT_TRUE(projection.smallest == NUM(0));
}

/* The soft projector leaves s^2 / (sigma^2 + s^2) of what the hard one explains. */
static void test_any_torque_is_rejected_by_the_projector_of_the_last_step(void) {
    projection_hard(&projection, 7u, 2u, COLUMNS_OF, NUM(0.005), tau, rejected);
    ASSERT_CLOSE(0.0, value_of(rejected[1]), 1e-5);
    TEST_ASSERT_EQUAL(2, projection.rank);
    ASSERT_CLOSE(3.0, value_of(rejected[2]), 1e-5);
    projection_reject(&projection, tau, again);
    TEST_ASSERT_EQUAL_MEMORY(rejected, again, sizeof(again));
    soft(2u);
    ASSERT_CLOSE(2.0 * 0.01 / (0.25 + 0.01), value_of(rejected[1]), 1e-4);
    projection_reject(&projection, tau, again);
    TEST_ASSERT_EQUAL_MEMORY(rejected, again, sizeof(again));
    projection_hard(&projection, 7u, 2u, COLUMNS_OF, NUM(0.005), tau, rejected);
    projection_reject(&projection, tau, again);
    ASSERT_CLOSE(0.0, value_of(again[1]), 1e-5);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_it_begins_without_a_result);
    RUN_TEST(test_the_rank_of_the_soft_projector_is_one_less_near_a_singularity);
    RUN_TEST(test_any_torque_is_rejected_by_the_projector_of_the_last_step);
    return UNITY_END();
}
