/* Each condition of a decision alone, with everything else as it is while the guard permits. This program sets the
 * state of the guard directly. */
#include "guard_fixture.h"
#include "guard_parts.h"

static bench_t bench;
static guard_t *const guard = &bench.guard;
static guard_t permitting;

void setUp(void) {
    start(&bench);
    run_until_permitted(&bench);
    permitting = *guard;
}
void tearDown(void) {}

static void set_state(guard_state_t state) {
    guard->state = (uint32_t)state;
    guard->state_inverted = ~(uint32_t)state;
}

/* --- what a contact was ------------------------------------------------------------------------------------------- */

static void touch(bool touching, bool above, excess_t excess, bool slow, uint32_t held) {
    guard->contact.kind = (uint8_t)CONTACT_CLASS_UNKNOWN;
    guard->contact.touching = touching;
    guard->detector.any_above = above;
    guard->explained.excess = excess;
    guard->contact.slow = slow;
    guard->contact.held = held;
    contact_step(guard);
}

static void test_a_contact_lasts_while_anything_is_above_its_limit(void) {
    touch(true, true, EXPLAINED_NOTHING, false, 5u);
    TEST_ASSERT_TRUE(guard->contact.touching);
    TEST_ASSERT_EQUAL(6, guard->contact.held);
    touch(true, false, EXPLAINED_FORCE, false, 5u);
    TEST_ASSERT_TRUE(guard->contact.touching);
    touch(true, false, EXPLAINED_NOTHING, false, 5u);
    TEST_ASSERT_FALSE(guard->contact.touching);
    TEST_ASSERT_EQUAL(5, guard->contact.held);
    touch(false, true, EXPLAINED_FORCE, false, 5u);
    TEST_ASSERT_FALSE(guard->contact.touching);
    TEST_ASSERT_EQUAL(5, guard->contact.held);
}

static void test_a_fast_contact_is_clamping_after_750_ms(void) {
    touch(true, true, EXPLAINED_NOTHING, false, 748u);
    TEST_ASSERT_EQUAL(CONTACT_CLASS_UNKNOWN, guard->contact.kind);
    touch(true, true, EXPLAINED_NOTHING, false, 749u);
    TEST_ASSERT_EQUAL(CONTACT_CLASS_CLAMPING, guard->contact.kind);
    TEST_ASSERT_FALSE(guard->contact.touching);
    touch(true, true, EXPLAINED_NOTHING, true, 1000u); /* slow */
    TEST_ASSERT_EQUAL(CONTACT_CLASS_UNKNOWN, guard->contact.kind);
    touch(false, true, EXPLAINED_NOTHING, false, 1000u); /* over */
    TEST_ASSERT_EQUAL(CONTACT_CLASS_UNKNOWN, guard->contact.kind);
    guard->contact.locate.steps = 5u; /* the search is not through */
    touch(true, true, EXPLAINED_NOTHING, false, 1000u);
    TEST_ASSERT_EQUAL(CONTACT_CLASS_UNKNOWN, guard->contact.kind);
}

static void test_an_index_rises_above_half_of_its_threshold(void) {
    for (uint32_t i = 0; i < JOINTS; ++i) {
        guard->detector.value_nm[i] = NUM(-1);
        guard->detector.threshold_nm[i] = NUM(2);
        guard->contact.rising[i] = 3u;
    }
    contact_step(guard);
    TEST_ASSERT_EQUAL(0, guard->contact.rising[0]);
    TEST_ASSERT_EQUAL(0, guard->contact.rising[6]);
    guard->detector.value_nm[6] = NUM(-1.01);
    contact_step(guard);
    contact_step(guard);
    TEST_ASSERT_EQUAL(0, guard->contact.rising[0]);
    TEST_ASSERT_EQUAL(2, guard->contact.rising[6]);
}

