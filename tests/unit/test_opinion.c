#include "opinion.h"

#include <string.h>

#include "unity.h"
#include "values.h"

#define PERIOD_US 1000u

static agree_t agree;
static opinion_t own, other;

void setUp(void) {
    agree = (agree_t){0};
    own = (opinion_t){.wish = WISH_GO_ON,
                      .fresh = true,
                      .state = GUARD_STATE_MONITORING,
                      .joints = 7u,
                      .channels = 1u,
                      .rank = 6u,
                      .period_us = PERIOD_US};
    other = own;
}
void tearDown(void) {}

static bool step(void) {
    return agree_step(&agree, &own, &other);
}

static void assert_disagreement_after(uint32_t ticks) {
    for (uint32_t i = 1; i < ticks; ++i) {
        TEST_ASSERT_TRUE(step());
    }
    TEST_ASSERT_FALSE(step());
}

static void test_equal_opinions_agree(void) {
    for (uint32_t i = 0; i < 1000u; ++i) {
        TEST_ASSERT_TRUE(step());
    }
}

static void test_a_residual_beyond_its_bound_is_a_disagreement_in_the_third_tick(void) {
    for (uint32_t i = 0; i < OPINION_MAX_JOINTS; ++i) {
        setUp();
        own.residual[i] = -3;
        other.residual[i] = AGREE_RESIDUAL - 3;
        TEST_ASSERT_TRUE(step());
        TEST_ASSERT_EQUAL(0, agree.apart);
        other.residual[i] = AGREE_RESIDUAL - 2;
        assert_disagreement_after(AGREE_TICKS + 1u);
        setUp();
        own.residual[i] = AGREE_RESIDUAL;
        TEST_ASSERT_TRUE(step());
        TEST_ASSERT_EQUAL(0, agree.apart);
        own.residual[i] = AGREE_RESIDUAL + 1;
        assert_disagreement_after(AGREE_TICKS + 1u);
    }
}

static void test_an_index_beyond_its_bound_is_a_disagreement_in_the_third_tick(void) {
    for (uint32_t c = 0; c < OPINION_MAX_CHANNELS; ++c) {
        for (uint32_t i = 0; i < OPINION_MAX_JOINTS; ++i) {
            setUp();
            other.index[c][i] = AGREE_INDEX;
            TEST_ASSERT_TRUE(step());
            TEST_ASSERT_EQUAL(0, agree.apart);
            other.index[c][i] = -AGREE_INDEX - 1;
            assert_disagreement_after(AGREE_TICKS + 1u);
        }
    }
}

static void test_numbers_at_the_ends_of_their_range_do_not_overflow(void) {
    own.residual[0] = INT32_MAX;
    other.residual[0] = INT32_MIN;
    assert_disagreement_after(AGREE_TICKS + 1u);
}

static void test_a_difference_of_one_tick_is_tolerated(void) {
    for (uint32_t i = 0; i < 10u; ++i) {
        other.residual[0] = AGREE_RESIDUAL + 1;
        TEST_ASSERT_TRUE(step());
        TEST_ASSERT_TRUE(step());
        other.residual[0] = 0;
        TEST_ASSERT_TRUE(step());
    }
}

static void test_a_snapshot_that_only_one_evaluates_is_a_disagreement_in_the_third_tick(void) {
    other.fresh = false;
    assert_disagreement_after(AGREE_TICKS + 1u);
}

static void test_facts_that_differ_are_a_disagreement_at_once(void) {
    const opinion_t good = own;
    other.state = GUARD_STATE_WAITING;
    TEST_ASSERT_FALSE(step());
    other = good;
    other.trip_number = 1u;
    TEST_ASSERT_FALSE(step());
    other = good;
    other.joints = 6u;
    TEST_ASSERT_FALSE(step());
    other = good;
    other.channels = 2u;
    TEST_ASSERT_FALSE(step());
    other = good;
    other.hard = true;
    TEST_ASSERT_FALSE(step());
    other = good;
    other.cycle = 1u;
    TEST_ASSERT_FALSE(step());
    other = good;
    other.task = 2u;
    TEST_ASSERT_FALSE(step());
    other = good;
    TEST_ASSERT_TRUE(step());
}

