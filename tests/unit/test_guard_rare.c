/* What the guard does where two events meet, and at the ends of its counters. */
#include "guard_fixture.h"
#include "guard_parts.h"

static bench_t bench;
static guard_t *const guard = &bench.guard;

void setUp(void) {
    start(&bench);
}
void tearDown(void) {}

static void test_an_input_that_cannot_be_trusted_comes_before_a_collision(void) {
    run_until_permitted(&bench);
    guard->detector.tripped = true;
    guard_trip(guard, GUARD_REASON_BUS_OFF);
    next_cycle(&bench);
    tick(&bench);
    assert_stopped(&bench, GUARD_REASON_BUS_OFF, 0u);
}

static void test_a_second_contact_after_a_stop_of_the_worst_category_is_no_new_trip(void) {
    guard_config_t config = make_config();
    config.stop_collision = 0u;
    seal_config(&config);
    start_with(&bench, &config);
    run_until_permitted(&bench);
    push(&bench, 2u, 1500);
    cycles(&bench, 50u);
    assert_stopped(&bench, GUARD_REASON_COLLISION, 3u);
    TEST_ASSERT_EQUAL(0, bench.out.stop_category);
    push(&bench, 2u, -1500);
    cycles(&bench, 4u * SETTLING_CYCLES);
    push(&bench, 2u, 1500);
    cycles(&bench, 50u);
    TEST_ASSERT_EQUAL(1, bench.out.trip_number);
}

/* On one joint the limit on |r| is exceeded all the time. Another joint's index grows, and is not tripped yet. */
static void test_a_contact_that_grows_is_named_only_when_it_has_tripped(void) {
    guard_config_t config = make_config();
    config.task[TASK_NONE].detector.debounce_ticks = 50u;
    config.task[TASK_NONE].detector.threshold_nm[0][1] = NUM(20);
    config.task[TASK_NONE].limits.residual_max_nm[1] = NUM(1);
    seal_config(&config);
    start_with(&bench, &config);
    run_until_permitted(&bench);
    push(&bench, 1u, 500);
    cycles(&bench, 2u * SETTLING_CYCLES);
    assert_stopped(&bench, GUARD_REASON_RESIDUAL_LIMIT, 2u);
    cycles(&bench, 600u); /* what rises from here on is a second contact */
    push(&bench, 3u, 2000);
    uint32_t rising = 0;
    for (uint32_t i = 0; i < 40u; ++i) {
        cycle(&bench);
        rising += (guard->rise.snapshots >= 3u) ? 1u : 0u;
        TEST_ASSERT_EQUAL(1, bench.out.trip_number);
    }
    TEST_ASSERT_TRUE(rising > 0u);
    cycles(&bench, 2u * SETTLING_CYCLES);
    assert_stopped(&bench, GUARD_REASON_COLLISION, 4u);
    TEST_ASSERT_EQUAL(2, bench.out.trip_number);
}

/* The first reset is granted in a tick without a snapshot. The second one comes in the tick that permits again. */
static void test_a_reset_more_than_needed_is_refused_and_does_no_harm(void) {
    run_until_permitted(&bench);
    guard_trip(guard, GUARD_REASON_BUS_OFF);
    cycles(&bench, 2u * SETTLING_CYCLES);
    receive(&bench, reset_frame(&bench, 1u, false));
    cycle(&bench);
    const uint32_t refused = guard->counters.resets_refused;
    next_cycle(&bench);
    receive(&bench, reset_frame(&bench, 1u, true));
    tick(&bench);
    TEST_ASSERT_EQUAL(GUARD_STATE_WAITING, bench.out.state);
    receive(&bench, reset_frame(&bench, 1u, false));
    receive(&bench, reset_frame(&bench, 1u, true));
    cycle(&bench);
    TEST_ASSERT_TRUE(bench.out.permitted);
    TEST_ASSERT_EQUAL(refused + 1u, guard->counters.resets_refused);
}

/* Time advances by microseconds, the cycle number as if by periods. */
static void test_readings_that_are_old_in_cycles_are_missing_though_young_in_time(void) {
    run_until_permitted(&bench);
    for (uint32_t i = 0; i <= DEADLINE_CYCLES; ++i) {
        ++bench.cycle;
        ++bench.now_us;
        receive(&bench, sync_frame(&bench));
        receive(&bench, task_frame(&bench));
        tick(&bench);
    }
    assert_stopped(&bench, GUARD_REASON_JOINT_TIMEOUT, 1u);
}

