/* Two guards that decide together, as the two channels of pair.h do. Here both have one numeric type: what is tested is
 * the exchange, not that two numeric types agree (tests/host/test_channels.py). */
#include "guard_fixture.h"
#include "guard_parts.h"

static bench_t bench; /* with the first guard */
static guard_t second;
static guard_output_t second_out;
static guard_finding_t finding[2];
static opinion_t opinion[2];

static void look_both(void) {
    guard_look(&bench.guard, bench.now_us, &finding[0]);
    guard_tell(&bench.guard, &finding[0], &opinion[0]);
    guard_look(&second, bench.now_us, &finding[1]);
    guard_tell(&second, &finding[1], &opinion[1]);
}

static void decide_both(void) {
    bench.out = (guard_output_t){.withheld = true};
    second_out = (guard_output_t){.withheld = true};
    guard_decide(&bench.guard, bench.now_us, &finding[0], &opinion[0], &opinion[1], &bench.out);
    guard_decide(&second, bench.now_us, &finding[1], &opinion[1], &opinion[0], &second_out);
    guard_say(&bench.guard, &bench.out);
    guard_confirm(&second_out, &bench.out.frame[0]);
}

static void hear_both(can_frame_t frame) {
    guard_receive(&bench.guard, &frame, bench.now_us);
    guard_receive(&second, &frame, bench.now_us);
}

static void hear_cycle(void) {
    next_cycle(&bench);
    hear_both(sync_frame(&bench));
    hear_both(task_frame(&bench));
    for (uint32_t i = 0; i < JOINTS; ++i) {
        hear_both(joint_frame(&bench, i));
    }
}

static void cycle_both(void) {
    hear_cycle();
    look_both();
    decide_both();
}

static void ask_both(uint8_t trip) {
    for (uint32_t i = 0; i < 3u; ++i) {
        hear_both(reset_frame(&bench, trip, i == 2u));
        cycle_both();
    }
}

static bool frame_permits(void) {
    return bench.out.frame[0].data[2] == 0xE1u; /* Permission 1, PermissionInverted 14 */
}

static void start_both(const guard_config_t *config) {
    start_with(&bench, config);
    TEST_ASSERT_EQUAL(GUARD_OK, guard_init(&second, &bench.config));
    guard_note_start(&second, GUARD_START_POWER_ON, 0u, GUARD_VARIANT_PRODUCT);
    guard_join(&bench.guard, false);
    guard_join(&second, true);
    for (uint32_t i = 0; (i < START_LIMIT) && (bench.out.reason != GUARD_REASON_AWAITING_RESET); ++i) {
        cycle_both();
    }
    ask_both(0u);
    TEST_ASSERT_TRUE(frame_permits());
}

void setUp(void) {
    const guard_config_t config = make_config();
    start_both(&config);
}
void tearDown(void) {}

static void assert_both(guard_state_t state, guard_reason_t reason) {
    TEST_ASSERT_EQUAL(state, bench.out.state);
    TEST_ASSERT_EQUAL(state, second_out.state);
    TEST_ASSERT_EQUAL(reason, bench.out.reason);
    TEST_ASSERT_EQUAL(reason, second_out.reason);
    TEST_ASSERT_EQUAL(bench.out.trip_number, second_out.trip_number);
    TEST_ASSERT_FALSE(frame_permits());
}

static void test_two_that_agree_permit_and_say_that_they_are_two(void) {
    bool said = false;
    for (uint32_t i = 0; i < 100u; ++i) {
        cycle_both();
        TEST_ASSERT_TRUE(frame_permits());
        const can_frame_t *const status = &bench.out.frame[1]; /* Channels is the high half of byte 4 of this page */
        said =
            said || ((status->id == 0x200u) && ((status->data[1] >> 4) == PAGE_START) && ((status->data[4] >> 4) == 2));
    }
    TEST_ASSERT_TRUE(said);
}

