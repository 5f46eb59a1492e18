/* Intrusive: words of the guard's state that are wrong between two ticks, one after the other. Each is a FAULT, or at
 * least ends the permission. */
#include "guard_parts.h"
#include "permitted_fixture.h"

static void assert_corrupt(void) {
    tick(&bench);
    assert_fault(&bench, GUARD_REASON_STATE_CORRUPT);
    setUp();
}

static void set_state(uint32_t state) {
    guard->state = state;
    guard->state_inverted = ~state;
}

static void test_a_state_that_does_not_exist_is_a_fault(void) {
    set_state((uint32_t)GUARD_STATE_FAULT + 1u);
    assert_corrupt();
    set_state((uint32_t)GUARD_STATE_UNINITIALISED);
    assert_corrupt();
}

static void test_a_counter_that_no_frame_can_carry_is_a_fault(void) {
    guard->report.stop.counter = E2E_COUNTER_MASK + 1u;
    assert_corrupt();
    guard->report.status.counter = E2E_COUNTER_MASK + 1u;
    assert_corrupt();
    guard->report.index.counter = E2E_COUNTER_MASK + 1u;
    assert_corrupt();
    for (uint32_t slot = 0; slot < (uint32_t)PROTOCOL_RECEIVE_COUNT; ++slot) {
        guard->inputs.receiver[slot].lost = E2E_MAX_DELTA;
        assert_corrupt();
    }
}

static void test_a_snapshot_that_cannot_be_is_a_fault(void) {
    guard->inputs.snapshot.received |= 0x80u; /* of a joint that the arm has not */
    assert_corrupt();
}

static void test_a_task_that_does_not_exist_is_a_fault(void) {
    guard->inputs.task_number = (uint8_t)TASK_COUNT;
    guard->inputs.task_number_inverted = ~(uint32_t)guard->inputs.task_number;
    assert_corrupt();
    guard->task = (uint32_t)TASK_COUNT;
    guard->task_inverted = ~guard->task;
    assert_corrupt();
}

static void assert_config_corrupt(void) {
    tick(&bench);
    assert_fault(&bench, GUARD_REASON_CONFIG_CORRUPT);
    setUp();
}

static void test_a_number_of_joints_that_bounds_nothing_is_a_fault(void) {
    guard->joints = ROBOT_MAX_JOINTS + 1u;
    assert_config_corrupt();
    guard->joints = JOINTS - 1u;
    assert_config_corrupt();
    guard->inputs.snapshot.expected = 0x3Fu; /* a snapshot of six joints that has just begun */
    guard->inputs.snapshot.received = 0u;
    guard->inputs.snapshot.taken = false;
    assert_config_corrupt();
}

static void test_a_damaged_sum_over_the_block_is_a_fault(void) {
    guard->watch.common ^= 1u;
    assert_config_corrupt();
}

static void test_a_damaged_first_word_of_the_block_is_a_fault(void) {
    bench.config.magic ^= 1u;
    assert_config_corrupt();
}

static void test_an_input_from_the_future_is_a_fault(void) {
    guard_input_t *const input[] = {&guard->inputs.sync, &guard->inputs.joints, &guard->inputs.task};
    for (size_t i = 0; i < sizeof(input) / sizeof(input[0]); ++i) {
        input[i]->good_us = bench.now_us + 1000u * PERIOD_US;
        tick(&bench);
        assert_fault(&bench, GUARD_REASON_TIME_BACKWARDS);
        setUp();
    }
}

static void test_a_reason_that_does_not_exist_is_a_fault(void) {
    guard_trip(guard, (guard_reason_t)200u);
    cycle(&bench);
    assert_fault(&bench, (guard_reason_t)200u);
}