/* The residual of before the contact is followed only while every joint is calm. */
static void test_one_joint_that_rises_ends_the_calm(void) {
    for (uint32_t joint = 0; joint < JOINTS; ++joint) {
        *guard = permitting;
        guard->observer.residual[3] = NUM(10);
        guard->contact.locate.next = 3u;
        const num_t before = guard->contact.locate.before[3];
        guard->detector.value_nm[joint] = guard->detector.threshold_nm[joint];
        contact_step(guard);
        TEST_ASSERT_TRUE(guard->contact.locate.before[3] == before);
    }
    *guard = permitting;
    guard->observer.residual[3] = NUM(10);
    guard->contact.locate.next = 3u;
    contact_step(guard);
    TEST_ASSERT_TRUE(guard->contact.locate.before[3] > permitting.contact.locate.before[3]);
}

static void test_an_event_without_a_joint_rises_like_the_first_one(void) {
    const guard_event_t event = {.reason = GUARD_REASON_EXPLAINED_FORCE};
    memset(guard->contact.rising, 0, sizeof(guard->contact.rising));
    guard->contact.rising[1] = 1000u;
    contact_note_trip(guard, &event);
    TEST_ASSERT_FALSE(guard->contact.slow);
    guard->contact.rising[0] = 1000u;
    contact_note_trip(guard, &event);
    TEST_ASSERT_TRUE(guard->contact.slow);
}

/* --- deadlines ---------------------------------------------------------------------------------------------------- */

static void assert_missing(input_t input, uint64_t later_us) {
    TEST_ASSERT_EQUAL(input, missing_input(guard, bench.now_us + later_us));
    *guard = permitting;
}

static void test_each_input_has_its_deadline_in_time(void) {
    guard_input_t *const input[] = {&guard->inputs.sync, &guard->inputs.joints, &guard->inputs.task};
    static const input_t missing[] = {INPUT_SYNC, INPUT_JOINTS, INPUT_TASK};
    const uint64_t deadline[] = {bench.config.sync_deadline_us, bench.config.joint_deadline_us,
                                 bench.config.task_deadline_us};
    for (uint32_t i = 0; i < 3u; ++i) {
        input[i]->good_us = bench.now_us - deadline[i];
        assert_missing(INPUT_NONE, 0u);
        input[i]->good_us = bench.now_us - deadline[i] - 1u;
        assert_missing(missing[i], 0u);
        input[i]->seen = false;
        assert_missing(missing[i], 0u);
    }
}

static void test_joints_and_task_have_their_deadline_in_cycles(void) {
    guard->inputs.snapshot.taken_cycle = (uint16_t)(guard->inputs.snapshot.cycle - DEADLINE_CYCLES);
    assert_missing(INPUT_NONE, 0u);
    guard->inputs.snapshot.taken_cycle = (uint16_t)(guard->inputs.snapshot.cycle - DEADLINE_CYCLES - 1u);
    assert_missing(INPUT_JOINTS, 0u);
    guard->inputs.task_cycle = (uint16_t)(guard->inputs.snapshot.cycle - 2u * DEADLINE_CYCLES);
    assert_missing(INPUT_NONE, 0u);
    guard->inputs.task_cycle = (uint16_t)(guard->inputs.snapshot.cycle - 2u * DEADLINE_CYCLES - 1u);
    assert_missing(INPUT_TASK, 0u);
}

static void test_the_smallest_margin_is_kept(void) {
    guard->report.margin_us = UINT32_MAX;
    guard->inputs.task.good_us = bench.now_us - 7000u; /* of 8 ms */
    TEST_ASSERT_EQUAL(INPUT_NONE, missing_input(guard, bench.now_us));
    TEST_ASSERT_EQUAL(1000, guard->report.margin_us);
    guard->inputs.task.good_us = bench.now_us;
    TEST_ASSERT_EQUAL(INPUT_NONE, missing_input(guard, bench.now_us));
    TEST_ASSERT_EQUAL(1000, guard->report.margin_us);
}