static void test_a_stop_that_either_wants_stops_both_in_the_same_tick(void) {
    for (uint32_t which = 0; which < 2u; ++which) {
        setUp();
        guard_trip((which == 0u) ? &bench.guard : &second, GUARD_REASON_BUS_OFF);
        cycle_both();
        assert_both(GUARD_STATE_STOPPED, GUARD_REASON_BUS_OFF);
    }
}

static void test_a_collision_in_the_second_one_is_told_with_its_numbers(void) {
    hear_cycle();
    look_both();
    finding[1].wish = WISH_STOP;
    finding[1].event = (guard_event_t){
        .reason = GUARD_REASON_COLLISION, .joint = 3u, .category = 2u, .value_nm = NUM(2.5), .threshold_nm = NUM(-0.5)};
    guard_tell(&second, &finding[1], &opinion[1]);
    decide_both();
    assert_both(GUARD_STATE_STOPPED, GUARD_REASON_COLLISION);
    TEST_ASSERT_EQUAL(3, bench.out.joint);
    TEST_ASSERT_TRUE((bench.out.value_nm > NUM(2.4999)) && (bench.out.value_nm < NUM(2.5001)));
    TEST_ASSERT_TRUE((bench.out.threshold_nm > NUM(-0.5001)) && (bench.out.threshold_nm < NUM(-0.4999)));
}

static void test_a_fault_of_either_is_a_fault_of_both(void) {
    for (uint32_t which = 0; which < 2u; ++which) {
        setUp();
        guard_note_tick_time((which == 0u) ? &bench.guard : &second, 10u * PERIOD_US);
        cycle_both();
        assert_both(GUARD_STATE_FAULT, GUARD_REASON_TICK_OVER_BUDGET);
    }
}

static void test_numbers_that_differ_for_three_ticks_are_a_fault(void) {
    for (uint32_t i = 0; i < AGREE_TICKS + 1u; ++i) {
        TEST_ASSERT_TRUE(bench.out.permitted);
        hear_cycle();
        look_both();
        opinion[1].residual[2] = opinion[0].residual[2] + AGREE_RESIDUAL + 1;
        decide_both();
    }
    assert_both(GUARD_STATE_FAULT, GUARD_REASON_CHANNELS_DISAGREE);
}

static void test_a_wish_for_fault_keeps_its_reason_when_the_two_disagree_too(void) {
    hear_cycle();
    guard_note_tick_time(&second, 10u * PERIOD_US);
    look_both();
    opinion[0].trip_number = 77u;
    decide_both();
    TEST_ASSERT_EQUAL(GUARD_REASON_TICK_OVER_BUDGET, second_out.reason);
    TEST_ASSERT_EQUAL(GUARD_STATE_FAULT, second_out.state);
}

/* Each of the three conditions, in either channel. */
static void test_a_permission_needs_both_to_be_ready(void) {
    for (uint32_t which = 0; which < 2u; ++which) {
        for (uint32_t condition = 0; condition < 2u; ++condition) {
            setUp();
            guard_trip(&second, GUARD_REASON_BUS_OFF);
            cycle_both();
            for (uint32_t i = 0; i < 2u * SETTLING_CYCLES; ++i) {
                cycle_both();
            }
            hear_both(reset_frame(&bench, bench.out.trip_number, false));
            cycle_both();
            hear_both(reset_frame(&bench, bench.out.trip_number, true));
            hear_cycle();
            look_both();
            bool *const flag = (condition == 0u) ? &finding[which].healthy : &finding[which].fresh;
            *flag = false;
            guard_tell((which == 0u) ? &bench.guard : &second, &finding[which], &opinion[which]);
            decide_both();
            TEST_ASSERT_FALSE(frame_permits());
            TEST_ASSERT_NOT_EQUAL(GUARD_STATE_MONITORING, bench.out.state);
            TEST_ASSERT_EQUAL(bench.out.state, second_out.state);
        }
    }
}

