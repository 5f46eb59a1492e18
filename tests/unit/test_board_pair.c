/* The guard of boards and hosts (firmware/pair): with two blocks two channels, with one block one. The first channel
 * has this build's numeric type, the second one Q9.22. A build in Q9.22 has no second channel: there every test with
 * two blocks checks that they are refused. */
#include "guard_fixture.h"
#include "guard_parts.h"
#include "pair.h"

static bench_t bench; /* of the robot; its guard is not used */
static pair_t pair;
static guard_output_t out;
static guard_config_t other; /* the second block, in some tests with a defect */

#if TAUPERP_CHANNELS == 2

#include "second_block.h"

#define HAS_SECOND true

static void copy_second_block(void) {
    memcpy(&other, second_block(), sizeof other); /* both numeric types have one layout */
}
static void second_receives(const can_frame_t *frame) {
    tauperp_second_receive(&pair.second, frame, bench.now_us);
}
static void second_trips(guard_reason_t reason) {
    tauperp_second_trip(&pair.second, (uint32_t)reason);
}
static void second_forgets(void) {
    second_forgets_its_reset(&pair.second);
}

#else

#define HAS_SECOND false

static void copy_second_block(void) {
    other = make_config();
}
static void second_receives(const can_frame_t *frame) {
    (void)frame;
}
static void second_trips(guard_reason_t reason) {
    (void)reason;
}
static void second_forgets(void) {}

#endif

static void hear(can_frame_t frame) {
    pair_receive(&pair, &frame, bench.now_us);
}

/* All frames of the next cycle. */
static void hear_cycle(void) {
    next_cycle(&bench);
    hear(sync_frame(&bench));
    hear(task_frame(&bench));
    for (uint32_t i = 0; i < JOINTS; ++i) {
        hear(joint_frame(&bench, i));
    }
}

static void cycle_of_pair(void) {
    hear_cycle();
    pair_tick(&pair, bench.now_us, &out);
}

static bool frame_permits(void) {
    return out.frame[0].data[2] == 0xE1u; /* Permission 1, PermissionInverted 14 */
}

static guard_status_t start_pair(const void *second) {
    const guard_config_t config = make_config();
    start_with(&bench, &config);
    const guard_status_t status = pair_init(&pair, &bench.config, second);
    pair_note_start(&pair, GUARD_START_POWER_ON, 0u, GUARD_VARIANT_PRODUCT);
    out = (guard_output_t){.permitted = true};
    return status;
}

static void run_to_permission(void) {
    for (uint32_t i = 0; (i < START_LIMIT) && (out.reason != GUARD_REASON_AWAITING_RESET); ++i) {
        cycle_of_pair();
        TEST_ASSERT_FALSE(out.permitted);
    }
    for (uint32_t i = 0; i < 3u; ++i) {
        hear(reset_frame(&bench, 0u, i == 2u));
        cycle_of_pair();
    }
    TEST_ASSERT_TRUE(out.permitted);
    TEST_ASSERT_TRUE(frame_permits());
}

/* The high half of byte 4 of GuardStatus's page `start`. */
static uint32_t channels_told(void) {
    for (uint32_t i = 0; i < 200u; ++i) {
        cycle_of_pair();
        const can_frame_t *const status = &out.frame[1];
        if ((status->id == 0x200u) && ((status->data[1] >> 4) == PAGE_START)) {
            return status->data[4] >> 4;
        }
    }
    return 0u;
}

static void assert_state(guard_state_t state, guard_reason_t reason) {
    TEST_ASSERT_EQUAL(state, out.state);
    TEST_ASSERT_EQUAL(reason, out.reason);
    TEST_ASSERT_FALSE(out.permitted);
    TEST_ASSERT_FALSE(frame_permits());
}

/* No permission, whatever is received. */
static void assert_refused(void) {
    for (uint32_t i = 0; i < START_LIMIT; ++i) {
        cycle_of_pair();
        assert_state(GUARD_STATE_UNINITIALISED, GUARD_REASON_UNINITIALISED);
    }
}

/* True: two channels run and permit. False: this build has one, and refuses both blocks. */
static bool run_two_to_permission(void) {
    copy_second_block();
    const guard_status_t status = start_pair(&other);
    TEST_ASSERT_EQUAL(HAS_SECOND ? GUARD_OK : GUARD_BAD_PAIR, status);
    if (HAS_SECOND) {
        run_to_permission();
    } else {
        assert_refused();
    }
    return HAS_SECOND;
}

void setUp(void) {}
void tearDown(void) {}