static void test_the_first_missing_joint_is_named(void) {
    snapshot_t snapshot = {.expected = 0x7Fu};
    for (uint32_t i = 0; i < JOINTS; ++i) {
        snapshot.received = (uint8_t)(0x7Fu & ~(1u << i) & ~(1u << 6));
        TEST_ASSERT_EQUAL(i + 1u, missing_joint(&snapshot));
    }
    snapshot.received = 0x7Fu;
    TEST_ASSERT_EQUAL(0, missing_joint(&snapshot));
    snapshot = (snapshot_t){.expected = 0xFFu, .received = 0x7Fu};
    TEST_ASSERT_EQUAL(8, missing_joint(&snapshot));
}

static void test_settled_and_healthy_begin_at_their_time(void) {
    guard->settled_cycles = SETTLING_CYCLES;
    TEST_ASSERT_TRUE(is_settled(guard));
    guard->settled_cycles = SETTLING_CYCLES - 1u;
    TEST_ASSERT_FALSE(is_settled(guard));
    guard->healthy = true;
    guard->healthy_since_us = bench.now_us - bench.config.reset_healthy_us;
    TEST_ASSERT_TRUE(healthy_for_long_enough(guard, bench.now_us));
    guard->healthy_since_us += 1u;
    TEST_ASSERT_FALSE(healthy_for_long_enough(guard, bench.now_us));
    guard->healthy_since_us = 0u;
    guard->healthy = false;
    TEST_ASSERT_FALSE(healthy_for_long_enough(guard, bench.now_us));
}

/* --- decisions ---------------------------------------------------------------------------------------------------- */

/* One decision of a guard with a second channel that tells `other`. */
static void decide(const guard_finding_t *finding, const opinion_t *other) {
    opinion_t own;
    guard_tell(guard, finding, &own);
    guard_decide(guard, bench.now_us, finding, &own, other, &bench.out);
}

static opinion_t opinion_of(const guard_finding_t *finding) {
    opinion_t opinion;
    guard_tell(guard, finding, &opinion);
    return opinion;
}

static const guard_finding_t good = {.wish = WISH_GO_ON, .healthy = true, .fresh = true, .tested = true};

static void wait_acknowledged(void) {
    *guard = permitting;
    set_state(GUARD_STATE_WAITING);
    guard->acknowledged = (uint8_t)GUARD_SET;
    guard->healthy_since_us = 0u;
}

static void test_a_guard_that_waits_permits_only_if_nothing_is_tripped(void) {
    wait_acknowledged();
    opinion_t other = opinion_of(&good);
    decide(&good, &other);
    TEST_ASSERT_EQUAL(GUARD_STATE_MONITORING, bench.out.state);
    wait_acknowledged();
    guard->detector.tripped = true;
    decide(&good, &other);
    TEST_ASSERT_EQUAL(GUARD_STATE_WAITING, bench.out.state);
    wait_acknowledged();
    guard->explained.tripped = true;
    decide(&good, &other);
    TEST_ASSERT_EQUAL(GUARD_STATE_WAITING, bench.out.state);
    wait_acknowledged();
    guard_finding_t stale = good;
    stale.fresh = false;
    other = opinion_of(&stale);
    decide(&stale, &other);
    TEST_ASSERT_EQUAL(GUARD_STATE_WAITING, bench.out.state);
    TEST_ASSERT_EQUAL(GUARD_REASON_SETTLING, bench.out.reason); /* a reset is not needed any more */
}

/* Healthy, fresh and tested are of both channels or of none. */
static void test_what_one_channel_lacks_both_lack(void) {
    guard_finding_t without[3] = {good, good, good};
    without[0].healthy = false;
    without[1].fresh = false;
    without[2].tested = false;
    for (uint32_t i = 0; i < 3u; ++i) {
        for (uint32_t lacking = 0; lacking < 2u; ++lacking) {
            wait_acknowledged();
            if (i == 2u) {
                set_state(GUARD_STATE_SELF_TEST);
            }
            const opinion_t other = opinion_of((lacking == 0u) ? &good : &without[i]);
            decide((lacking == 0u) ? &without[i] : &good, &other);
            TEST_ASSERT_EQUAL((i == 2u) ? GUARD_STATE_SELF_TEST : GUARD_STATE_WAITING, bench.out.state);
        }
    }
}

