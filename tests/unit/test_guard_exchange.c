/* What two guards that decide together exchange (the decision itself: test_guard_two.c): each number of an opinion, the
 * event that is made from one, and the second channel's part of the StopCommand. */
#include "core_fixture.h"
#include "guard_fixture.h"

static bench_t one, two;
static guard_finding_t found_one, found_two;
static opinion_t said_one, said_two;

static void start_both(const guard_config_t *config) {
    start_with(&one, config);
    start_with(&two, config);
    guard_join(&one.guard, false);
    guard_join(&two.guard, true);
}

void setUp(void) {
    const guard_config_t config = make_config();
    start_both(&config);
}
void tearDown(void) {}

static void look(void) {
    guard_look(&one.guard, one.now_us, &found_one);
    guard_look(&two.guard, two.now_us, &found_two);
    guard_tell(&one.guard, &found_one, &said_one);
    guard_tell(&two.guard, &found_two, &said_two);
}

static void decide(void) {
    one.out = (guard_output_t){.withheld = true};
    two.out = (guard_output_t){.withheld = true};
    guard_decide(&one.guard, one.now_us, &found_one, &said_one, &said_two, &one.out);
    guard_decide(&two.guard, two.now_us, &found_two, &said_two, &said_one, &two.out);
    guard_say(&one.guard, &one.out);
    guard_confirm(&two.out, &one.out.frame[0]);
    TEST_ASSERT_EQUAL(one.out.state, two.out.state);
    TEST_ASSERT_EQUAL(one.out.trip_number, two.out.trip_number);
}

static void receive_all(bench_t *bench) {
    next_cycle(bench);
    receive(bench, sync_frame(bench));
    receive(bench, task_frame(bench));
    for (uint32_t i = 0; i < JOINTS; ++i) {
        receive(bench, joint_frame(bench, i));
    }
}

/* One cycle up to the two opinions, which a test may change. */
static void opine(void) {
    receive_all(&one);
    receive_all(&two);
    look();
}

static void cycles_of_both(uint32_t number) {
    for (uint32_t i = 0; i < number; ++i) {
        opine();
        decide();
    }
}

static void wait_for(guard_reason_t reason) {
    for (uint32_t i = 0; (i < START_LIMIT) && (one.out.reason != reason); ++i) {
        cycles_of_both(1u);
    }
    TEST_ASSERT_EQUAL(reason, one.out.reason);
}

static void reset_both(void) {
    const uint8_t trip = one.out.trip_number;
    for (uint32_t i = 0; i < 3u; ++i) {
        receive(&one, reset_frame(&one, trip, i == 2u));
        receive(&two, reset_frame(&two, trip, i == 2u));
        cycles_of_both(1u);
    }
}

/* Low nibble: the permission; high nibble: its inverted copy (docs/wire.md, StopCommand). */
static uint32_t permission_of(const can_frame_t *frame) {
    uint8_t copy[8];
    memcpy(copy, frame->data, sizeof(copy));
    e2e_seal(copy, frame->length, protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND].data_ids, copy[1] & 0x0Fu);
    TEST_ASSERT_EQUAL_MEMORY(copy, frame->data, frame->length); /* sealed after the last change */
    return frame->data[2];
}

#define COPY(permission) ((uint32_t)(TAUPERP_STOP_COMMAND_PERMISSION_INVERTED_##permission##_CHOICE) << 4)
#define MOVES            (COPY(MOVE) | TAUPERP_STOP_COMMAND_PERMISSION_MOVE_CHOICE)
#define STOPS            (COPY(STOP) | TAUPERP_STOP_COMMAND_PERMISSION_STOP_CHOICE)

static void assert_permits(bool permits) {
    TEST_ASSERT_EQUAL_HEX32(permits ? MOVES : STOPS, permission_of(&one.out.frame[0]));
}

static void permit(void) {
    wait_for(GUARD_REASON_AWAITING_RESET);
    assert_permits(false);
    reset_both();
    TEST_ASSERT_EQUAL(GUARD_STATE_MONITORING, one.out.state);
    assert_permits(true);
}

static void test_a_single_guard_is_alone(void) {
    static bench_t alone; /* a controller's stack is smaller */
    start(&alone);
    TEST_ASSERT_TRUE(guard_is_alone(&alone.guard));
    TEST_ASSERT_EQUAL_HEX32(0x5Au, alone.guard.company);
    TEST_ASSERT_EQUAL_HEX32(0xA5u, one.guard.company);
}