static void test_one_block_is_one_channel_with_every_function(void) {
    TEST_ASSERT_EQUAL(GUARD_OK, start_pair(NULL));
    run_to_permission();
    TEST_ASSERT_EQUAL(1u, channels_told());
    hear_cycle();
    TEST_ASSERT_TRUE(pair_cycle_complete(&pair));
    pair_trip(&pair, GUARD_REASON_BUS_OFF);
    pair_tick(&pair, bench.now_us, &out);
    assert_state(GUARD_STATE_STOPPED, GUARD_REASON_BUS_OFF);
    pair_note_tick_time(&pair, 10u * PERIOD_US);
    cycle_of_pair();
    assert_state(GUARD_STATE_FAULT, GUARD_REASON_TICK_OVER_BUDGET);
}

static void test_a_bad_first_block_is_refused_and_its_status_returned(void) {
    (void)start_pair(NULL);
    bench.config.magic = 0u;
    TEST_ASSERT_EQUAL(GUARD_BAD_MAGIC, pair_init(&pair, &bench.config, &bench.config));
    assert_refused();
}

static void test_two_blocks_of_one_installation_permit_together(void) {
    if (run_two_to_permission()) {
        TEST_ASSERT_EQUAL(2u, channels_told());
        TEST_ASSERT_TRUE(out.permitted);
    }
}

static void test_blocks_of_different_installations_are_refused(void) {
    copy_second_block();
    other.stop_collision = 1u;
    seal_config(&other);
    TEST_ASSERT_EQUAL(GUARD_BAD_PAIR, start_pair(&other));
    assert_refused();
    copy_second_block();
    other.robot.name[0] = 'x';
    seal_config(&other);
    TEST_ASSERT_EQUAL(GUARD_BAD_PAIR, start_pair(&other));
    assert_refused();
}

static void test_a_bad_second_block_is_refused_and_its_status_returned(void) {
    copy_second_block();
    other.stop_collision = 1u; /* without a new CRC */
    TEST_ASSERT_EQUAL(HAS_SECOND ? GUARD_BAD_CRC : GUARD_BAD_PAIR, start_pair(&other));
    assert_refused();
}

static void test_a_cycle_is_complete_when_both_have_every_joint(void) {
    if (!run_two_to_permission()) {
        return;
    }
    next_cycle(&bench);
    hear(sync_frame(&bench));
    hear(task_frame(&bench));
    for (uint32_t i = 1u; i < JOINTS; ++i) {
        hear(joint_frame(&bench, i));
    }
    const can_frame_t frame = joint_frame(&bench, 0u);
    TEST_ASSERT_FALSE(pair_cycle_complete(&pair));
    guard_receive(&pair.guard, &frame, bench.now_us);
    TEST_ASSERT_FALSE(pair_cycle_complete(&pair));
    second_receives(&frame);
    TEST_ASSERT_TRUE(pair_cycle_complete(&pair));
}

static void test_a_trip_or_a_late_tick_is_one_of_both(void) {
    if (!run_two_to_permission()) {
        return;
    }
    pair_trip(&pair, GUARD_REASON_BUS_OFF);
    cycle_of_pair();
    assert_state(GUARD_STATE_STOPPED, GUARD_REASON_BUS_OFF);
    pair_note_tick_time(&pair, 10u * PERIOD_US);
    cycle_of_pair();
    assert_state(GUARD_STATE_FAULT, GUARD_REASON_TICK_OVER_BUDGET);
}

static void test_a_trip_of_the_second_alone_stops_both(void) {
    if (!run_two_to_permission()) {
        return;
    }
    second_trips(GUARD_REASON_BUS_OFF);
    cycle_of_pair();
    assert_state(GUARD_STATE_STOPPED, GUARD_REASON_BUS_OFF);
}

/* The inverted copy is the second channel's: alone it withdraws the permission, of the frame and of the pin. */
static void test_a_copy_that_either_withholds_permits_nothing(void) {
    for (uint32_t which = 0; which < 2u; ++which) {
        if (!run_two_to_permission()) {
            return;
        }
        if (which == 0u) {
            pair.guard.acknowledged = (uint8_t)GUARD_CLEAR;
        } else {
            second_forgets();
        }
        cycle_of_pair();
        TEST_ASSERT_FALSE(out.permitted);
        TEST_ASSERT_TRUE(out.withheld);
        TEST_ASSERT_FALSE(frame_permits());
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_one_block_is_one_channel_with_every_function);
    RUN_TEST(test_a_bad_first_block_is_refused_and_its_status_returned);
    RUN_TEST(test_two_blocks_of_one_installation_permit_together);
    RUN_TEST(test_blocks_of_different_installations_are_refused);
    RUN_TEST(test_a_bad_second_block_is_refused_and_its_status_returned);
    RUN_TEST(test_a_cycle_is_complete_when_both_have_every_joint);
    RUN_TEST(test_a_trip_or_a_late_tick_is_one_of_both);
    RUN_TEST(test_a_trip_of_the_second_alone_stops_both);
    RUN_TEST(test_a_copy_that_either_withholds_permits_nothing);
    return UNITY_END();
}