static void test_a_channel_of_sudden_and_a_limit_on_the_residual_name_themselves(void) {
    run_until_permitted(&bench);
    guard->detector.tripped = true;
    guard->detector.joint = 5u;
    bench.config.bank.channel[guard->detector.channel[5]].of = CHANNEL_SUDDEN;
    TEST_ASSERT_EQUAL(GUARD_REASON_SUDDEN, contact_event(guard).reason);
    TEST_ASSERT_EQUAL(6, contact_event(guard).joint);
    guard->detector.tripped = false;
    guard->explained.tripped = true;
    guard->explained.joint = 3u;
    guard->explained.excess = EXPLAINED_RESIDUAL;
    TEST_ASSERT_EQUAL(GUARD_REASON_RESIDUAL_LIMIT, contact_event(guard).reason);
    TEST_ASSERT_EQUAL(4, contact_event(guard).joint);
    guard->explained.excess = EXPLAINED_FORCE;
    TEST_ASSERT_EQUAL(GUARD_REASON_EXPLAINED_FORCE, contact_event(guard).reason);
    TEST_ASSERT_EQUAL(0, contact_event(guard).joint);
    guard->explained.tripped = false; /* the debounce is not over */
    TEST_ASSERT_EQUAL(GUARD_REASON_NONE, contact_event(guard).reason);
}

static void test_readings_are_compared_within_the_longest_gap_alone(void) {
    run_until_permitted(&bench);
    static const uint32_t gaps[] = {0u, CONFIG_MAX_GAP + 1u};
    for (size_t i = 0; i < sizeof(gaps) / sizeof(gaps[0]); ++i) {
        plausibility_t state = guard->plausibility;
        snapshot_t jumped = guard->inputs.snapshot;
        jumped.position[0] += NUM(1);
        plausibility_step(&state, &bench.config.observer, JOINTS, 1u, &jumped, &guard->motion);
        TEST_ASSERT_EQUAL(GUARD_REASON_IMPLAUSIBLE, state.fault);
        state = guard->plausibility;
        plausibility_step(&state, &bench.config.observer, JOINTS, gaps[i], &jumped, &guard->motion);
        TEST_ASSERT_EQUAL(0, state.fault);
    }
}

static void test_after_a_gap_that_the_observer_cannot_bridge_it_settles_again(void) {
    run_until_permitted(&bench);
    for (uint32_t i = 0; i < CONFIG_MAX_GAP + 1u; ++i) {
        cycle_without(&bench, 1u);
    }
    TEST_ASSERT_TRUE(guard->settled_cycles >= SETTLING_CYCLES);
    cycles(&bench, 2u); /* the first good frame of the joint only sets the reference of its counter */
    TEST_ASSERT_EQUAL(0, guard->settled_cycles);
}

static void test_the_lowest_raw_value_is_no_reading(void) {
    run_until_permitted(&bench);
    bench.position[4] = INT16_MIN;
    cycle(&bench);
    assert_stopped(&bench, GUARD_REASON_INPUT_RANGE, 5u);
}

static void test_cycles_that_pass_while_time_stands_are_a_fault(void) {
    run_until_permitted(&bench);
    for (uint32_t i = 0; i < 130u; ++i) {
        ++bench.cycle;
        receive(&bench, sync_frame(&bench));
    }
    bench.now_us += PERIOD_US;
    tick(&bench);
    assert_fault(&bench, GUARD_REASON_CLOCK_STOPPED);
}

static void test_one_frame_that_arrives_many_times_counts_as_one_repetition(void) {
    run_until_permitted(&bench);
    next_cycle(&bench);
    const can_frame_t sync = sync_frame(&bench);
    for (uint32_t i = 0; i < 4u; ++i) {
        receive(&bench, sync);
    }
    TEST_ASSERT_EQUAL(1, guard->inputs.repeats[PROTOCOL_RECEIVE_SYNC]);
}

static void test_a_guard_that_waits_names_an_implausible_joint(void) {
    run_until(&bench, GUARD_REASON_AWAITING_RESET);
    bench.position[6] = (int16_t)(bench.position[6] + 2000);
    cycle(&bench);
    TEST_ASSERT_EQUAL(GUARD_STATE_WAITING, bench.out.state);
    TEST_ASSERT_EQUAL(GUARD_REASON_IMPLAUSIBLE, bench.out.reason);
    TEST_ASSERT_EQUAL(7, bench.out.joint);
}

