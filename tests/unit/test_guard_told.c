/* What the guard tells in each state, and which task, joint and link it tells it of. */
#include <math.h>

#include "guard_parts.h"
#include "permitted_fixture.h"

static void test_a_task_stays_for_its_dwell_of_250_cycles(void) {
    cycles(&bench, 250u);
    TEST_ASSERT_EQUAL(TASK_NONE, bench.out.task);
    bench.task = TASK_PAYLOAD;
    cycle(&bench);
    TEST_ASSERT_EQUAL(TASK_PAYLOAD, bench.out.task);
    bench.task = TASK_CONTACT;
    for (uint32_t i = 0; i < 249u; ++i) {
        cycle(&bench);
        TEST_ASSERT_EQUAL(TASK_PAYLOAD, bench.out.task);
    }
    cycle(&bench);
    TEST_ASSERT_EQUAL(TASK_CONTACT, bench.out.task);
}

/* The self-test pushes the joints itself. */
static void test_the_self_test_tells_no_measurement(void) {
    uint32_t pushed = 0;
    start(&bench);
    cycle(&bench);
    while (bench.out.state == GUARD_STATE_SELF_TEST) {
        for (uint32_t i = 0; i < JOINTS; ++i) {
            TEST_ASSERT_TRUE((bench.out.residual[i] == NUM(0)) && (bench.out.index[i] == NUM(0)));
            pushed += (guard->observer.residual[i] != NUM(0)) ? 1u : 0u;
        }
        cycle(&bench);
    }
    TEST_ASSERT_TRUE(pushed > 0u);
}

static void test_an_arm_of_seven_joints_has_no_eighth_value(void) {
    guard_output_t out = {0};
    guard->observer.residual[7] = NUM(5);
    guard->detector.value_nm[7] = NUM(5);
    verdict_fill(guard, INPUT_NONE, bench.now_us, &out);
    TEST_ASSERT_TRUE((out.residual[7] == NUM(0)) && (out.index[7] == NUM(0)));
}

static void test_the_joint_nearest_to_its_threshold_is_told_while_motion_is_permitted(void) {
    push(&bench, 2u, 100);
    cycles(&bench, 50u);
    TEST_ASSERT_TRUE(bench.out.permitted);
    TEST_ASSERT_EQUAL(3, bench.out.joint);
    TEST_ASSERT_TRUE(bench.out.value_nm == guard->detector.value_nm[2]);
    TEST_ASSERT_TRUE(bench.out.full_speed);
    guard_trip(guard, GUARD_REASON_BUS_OFF);
    cycle(&bench);
    assert_stopped(&bench, GUARD_REASON_BUS_OFF, 0u);
    TEST_ASSERT_FALSE(bench.out.full_speed); /* no permission, at no speed */
}

/* One joint is missing, but the reason is another input. */
static void test_a_joint_is_named_only_if_joints_are_missing(void) {
    guard->inputs.snapshot.received = 0x70u;
    TEST_ASSERT_EQUAL(1, input_event(guard, INPUT_JOINTS, false).joint);
    TEST_ASSERT_EQUAL(0, input_event(guard, INPUT_SYNC, false).joint);
    TEST_ASSERT_EQUAL(0, input_event(guard, INPUT_TASK, false).joint);
    guard->state = (uint32_t)GUARD_STATE_WAITING;
    verdict_fill(guard, INPUT_JOINTS, bench.now_us, &bench.out);
    TEST_ASSERT_EQUAL(GUARD_REASON_WAITING_JOINT, bench.out.reason);
    TEST_ASSERT_EQUAL(1, bench.out.joint);
    verdict_fill(guard, INPUT_SYNC, bench.now_us, &bench.out);
    TEST_ASSERT_EQUAL(GUARD_REASON_WAITING_SYNC, bench.out.reason);
    TEST_ASSERT_EQUAL(0, bench.out.joint);
}