/* An opinion holds a number in 1e-6 Nm. The event has it in steps of 0.002 Nm. */
static void test_a_stop_that_one_wishes_stops_both_with_its_event(void) {
    static const int32_t values[] = {12345678, -3501999, 511000000, 12002000};
    static const double heard[] = {12.344, -3.500, 511.0, 12.002};
    for (uint32_t i = 0; i < 4u; ++i) {
        setUp();
        permit();
        opine();
        TEST_ASSERT_FALSE(said_two.hard); /* the soft projector */
        said_two.wish = WISH_STOP;
        said_two.reason = GUARD_REASON_COLLISION;
        said_two.joint = 5u;
        said_two.category = 1u;
        said_two.value = values[i];
        said_two.threshold = 2000000;
        found_two.wish = WISH_STOP;
        found_two.event = (guard_event_t){.reason = GUARD_REASON_COLLISION, .joint = 5u, .category = 1u};
        decide();
        assert_stopped(&one, GUARD_REASON_COLLISION, 5u);
        TEST_ASSERT_EQUAL(1, one.out.stop_category);
        ASSERT_CLOSE(heard[i], value_of(one.out.value_nm), 2e-5);
        ASSERT_CLOSE(2.0, value_of(one.out.threshold_nm), 1e-6);
        assert_permits(false);
    }
}

/* Of two stops of the same category both channels take the first channel's. */
static void test_of_two_stops_alike_both_take_that_of_the_first_channel(void) {
    permit();
    opine();
    said_one.wish = WISH_STOP;
    said_one.reason = GUARD_REASON_COLLISION;
    said_one.joint = 2u;
    said_two = said_one;
    said_two.reason = GUARD_REASON_SUDDEN;
    said_two.joint = 3u;
    found_one.wish = WISH_STOP;
    found_one.event = (guard_event_t){.reason = GUARD_REASON_COLLISION, .joint = 2u};
    found_two.wish = WISH_STOP;
    found_two.event = (guard_event_t){.reason = GUARD_REASON_SUDDEN, .joint = 3u};
    decide();
    TEST_ASSERT_EQUAL(GUARD_REASON_COLLISION, one.out.reason);
    TEST_ASSERT_EQUAL(GUARD_REASON_COLLISION, two.out.reason);
    TEST_ASSERT_EQUAL(2, two.out.joint);
}

/* Health counts from the last tick in which both were healthy. */
static void test_health_is_that_of_both(void) {
    for (uint32_t channel = 0; channel < 2u; ++channel) {
        setUp();
        permit();
        opine();
        guard_trip(&one.guard, GUARD_REASON_SHUTDOWN);
        guard_trip(&two.guard, GUARD_REASON_SHUTDOWN);
        cycles_of_both(SETTLING_CYCLES - 1u);
        opine();
        said_one.healthy = said_one.healthy && (channel == 1u);
        said_two.healthy = said_two.healthy && (channel == 0u);
        found_one.healthy = said_one.healthy;
        found_two.healthy = said_two.healthy;
        decide();
        reset_both();
        TEST_ASSERT_EQUAL(GUARD_STATE_STOPPED, one.out.state);
        cycles_of_both(SETTLING_CYCLES);
        reset_both();
        TEST_ASSERT_EQUAL(GUARD_STATE_MONITORING, one.out.state);
    }
}