static void test_a_search_for_the_contact_begins_with_every_reason_that_is_one(void) {
    static const guard_reason_t contacts[] = {GUARD_REASON_COLLISION, GUARD_REASON_SUDDEN, GUARD_REASON_EXPLAINED_FORCE,
                                              GUARD_REASON_EXPLAINED_MOMENT, GUARD_REASON_RESIDUAL_LIMIT};
    static const uint32_t joints[] = {0u, 7u, ROBOT_MAX_JOINTS + 1u};
    for (size_t i = 0; i < sizeof(contacts) / sizeof(contacts[0]); ++i) {
        for (size_t j = 0; j < sizeof(joints) / sizeof(joints[0]); ++j) {
            const guard_event_t event = {.reason = contacts[i], .joint = joints[j]};
            guard->contact.touching = false;
            contact_note_trip(guard, &event);
            TEST_ASSERT_TRUE(guard->contact.touching);
        }
    }
    const guard_event_t other = {.reason = GUARD_REASON_BUS_OFF};
    guard->contact.touching = false;
    contact_note_trip(guard, &other);
    TEST_ASSERT_FALSE(guard->contact.touching);
}

/* The least threshold of a channel of the unexplained torque; 2 Nm on each joint is the largest. */
static void test_a_search_weights_joints_by_their_thresholds(void) {
    const guard_event_t event = {.reason = GUARD_REASON_COLLISION, .joint = 1u};
    detector_config_t *const detector = &bench.config.task[TASK_NONE].detector;
    bench.config.bank.channel[2].of = (uint32_t)CHANNEL_SUDDEN;
    for (uint32_t i = 0; i < JOINTS; ++i) {
        detector->threshold_nm[1][i] = (i == 0u) ? NUM(1) : ((i == 3u) ? NUM(0.5) : NUM(4));
        detector->threshold_nm[2][i] = NUM(0.25);
    }
    guard->task = TASK_NONE;
    detector->channels = 7u;
    contact_note_trip(guard, &event);
    TEST_ASSERT_TRUE(guard->contact.locate.weight[0] == NUM(2));
    TEST_ASSERT_TRUE(guard->contact.locate.weight[2] == NUM(1));
    TEST_ASSERT_TRUE(guard->contact.locate.weight[3] == NUM(4));
    detector->channels = 5u; /* the task does not watch the second channel */
    contact_note_trip(guard, &event);
    TEST_ASSERT_TRUE(guard->contact.locate.weight[3] == NUM(1));
    detector->channels = 7u;
    guard->task = TASK_COUNT; /* no task, no thresholds */
    contact_note_trip(guard, &event);
    TEST_ASSERT_TRUE(guard->contact.locate.weight[2] == guard->contact.locate.weight[3]);
}

static void test_the_force_is_reported_with_its_link_only(void) {
    run_until_permitted(&bench);
    guard->contact.locate.force_n.x = NUM(30);
    cycle(&bench);
    TEST_ASSERT_TRUE(bench.out.contact_force.x == NUM(0));
    guard->contact.locate.link = 3u;
    cycle(&bench);
    TEST_ASSERT_EQUAL(3, bench.out.contact_link);
    TEST_ASSERT_TRUE(bench.out.contact_force.x == NUM(30));
}

static void test_the_time_for_which_an_index_rises_stays_at_its_end(void) {
    run_until_permitted(&bench);
    guard->contact.rising[0] = UINT16_MAX;
    guard->detector.value_nm[0] = guard->detector.threshold_nm[0];
    contact_step(guard);
    TEST_ASSERT_EQUAL(UINT16_MAX, guard->contact.rising[0]);
}

static void test_a_task_that_does_not_exist_has_no_columns(void) {
    run_until_permitted(&bench);
    next_cycle(&bench);
    receive(&bench, sync_frame(&bench));
    for (uint32_t i = 0; i < JOINTS; ++i) {
        receive(&bench, joint_frame(&bench, i));
    }
    for (uint32_t task = TASK_COUNT; task < 100u; task += 90u) {
        guard->task = task;
        guard->task_cycles = 0u; /* no change before its dwell */
        stages_run(guard);
        TEST_ASSERT_EQUAL(0, guard->index.columns);
        TEST_ASSERT_TRUE(stages_complete(guard));
    }
}

static void test_a_reading_refused_after_a_collision_is_no_new_trip(void) {
    static const guard_reason_t passing[] = {GUARD_REASON_INPUT_RANGE, GUARD_REASON_IMPLAUSIBLE,
                                             GUARD_REASON_OBSERVER_RESTART};
    run_until_permitted(&bench);
    push(&bench, 2u, 1500);
    cycles(&bench, 50u);
    assert_stopped(&bench, GUARD_REASON_COLLISION, 3u);
    for (size_t i = 0; i < sizeof(passing) / sizeof(passing[0]); ++i) {
        guard_trip(guard, passing[i]);
        cycle(&bench);
        TEST_ASSERT_EQUAL(1, bench.out.trip_number);
    }
}