/* One channel may be through its self-test earlier. It waits, and does not test again. */
static void test_the_self_test_ends_for_both_in_the_same_tick(void) {
    const guard_config_t config = make_config();
    start_with(&bench, &config);
    TEST_ASSERT_EQUAL(GUARD_OK, guard_init(&second, &bench.config));
    guard_note_start(&second, GUARD_START_POWER_ON, 0u, GUARD_VARIANT_PRODUCT);
    guard_join(&bench.guard, false);
    guard_join(&second, true);
    bool waited = false;
    for (uint32_t i = 0; i < START_LIMIT; ++i) {
        hear_cycle();
        look_both();
        if (i < 100u) { /* the second one is slow */
            finding[1].tested = false;
            second.tested = false;
            second.self_test_step = 1u;
            guard_tell(&second, &finding[1], &opinion[1]);
            waited = waited || finding[0].tested;
        }
        decide_both();
        TEST_ASSERT_EQUAL(bench.out.state, second_out.state);
    }
    TEST_ASSERT_TRUE(waited);
    TEST_ASSERT_EQUAL(GUARD_STATE_WAITING, bench.out.state);
    TEST_ASSERT_EQUAL(GUARD_REASON_AWAITING_RESET, bench.out.reason);
}

static void test_the_copy_of_the_permission_is_the_second_ones(void) {
    can_frame_t frame = bench.out.frame[0];
    guard_output_t own = second_out;
    guard_confirm(&own, &frame);
    TEST_ASSERT_EQUAL_HEX8(0xE1, frame.data[2]);
    own.permitted = false;
    guard_confirm(&own, &frame);
    TEST_ASSERT_EQUAL_HEX8(0xF1, frame.data[2]);
    own = second_out;
    own.withheld = true;
    guard_confirm(&own, &frame);
    TEST_ASSERT_EQUAL_HEX8(0xF1, frame.data[2]);
    own = second_out;
    ++own.cycle;
    guard_confirm(&own, &frame);
    TEST_ASSERT_EQUAL_HEX8(0xF1, frame.data[2]);
}

/* The first one's frame permits only if both of its own computations do. */
static void test_a_permission_that_the_first_one_withholds_is_none(void) {
    hear_cycle();
    look_both();
    guard_output_t out = {.permitted = true, .withheld = true};
    guard_say(&bench.guard, &out);
    TEST_ASSERT_EQUAL_HEX8(0xF0, out.frame[0].data[2]);
    guard_t alone;
    TEST_ASSERT_EQUAL(GUARD_OK, guard_init(&alone, &bench.config));
    TEST_ASSERT_TRUE(guard_is_alone(&alone));
    guard_say(&alone, &out);
    TEST_ASSERT_EQUAL_HEX8(0xF1, out.frame[0].data[2]);
}

static void test_an_opinion_names_no_joint_that_does_not_exist(void) {
    look_both();
    bench.guard.joints = ROBOT_MAX_JOINTS + 1u;
    guard_tell(&bench.guard, &finding[0], &opinion[0]);
    TEST_ASSERT_EQUAL(ROBOT_MAX_JOINTS, opinion[0].joints);
    bench.config.bank.channels = BANK_MAX_CHANNELS + 1u;
    guard_tell(&bench.guard, &finding[0], &opinion[0]);
    TEST_ASSERT_EQUAL(BANK_MAX_CHANNELS + 1u, opinion[0].channels);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_two_that_agree_permit_and_say_that_they_are_two);
    RUN_TEST(test_a_stop_that_either_wants_stops_both_in_the_same_tick);
    RUN_TEST(test_a_collision_in_the_second_one_is_told_with_its_numbers);
    RUN_TEST(test_a_fault_of_either_is_a_fault_of_both);
    RUN_TEST(test_numbers_that_differ_for_three_ticks_are_a_fault);
    RUN_TEST(test_a_wish_for_fault_keeps_its_reason_when_the_two_disagree_too);
    RUN_TEST(test_a_permission_needs_both_to_be_ready);
    RUN_TEST(test_the_self_test_ends_for_both_in_the_same_tick);
    RUN_TEST(test_the_copy_of_the_permission_is_the_second_ones);
    RUN_TEST(test_a_permission_that_the_first_one_withholds_is_none);
    RUN_TEST(test_an_opinion_names_no_joint_that_does_not_exist);
    return UNITY_END();
}