/* The second computation of the permission, from its own words. */
static void test_the_second_computation_withholds_on_each_of_its_conditions(void) {
    guard_output_t out = {.permitted = false};
    verdict_fill(guard, INPUT_NONE, bench.now_us, &out);
    TEST_ASSERT_TRUE(out.permitted);
    TEST_ASSERT_FALSE(out.withheld);
    const guard_t good = *guard;
    bool *const conditions[] = {&guard->detector.tripped, &guard->explained.tripped};
    for (size_t i = 0; i < sizeof(conditions) / sizeof(conditions[0]); ++i) {
        *conditions[i] = true;
        verdict_fill(guard, INPUT_NONE, bench.now_us, &out);
        TEST_ASSERT_TRUE(out.withheld);
        *guard = good;
    }
    bench.config.task[guard->task].needed_links = 1u;
    bench.config.sight.reaction = SIGHT_WITHDRAW;
    guard->sight.blind = 1u;
    verdict_fill(guard, INPUT_NONE, bench.now_us, &out);
    TEST_ASSERT_TRUE(out.withheld);
    *guard = good;
    bench.config.task[guard->task].needed_links = 0u; /* link 1 is blind in every pose */
    verdict_fill(guard, INPUT_NONE, bench.now_us, &out);
    TEST_ASSERT_FALSE(out.withheld);
    bench.config.sight.reaction = SIGHT_SLOW;
    bench.config.task[guard->task].needed_links = 1u;
    guard->sight.blind = 1u;
    verdict_fill(guard, INPUT_NONE, bench.now_us, &out);
    TEST_ASSERT_FALSE(out.withheld);
    *guard = good;
    guard->acknowledged = (uint8_t)GUARD_CLEAR;
    verdict_fill(guard, INPUT_NONE, bench.now_us, &out);
    TEST_ASSERT_TRUE(out.withheld);
    *guard = good;
    guard->settled_cycles = 0;
    verdict_fill(guard, INPUT_NONE, bench.now_us, &out);
    TEST_ASSERT_TRUE(out.withheld);
    *guard = good;
    guard->plausibility.fault = (uint32_t)GUARD_REASON_FROZEN;
    verdict_fill(guard, INPUT_NONE, bench.now_us, &out);
    TEST_ASSERT_TRUE(out.withheld);
    *guard = good;
    guard->inputs.fault = (uint32_t)GUARD_REASON_BUS_OFF;
    verdict_fill(guard, INPUT_NONE, bench.now_us, &out);
    TEST_ASSERT_TRUE(out.withheld);
    *guard = good;
    guard->state_inverted ^= 1u;
    verdict_fill(guard, INPUT_NONE, bench.now_us, &out);
    TEST_ASSERT_TRUE(out.withheld);
    *guard = good;
    guard->inputs.task_cycle = (uint16_t)(bench.cycle - 3u * DEADLINE_CYCLES);
    verdict_fill(guard, INPUT_NONE, bench.now_us, &out);
    TEST_ASSERT_TRUE(out.withheld);
    *guard = good;
    guard->inputs.snapshot.taken_cycle = (uint16_t)(bench.cycle - 3u * DEADLINE_CYCLES);
    verdict_fill(guard, INPUT_NONE, bench.now_us, &out);
    TEST_ASSERT_TRUE(out.withheld);
    *guard = good;
}

static void test_the_second_computation_withholds_for_an_input_that_is_old_or_never_came(void) {
    guard_output_t out = {.permitted = false};
    const guard_t good = *guard;
    guard_input_t *const input[] = {&guard->inputs.sync, &guard->inputs.joints, &guard->inputs.task};
    const uint64_t deadline[] = {bench.config.sync_deadline_us, bench.config.joint_deadline_us,
                                 bench.config.task_deadline_us};
    for (size_t i = 0; i < sizeof(input) / sizeof(input[0]); ++i) {
        input[i]->seen = false;
        verdict_fill(guard, INPUT_NONE, bench.now_us, &out);
        TEST_ASSERT_TRUE(out.withheld);
        *guard = good;
        input[i]->good_us = bench.now_us + 1u;
        verdict_fill(guard, INPUT_NONE, bench.now_us, &out);
        TEST_ASSERT_TRUE(out.withheld);
        *guard = good;
        input[i]->good_us = bench.now_us - deadline[i];
        verdict_fill(guard, INPUT_NONE, bench.now_us, &out);
        TEST_ASSERT_FALSE(out.withheld);
        input[i]->good_us = bench.now_us - deadline[i] - 1u;
        verdict_fill(guard, INPUT_NONE, bench.now_us, &out);
        TEST_ASSERT_TRUE(out.withheld);
        *guard = good;
    }
}