static void test_a_channel_in_fault_is_not_a_disagreement(void) {
    other.state = GUARD_STATE_FAULT;
    other.wish = WISH_FAULT;
    TEST_ASSERT_TRUE(step());
}

static void test_the_self_tests_push_is_not_compared(void) {
    own.state = GUARD_STATE_SELF_TEST;
    other.state = GUARD_STATE_SELF_TEST;
    other.residual[0] = 10 * AGREE_RESIDUAL;
    for (uint32_t i = 0; i < 100u; ++i) {
        TEST_ASSERT_TRUE(step());
    }
}

static void test_ranks_of_the_hard_projector_may_differ_for_half_a_second(void) {
    own.hard = true;
    other.hard = true;
    other.rank = 5u;
    other.index[0][0] = 10 * AGREE_INDEX;
    assert_disagreement_after(AGREE_RANK_MAX_US / PERIOD_US);
}

static void test_indexes_are_compared_again_after_the_filters_have_settled(void) {
    own.hard = true;
    other.hard = true;
    other.rank = 5u;
    other.index[0][0] = 10 * AGREE_INDEX;
    TEST_ASSERT_TRUE(step());
    other.rank = 6u;
    assert_disagreement_after((AGREE_RANK_US / PERIOD_US) + AGREE_TICKS);
}

static void test_indexes_are_not_compared_while_a_saturated_value_is_in_the_filters(void) {
    for (uint32_t k = 0; k < 2u; ++k) { /* of either channel */
        setUp();
        own.saturated = k == 0u;
        other.saturated = k == 1u;
        other.index[0][0] = 10 * AGREE_INDEX;
        TEST_ASSERT_TRUE(step());
        own.saturated = false;
        other.saturated = false;
        assert_disagreement_after((AGREE_RANK_US / PERIOD_US) + AGREE_TICKS);
    }
}

static void test_residuals_are_compared_for_any_ranks(void) {
    own.hard = true;
    other.hard = true;
    other.rank = 5u;
    other.residual[0] = AGREE_RESIDUAL + 1;
    assert_disagreement_after(AGREE_TICKS + 1u);
}

static void test_ranks_of_the_soft_projector_are_telemetry(void) {
    other.rank = 5u;
    for (uint32_t i = 0; i < 2000u; ++i) {
        TEST_ASSERT_TRUE(step());
    }
    other.index[0][0] = AGREE_INDEX + 1;
    assert_disagreement_after(AGREE_TICKS + 1u);
}

static void start_with_ranks_apart(uint32_t period_us) {
    setUp();
    own.period_us = period_us;
    own.hard = true;
    other = own;
    other.rank = 5u;
}

/* 31 times 16,129 us are 499,999 us. */
static void test_half_a_second_of_other_ranks_counts_from_their_first_tick(void) {
    start_with_ranks_apart(16129u);
    other.rank = own.rank;
    TEST_ASSERT_TRUE(step());
    other.rank = 5u;
    assert_disagreement_after(32u);
}

/* 2^32 us are 72 minutes: no counter of time runs over. */
static void test_ranks_that_stay_apart_never_agree_again(void) {
    start_with_ranks_apart(50000u);
    assert_disagreement_after(10u);
    for (uint32_t i = 0; i < 90000u; ++i) {
        TEST_ASSERT_FALSE(step());
    }
}

/* 27 times 37,037 us are one microsecond less than a second. */
static void test_the_wait_for_the_filters_is_a_whole_second(void) {
    start_with_ranks_apart(37037u);
    TEST_ASSERT_TRUE(step());
    other.rank = own.rank;
    other.index[0][0] = AGREE_INDEX + 1;
    for (uint32_t i = 0; i < 27u; ++i) {
        TEST_ASSERT_TRUE(step());
        TEST_ASSERT_EQUAL(0, agree.apart);
    }
    TEST_ASSERT_TRUE(step());
    TEST_ASSERT_EQUAL(1, agree.apart);
}