static void test_a_guard_in_fault_tells_its_reason_in_every_tick(void) {
    guard_finding_t finding;
    guard_trip(guard, GUARD_REASON_TIME_BACKWARDS);
    cycles(&bench, 10u);
    assert_fault(&bench, GUARD_REASON_TIME_BACKWARDS);
    TEST_ASSERT_EQUAL(1, bench.out.trip_number); /* one trip, however long it lasts */
    TEST_ASSERT_EQUAL(1, guard->counters.trips);
    next_cycle(&bench);
    guard_look(guard, bench.now_us, &finding);
    TEST_ASSERT_EQUAL(WISH_FAULT, finding.wish);
    TEST_ASSERT_EQUAL(GUARD_REASON_TIME_BACKWARDS, finding.event.reason);
    TEST_ASSERT_FALSE(finding.fresh);
}

/* A contact may have a worse category than an input, as long as it is the first one. */
static void test_a_contact_after_a_stop_for_an_input_has_its_own_category(void) {
    guard_config_t config = make_config();
    config.stop_collision = 0u;
    seal_config(&config);
    start_with(&bench, &config);
    run_until_permitted(&bench);
    guard_trip(guard, GUARD_REASON_BUS_OFF);
    cycles(&bench, 3u * SETTLING_CYCLES);
    assert_stopped(&bench, GUARD_REASON_BUS_OFF, 0u);
    TEST_ASSERT_EQUAL(1, bench.out.stop_category);
    push(&bench, 2u, 1500);
    cycles(&bench, 50u);
    assert_stopped(&bench, GUARD_REASON_COLLISION, 3u);
    TEST_ASSERT_EQUAL(0, bench.out.stop_category);
    TEST_ASSERT_EQUAL(2, bench.out.trip_number);
}

/* --- reception ---------------------------------------------------------------------------------------------------- */

/* -32767 to 32767, where the robot allows more. -32768 means that there is no reading. */
static void test_the_ends_of_the_wires_range_are_readings(void) {
    robot_joint_t *const limits = &bench.config.robot.joint[3];
    int16_t *const reading[] = {&bench.position[3], &bench.velocity[3], &bench.torque[3]};
    limits->position_min_rad = NUM(-5);
    limits->position_max_rad = NUM(5);
    limits->velocity_max_rad_s = NUM(9);
    limits->torque_max_nm = NUM(400);
    for (uint32_t k = 0; k < 9u; ++k) {
        static const int16_t raw[] = {-32767, 32767, INT16_MIN};
        next_cycle(&bench);
        receive(&bench, sync_frame(&bench));
        *reading[k / 3u] = raw[k % 3u];
        receive(&bench, joint_frame(&bench, 3u));
        *reading[k / 3u] = 0;
        TEST_ASSERT_EQUAL((k + 1u) / 3u, guard->counters.range_errors);
    }
}

static void test_the_ends_of_the_acceleration_are_values(void) {
    for (uint32_t k = 0; k < 6u; ++k) {
        uint8_t data[8] = {0};
        put16(data + 2u + 2u * (k % 3u), (k < 3u) ? -32767 : 32767);
        next_cycle(&bench);
        receive(&bench, sync_frame(&bench));
        receive(&bench, sealed(PROTOCOL_RECEIVE_TASK_COMMAND, data, TASK_PAYLOAD, (uint8_t)(bench.cycle & 0x0Fu)));
        TEST_ASSERT_EQUAL(0, guard->counters.range_errors);
        TEST_ASSERT_EQUAL(bench.cycle, guard->inputs.task_cycle);
    }
}