/* The output says stop and has no number outside of the state, whatever the words hold. */
static void test_a_state_that_does_not_exist_permits_nothing(void) {
    guard_output_t out = {.permitted = true};
    set_state((uint32_t)GUARD_STATE_FAULT + 1u);
    guard->joints = ROBOT_MAX_JOINTS + 1u;
    verdict_fill(guard, INPUT_NONE, bench.now_us, &out);
    TEST_ASSERT_FALSE(out.permitted);
    TEST_ASSERT_TRUE(out.withheld);
    TEST_ASSERT_EQUAL(GUARD_REASON_UNINITIALISED, out.reason);
    TEST_ASSERT_EQUAL(bench.config.stop_input, out.stop_category);
    set_state((uint32_t)GUARD_STATE_UNINITIALISED);
    verdict_fill(guard, INPUT_NONE, bench.now_us, &out);
    TEST_ASSERT_FALSE(out.permitted);
    TEST_ASSERT_EQUAL(GUARD_REASON_UNINITIALISED, out.reason);
    TEST_ASSERT_EQUAL(bench.config.stop_input, out.stop_category);
    guard_say(guard, &out);
    TEST_ASSERT_EQUAL_HEX8(0xF0, out.frame[0].data[2]);
}

static void test_a_result_that_is_no_number_is_not_valid(void) {
    TEST_ASSERT_TRUE(stages_valid(guard));
    guard->index.converged = false;
    TEST_ASSERT_FALSE(stages_valid(guard));
    guard->index.converged = true;
#ifndef TAUPERP_FIXED /* every pattern of Q9.22 is a number */
    const num_t none = 0.0f / 0.0f;
    guard->index.columns = 2u;
    num_t *const results[] = {&guard->observer.residual[0], &guard->detector.value_nm[0],
                              &guard->explained.coefficient[0]};
    for (size_t i = 0; i < sizeof(results) / sizeof(results[0]); ++i) {
        const num_t good = *results[i];
        *results[i] = none;
        TEST_ASSERT_FALSE(stages_valid(guard));
        *results[i] = good;
        TEST_ASSERT_TRUE(stages_valid(guard));
    }
#endif
}

static void test_counters_of_cycles_stay_at_their_ends(void) {
    guard->settled_cycles = UINT32_MAX;
    guard->task_cycles = UINT32_MAX;
    cycle(&bench);
    TEST_ASSERT_TRUE(bench.out.permitted);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, guard->settled_cycles);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, guard->task_cycles);
    guard_note_start(guard, GUARD_START_POWER_ON, 1000u, GUARD_VARIANT_PRODUCT);
    TEST_ASSERT_EQUAL(UINT8_MAX, guard->restarts);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_state_that_does_not_exist_is_a_fault);
    RUN_TEST(test_a_counter_that_no_frame_can_carry_is_a_fault);
    RUN_TEST(test_a_snapshot_that_cannot_be_is_a_fault);
    RUN_TEST(test_a_task_that_does_not_exist_is_a_fault);
    RUN_TEST(test_a_number_of_joints_that_bounds_nothing_is_a_fault);
    RUN_TEST(test_a_damaged_sum_over_the_block_is_a_fault);
    RUN_TEST(test_a_damaged_first_word_of_the_block_is_a_fault);
    RUN_TEST(test_an_input_from_the_future_is_a_fault);
    RUN_TEST(test_a_reason_that_does_not_exist_is_a_fault);
    RUN_TEST(test_the_second_computation_withholds_on_each_of_its_conditions);
    RUN_TEST(test_the_second_computation_withholds_for_an_input_that_is_old_or_never_came);
    RUN_TEST(test_a_state_that_does_not_exist_permits_nothing);
    RUN_TEST(test_a_result_that_is_no_number_is_not_valid);
    RUN_TEST(test_counters_of_cycles_stay_at_their_ends);
    return UNITY_END();
}