static void test_numbers_that_stay_apart_never_agree_again(void) {
    agree.apart = UINT32_MAX;
    other.residual[0] = AGREE_RESIDUAL + 1;
    TEST_ASSERT_FALSE(step());
    TEST_ASSERT_FALSE(step());
}

static void test_a_category_counts_among_stops_only(void) {
    own.wish = WISH_STOP;
    own.category = 1u;
    TEST_ASSERT_EQUAL_PTR(&own, opinion_worse(&own, &other));
}

static void test_the_worse_wish_applies_and_of_two_equal_ones_the_first(void) {
    TEST_ASSERT_EQUAL_PTR(&own, opinion_worse(&own, &other));
    other.wish = WISH_STOP;
    TEST_ASSERT_EQUAL_PTR(&other, opinion_worse(&own, &other));
    TEST_ASSERT_EQUAL_PTR(&other, opinion_worse(&other, &own));
    own.wish = WISH_STOP;
    TEST_ASSERT_EQUAL_PTR(&own, opinion_worse(&own, &other));
    own.category = 2u;
    other.category = 1u;
    TEST_ASSERT_EQUAL_PTR(&other, opinion_worse(&own, &other));
    own.wish = WISH_FAULT;
    TEST_ASSERT_EQUAL_PTR(&own, opinion_worse(&own, &other));
    TEST_ASSERT_EQUAL_PTR(&own, opinion_worse(&other, &own));
}

static void test_a_disagreement_that_lasts_stays_one(void) {
    own.hard = true;
    other.hard = true;
    other.rank = 5u;
    other.residual[0] = AGREE_RESIDUAL + 1;
    for (uint32_t i = 0; i < (2u * AGREE_RANK_MAX_US) / PERIOD_US; ++i) {
        (void)step();
    }
    TEST_ASSERT_FALSE(step());
    TEST_ASSERT_EQUAL(AGREE_RANK_MAX_US, agree.rank_us);
    TEST_ASSERT_EQUAL(AGREE_TICKS + 1u, agree.apart);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_disagreement_that_lasts_stays_one);
    RUN_TEST(test_equal_opinions_agree);
    RUN_TEST(test_a_residual_beyond_its_bound_is_a_disagreement_in_the_third_tick);
    RUN_TEST(test_an_index_beyond_its_bound_is_a_disagreement_in_the_third_tick);
    RUN_TEST(test_numbers_at_the_ends_of_their_range_do_not_overflow);
    RUN_TEST(test_a_difference_of_one_tick_is_tolerated);
    RUN_TEST(test_a_snapshot_that_only_one_evaluates_is_a_disagreement_in_the_third_tick);
    RUN_TEST(test_facts_that_differ_are_a_disagreement_at_once);
    RUN_TEST(test_a_channel_in_fault_is_not_a_disagreement);
    RUN_TEST(test_the_self_tests_push_is_not_compared);
    RUN_TEST(test_ranks_of_the_hard_projector_may_differ_for_half_a_second);
    RUN_TEST(test_indexes_are_compared_again_after_the_filters_have_settled);
    RUN_TEST(test_indexes_are_not_compared_while_a_saturated_value_is_in_the_filters);
    RUN_TEST(test_residuals_are_compared_for_any_ranks);
    RUN_TEST(test_ranks_of_the_soft_projector_are_telemetry);
    RUN_TEST(test_half_a_second_of_other_ranks_counts_from_their_first_tick);
    RUN_TEST(test_ranks_that_stay_apart_never_agree_again);
    RUN_TEST(test_the_wait_for_the_filters_is_a_whole_second);
    RUN_TEST(test_numbers_that_stay_apart_never_agree_again);
    RUN_TEST(test_a_category_counts_among_stops_only);
    RUN_TEST(test_the_worse_wish_applies_and_of_two_equal_ones_the_first);
    return UNITY_END();
}