static void test_a_guard_that_settles_does_not_know_yet_whether_it_is_blind(void) {
    guard->state = (uint32_t)GUARD_STATE_WAITING;
    bench.config.sight.reaction = SIGHT_WITHDRAW;
    bench.config.task[TASK_NONE].needed_links = 1u;
    guard->sight.blind = 1u;
    verdict_fill(guard, INPUT_NONE, bench.now_us, &bench.out);
    TEST_ASSERT_EQUAL(GUARD_REASON_BLIND, bench.out.reason);
    guard->settled_cycles = 0;
    verdict_fill(guard, INPUT_NONE, bench.now_us, &bench.out);
    TEST_ASSERT_EQUAL(GUARD_REASON_SETTLING, bench.out.reason);
}

/* A second contact needs three snapshots in a row. A tick without a snapshot is none. */
static void test_a_contact_grows_by_snapshots_not_by_ticks(void) {
    guard_trip(guard, GUARD_REASON_BUS_OFF);
    cycles(&bench, 600u);
    push(&bench, 2u, 3000);
    for (uint32_t i = 0; (i < 10u) && (guard->rise.snapshots == 0u); ++i) {
        cycle(&bench);
    }
    for (uint32_t i = 0; i < 3u; ++i) {
        TEST_ASSERT_EQUAL(1, guard->rise.snapshots);
        next_cycle(&bench);
        tick(&bench);
    }
}

/* Both use the link that the motion pass keeps. */
static void test_the_sight_pauses_while_the_touched_link_is_searched(void) {
    const guard_event_t event = {.reason = GUARD_REASON_COLLISION, .joint = 1u};
    guard->sight.axis = 2u;
    guard->sight.seen = true;
    guard->contact.held = 700u;
    contact_note_trip(guard, &event);
    TEST_ASSERT_EQUAL(0, guard->contact.held);
    TEST_ASSERT_FALSE(guard->sight.seen);
    uint32_t ticks = 0;
    for (; guard->contact.locate.steps > 0u; ++ticks) {
        TEST_ASSERT_EQUAL(0, guard->sight.axis);
        cycle(&bench);
    }
    TEST_ASSERT_EQUAL(64u + JOINTS, ticks); /* 64 ms, and each link */
    cycle(&bench);
    TEST_ASSERT_EQUAL(1, guard->sight.axis);
}

/* As many as bound a loop. In float a coefficient may be no number. */
static void test_a_result_that_is_no_number_is_found_wherever_it_is(void) {
    bench.task = TASK_CONTACT;
    cycles(&bench, 300u);
    TEST_ASSERT_EQUAL(6, guard->index.columns);
    TEST_ASSERT_TRUE(stages_valid(guard));
#ifndef TAUPERP_FIXED
    for (uint32_t c = 0; c < guard->index.columns; ++c) {
        const num_t before = guard->explained.coefficient[c];
        guard->explained.coefficient[c] = (num_t)NAN;
        TEST_ASSERT_FALSE(stages_valid(guard));
        guard->explained.coefficient[c] = before;
    }
#endif
}

/* Corrupt in the state and in the block alike. No loop may run to it. */
static void test_a_number_of_joints_beyond_every_array_is_a_corrupt_configuration(void) {
    guard->joints = 40u;
    bench.config.robot.joint_count = 40u;
    guard->report.round_robin = 19u; /* a joint of GuardIndex is due: the tenth, if there were 40 */
    next_cycle(&bench);
    tick(&bench);
    assert_fault(&bench, GUARD_REASON_CONFIG_CORRUPT);
    TEST_ASSERT_EQUAL(2, bench.out.frame_count);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_task_stays_for_its_dwell_of_250_cycles);
    RUN_TEST(test_the_self_test_tells_no_measurement);
    RUN_TEST(test_an_arm_of_seven_joints_has_no_eighth_value);
    RUN_TEST(test_the_joint_nearest_to_its_threshold_is_told_while_motion_is_permitted);
    RUN_TEST(test_a_joint_is_named_only_if_joints_are_missing);
    RUN_TEST(test_a_guard_that_settles_does_not_know_yet_whether_it_is_blind);
    RUN_TEST(test_a_contact_grows_by_snapshots_not_by_ticks);
    RUN_TEST(test_the_sight_pauses_while_the_touched_link_is_searched);
    RUN_TEST(test_a_result_that_is_no_number_is_found_wherever_it_is);
    RUN_TEST(test_a_number_of_joints_beyond_every_array_is_a_corrupt_configuration);
    return UNITY_END();
}