static void test_what_a_channel_tells_is_what_it_found(void) {
    guard_config_t config = make_config();
    config.bank.channels = 3u;
    config.bank.channel[1] = config.bank.channel[0];
    config.bank.channel[2] = config.bank.channel[0];
    config.subspace.projector = PROJECTOR_HARD;
    seal_config(&config);
    start_both(&config);
    permit();
    for (uint32_t i = 0; i < JOINTS; ++i) {
        one.guard.observer.residual[i] = num_of(0.25 * (i + 1.0));
        for (uint32_t c = 0; c < 3u; ++c) {
            one.guard.bank.channel[c].output[i] = num_of(-1.5 * (c + 1.0) + i);
        }
    }
    one.guard.observer.residual[6] = IF_FIXED(INT32_MAX, num_of(600.0)); /* beyond what an opinion can hold */
    one.guard.bank.channel[0].output[6] = -one.guard.observer.residual[6];
    one.guard.observer.residual[JOINTS] = NUM(9); /* of no joint, and of no channel */
    one.guard.bank.channel[0].output[JOINTS] = NUM(9);
    one.guard.bank.channel[3].output[0] = NUM(9);
    one.guard.index.rank = 4u;
    found_one.event = (guard_event_t){.reason = GUARD_REASON_COLLISION,
                                      .joint = 3u,
                                      .category = 2u,
                                      .value_nm = NUM(-7.5),
                                      .threshold_nm = NUM(1.25)};
    found_one.wish = WISH_STOP;
    guard_tell(&one.guard, &found_one, &said_one);
    TEST_ASSERT_EQUAL(WISH_STOP, said_one.wish);
    TEST_ASSERT_EQUAL(GUARD_REASON_COLLISION, said_one.reason);
    TEST_ASSERT_EQUAL(3, said_one.joint);
    TEST_ASSERT_EQUAL(2, said_one.category);
    TEST_ASSERT_EQUAL(-7500000, said_one.value);
    TEST_ASSERT_EQUAL(1250000, said_one.threshold);
    TEST_ASSERT_TRUE(said_one.hard && said_one.healthy && said_one.tested && said_one.fresh);
    TEST_ASSERT_EQUAL(GUARD_STATE_MONITORING, said_one.state);
    TEST_ASSERT_EQUAL(TASK_NONE, said_one.task);
    TEST_ASSERT_EQUAL(4, said_one.rank);
    TEST_ASSERT_EQUAL(JOINTS, said_one.joints);
    TEST_ASSERT_EQUAL(3, said_one.channels);
    TEST_ASSERT_EQUAL(one.cycle, said_one.cycle);
    TEST_ASSERT_EQUAL(PERIOD_US, said_one.period_us);
    for (int32_t i = 0; i < (int32_t)JOINTS - 1; ++i) {
        TEST_ASSERT_EQUAL(250000 * (i + 1), said_one.residual[i]);
        for (int32_t c = 0; c < 3; ++c) {
            TEST_ASSERT_EQUAL(-1500000 * (c + 1) + 1000000 * i, said_one.index[c][i]);
        }
    }
    TEST_ASSERT_EQUAL(511000000, said_one.residual[6]);
    TEST_ASSERT_EQUAL(-511000000, said_one.index[0][6]);
    TEST_ASSERT_EQUAL(0, said_one.residual[JOINTS]);
    TEST_ASSERT_EQUAL(0, said_one.index[0][JOINTS]);
    TEST_ASSERT_EQUAL(0, said_one.index[3][0]);
    one.guard.joints = ROBOT_MAX_JOINTS + 1u; /* a corrupt count, before the check of the next tick */
    guard_tell(&one.guard, &found_one, &said_one);
    TEST_ASSERT_EQUAL(ROBOT_MAX_JOINTS, said_one.joints);
}

static void confirm(bool permitted, bool withheld, uint16_t cycle, bool copy_permits) {
    const guard_output_t own = {.permitted = permitted, .withheld = withheld, .cycle = cycle};
    const uint8_t counter = one.out.frame[0].data[1];
    guard_confirm(&own, &one.out.frame[0]);
    TEST_ASSERT_EQUAL_HEX8(counter, one.out.frame[0].data[1]);
    const uint32_t copy = copy_permits ? COPY(MOVE) : COPY(STOP);
    TEST_ASSERT_EQUAL_HEX32(copy | TAUPERP_STOP_COMMAND_PERMISSION_MOVE_CHOICE, permission_of(&one.out.frame[0]));
}

static void test_the_second_channel_writes_the_copy_of_the_permission(void) {
    permit();
    const uint16_t cycle = one.out.cycle;
    confirm(true, false, cycle, true);
    confirm(true, true, cycle, false);
    confirm(false, false, cycle, false);
    confirm(false, true, cycle, false);
    confirm(true, false, (uint16_t)(cycle + 1u), false);
    confirm(true, false, (uint16_t)(cycle + 16u), true); /* the frame has four bits of it */
}

static void test_the_second_channel_may_take_the_full_speed_away(void) {
    permit();
    const guard_output_t slow = {.permitted = true, .cycle = one.out.cycle, .full_speed = false};
    const guard_output_t fast = {.permitted = true, .cycle = one.out.cycle, .full_speed = true};
    can_frame_t *const frame = &one.out.frame[0];
    frame->data[4] = 0xFFu; /* bit 7 is the speed, the others are the frame's own */
    guard_confirm(&fast, frame);
    TEST_ASSERT_EQUAL_HEX8(0xFFu, frame->data[4]);
    guard_confirm(&slow, frame);
    TEST_ASSERT_EQUAL_HEX8(0x7Fu, frame->data[4]);
    guard_confirm(&fast, frame); /* and nobody gives it back */
    TEST_ASSERT_EQUAL_HEX8(0x7Fu, frame->data[4]);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_single_guard_is_alone);
    RUN_TEST(test_a_stop_that_one_wishes_stops_both_with_its_event);
    RUN_TEST(test_of_two_stops_alike_both_take_that_of_the_first_channel);
    RUN_TEST(test_health_is_that_of_both);
    RUN_TEST(test_what_a_channel_tells_is_what_it_found);
    RUN_TEST(test_the_second_channel_writes_the_copy_of_the_permission);
    RUN_TEST(test_the_second_channel_may_take_the_full_speed_away);
    return UNITY_END();
}