static void test_a_sender_that_is_no_joint_is_named_by_no_joint(void) {
    for (uint32_t i = 0; i < 8u; ++i) {
        can_frame_t wrong = sync_frame(&bench);
        wrong.length = 7u;
        receive(&bench, wrong);
    }
    TEST_ASSERT_EQUAL(GUARD_REASON_ERROR_RATE, guard->inputs.fault);
    TEST_ASSERT_EQUAL(0, guard->inputs.fault_joint);
    *guard = permitting;
    for (uint32_t i = 0; i < 8u; ++i) {
        TEST_ASSERT_EQUAL(0, guard->inputs.fault);
        can_frame_t wrong = joint_frame(&bench, 4u);
        wrong.length = 7u;
        receive(&bench, wrong);
        TEST_ASSERT_TRUE(guard->inputs.errors[4] <= 64u);
    }
    TEST_ASSERT_EQUAL(GUARD_REASON_ERROR_RATE, guard->inputs.fault);
    TEST_ASSERT_EQUAL(5, guard->inputs.fault_joint);
    TEST_ASSERT_EQUAL(64, guard->inputs.errors[4]);
}

static void test_errors_of_a_joint_that_the_robot_does_not_have_are_nobodys(void) {
    can_frame_t frame = joint_frame(&bench, 6u);
    frame.id = protocol_receive[7].id;
    receive(&bench, frame);
    TEST_ASSERT_EQUAL(1, guard->counters.format_errors);
    TEST_ASSERT_EQUAL(0, guard->inputs.errors[7]);
}

/* The second channel lowers the speed and writes its copy. Everything else stays, and the checksum fits again. */
static void test_the_second_channel_changes_its_copy_and_the_speed_alone(void) {
    for (uint32_t full = 0; full < 2u; ++full) {
        can_frame_t frame = {.length = 8u, .data = {0, 0x35, 0xF1, 0x7A, 0xA5, 0x11, 0x22, 0x33}};
        const guard_output_t own = {.permitted = true, .full_speed = full == 1u, .cycle = 0x127u};
        guard_confirm(&own, &frame);
        const uint8_t expected[8] = {frame.data[0], 0x35, 0xE1, 0x7A, (full == 1u) ? 0xA5 : 0x25, 0x11, 0x22, 0x33};
        TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, frame.data, 8);
        can_frame_t again = frame;
        e2e_seal(again.data, 8u, protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND].data_ids, 5u);
        TEST_ASSERT_EQUAL_HEX8(again.data[0], frame.data[0]);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_contact_lasts_while_anything_is_above_its_limit);
    RUN_TEST(test_a_fast_contact_is_clamping_after_750_ms);
    RUN_TEST(test_an_index_rises_above_half_of_its_threshold);
    RUN_TEST(test_one_joint_that_rises_ends_the_calm);
    RUN_TEST(test_an_event_without_a_joint_rises_like_the_first_one);
    RUN_TEST(test_each_input_has_its_deadline_in_time);
    RUN_TEST(test_joints_and_task_have_their_deadline_in_cycles);
    RUN_TEST(test_the_smallest_margin_is_kept);
    RUN_TEST(test_the_first_missing_joint_is_named);
    RUN_TEST(test_settled_and_healthy_begin_at_their_time);
    RUN_TEST(test_a_guard_that_waits_permits_only_if_nothing_is_tripped);
    RUN_TEST(test_what_one_channel_lacks_both_lack);
    RUN_TEST(test_a_guard_in_fault_tells_its_reason_in_every_tick);
    RUN_TEST(test_a_contact_after_a_stop_for_an_input_has_its_own_category);
    RUN_TEST(test_the_ends_of_the_wires_range_are_readings);
    RUN_TEST(test_the_ends_of_the_acceleration_are_values);
    RUN_TEST(test_a_sender_that_is_no_joint_is_named_by_no_joint);
    RUN_TEST(test_errors_of_a_joint_that_the_robot_does_not_have_are_nobodys);
    RUN_TEST(test_the_second_channel_changes_its_copy_and_the_speed_alone);
    return UNITY_END();
}