static void test_a_guard_that_waits_does_not_permit_while_something_is_tripped(void) {
    for (uint32_t i = 0; i < 2u; ++i) {
        setUp();
        run_until(&bench, GUARD_REASON_AWAITING_RESET);
        guard->detector.tripped = i == 0u;
        guard->explained.tripped = i == 1u;
        guard_trip(guard, GUARD_REASON_INPUT_RANGE);
        next_cycle(&bench);
        tick(&bench);
        TEST_ASSERT_FALSE(bench.out.permitted);
        TEST_ASSERT_EQUAL(GUARD_STATE_WAITING, bench.out.state);
    }
}

/* 0 means that there was no trip. */
static void test_the_number_of_a_trip_goes_from_255_to_1(void) {
    run_until_permitted(&bench);
    guard->trip.number = UINT8_MAX - 1u;
    guard_trip(guard, GUARD_REASON_BUS_OFF);
    cycle(&bench);
    TEST_ASSERT_EQUAL(UINT8_MAX, bench.out.trip_number);
    guard_trip(guard, GUARD_REASON_STATE_CORRUPT);
    cycle(&bench);
    TEST_ASSERT_EQUAL(1, bench.out.trip_number);
}

static void test_an_index_that_rises_for_40_ms_is_a_touch(void) {
    const guard_event_t event = {.reason = GUARD_REASON_COLLISION, .joint = 3u};
    guard->contact.rising[2] = 40u;
    contact_note_trip(guard, &event);
    TEST_ASSERT_TRUE(guard->contact.slow);
    guard->contact.rising[2] = 39u;
    contact_note_trip(guard, &event);
    TEST_ASSERT_FALSE(guard->contact.slow);
}

static void test_the_saturations_of_all_stages_are_added(void) {
    TEST_ASSERT_FALSE(stages_saturated(guard));
    guard->motion.saturations = 1u;
    guard->observer.saturations = 2u;
    guard->acceleration.saturations = 4u;
    guard->regressor.saturations = 8u;
    guard->index.saturations = 16u;
    guard->index.projection.subspace.saturations = 32u;
    guard->index.projection.soft.saturations = 64u;
    guard->explained.saturations = 128u;
    guard->bank.saturations = 256u;
    guard->sight.saturations = 512u;
    TEST_ASSERT_TRUE(stages_saturated(guard));
    TEST_ASSERT_EQUAL(1023u, guard->saturations);
    TEST_ASSERT_FALSE(stages_saturated(guard));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_an_input_that_cannot_be_trusted_comes_before_a_collision);
    RUN_TEST(test_a_second_contact_after_a_stop_of_the_worst_category_is_no_new_trip);
    RUN_TEST(test_a_contact_that_grows_is_named_only_when_it_has_tripped);
    RUN_TEST(test_a_reset_more_than_needed_is_refused_and_does_no_harm);
    RUN_TEST(test_readings_that_are_old_in_cycles_are_missing_though_young_in_time);
    RUN_TEST(test_a_channel_of_sudden_and_a_limit_on_the_residual_name_themselves);
    RUN_TEST(test_readings_are_compared_within_the_longest_gap_alone);
    RUN_TEST(test_after_a_gap_that_the_observer_cannot_bridge_it_settles_again);
    RUN_TEST(test_the_lowest_raw_value_is_no_reading);
    RUN_TEST(test_cycles_that_pass_while_time_stands_are_a_fault);
    RUN_TEST(test_one_frame_that_arrives_many_times_counts_as_one_repetition);
    RUN_TEST(test_a_guard_that_waits_names_an_implausible_joint);
    RUN_TEST(test_a_search_for_the_contact_begins_with_every_reason_that_is_one);
    RUN_TEST(test_a_search_weights_joints_by_their_thresholds);
    RUN_TEST(test_the_force_is_reported_with_its_link_only);
    RUN_TEST(test_the_time_for_which_an_index_rises_stays_at_its_end);
    RUN_TEST(test_a_task_that_does_not_exist_has_no_columns);
    RUN_TEST(test_a_reading_refused_after_a_collision_is_no_new_trip);
    RUN_TEST(test_a_guard_that_waits_does_not_permit_while_something_is_tripped);
    RUN_TEST(test_the_number_of_a_trip_goes_from_255_to_1);
    RUN_TEST(test_an_index_that_rises_for_40_ms_is_a_touch);
    RUN_TEST(test_the_saturations_of_all_stages_are_added);
    return UNITY_END();
}
