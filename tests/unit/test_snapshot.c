#include "snapshot.h"
#include "unity.h"

#include <string.h>

#define JOINTS 7u

static snapshot_t snapshot;

void setUp(void) {
    TEST_ASSERT_TRUE(snapshot_init(&snapshot, JOINTS));
}
void tearDown(void) {
    TEST_ASSERT_TRUE(snapshot_is_valid(&snapshot));
}

/* The reading of `joint` that was sampled on the Sync of `cycle`. */
static snapshot_status_t reading(uint32_t joint, uint16_t cycle) {
    const num_t mark = num_from_int((int32_t)joint + 1);
    return snapshot_add(&snapshot, joint, (uint8_t)(cycle & 0x0Fu), mark, mark + NUM(10), mark + NUM(20));
}

static void complete(uint16_t cycle) {
    snapshot_begin(&snapshot, cycle);
    for (uint32_t joint = 0; joint + 1u < JOINTS; ++joint) {
        TEST_ASSERT_EQUAL(SNAPSHOT_TAKEN, reading(joint, cycle));
    }
    TEST_ASSERT_EQUAL(SNAPSHOT_COMPLETED, reading(JOINTS - 1u, cycle));
    TEST_ASSERT_TRUE(snapshot_is_complete(&snapshot));
}

/* Completes the snapshot of `cycle` and takes it: the gap. */
static uint32_t take(uint16_t cycle) {
    complete(cycle);
    return snapshot_take(&snapshot);
}

static void test_a_robot_has_1_to_8_joints(void) {
    for (uint32_t joints = 0; joints <= 40u; ++joints) {
        snapshot_t other;
        TEST_ASSERT_EQUAL((joints >= 1u) && (joints <= ROBOT_MAX_JOINTS), snapshot_init(&other, joints));
        TEST_ASSERT_FALSE(snapshot_is_complete(&other));
    }
}

static void test_nothing_is_taken_before_the_first_sync(void) {
    TEST_ASSERT_EQUAL(SNAPSHOT_NO_SYNC, reading(0, 0));
    TEST_ASSERT_FALSE(snapshot_is_complete(&snapshot));
}

static void test_it_is_complete_only_with_the_last_joint_for_every_number_of_joints(void) {
    for (uint32_t joints = 1; joints <= ROBOT_MAX_JOINTS; ++joints) {
        TEST_ASSERT_TRUE(snapshot_init(&snapshot, joints));
        snapshot_begin(&snapshot, 3);
        for (uint32_t joint = joints; joint-- > 0u;) {
            TEST_ASSERT_FALSE(snapshot_is_complete(&snapshot));
            TEST_ASSERT_EQUAL((joint == 0u) ? SNAPSHOT_COMPLETED : SNAPSHOT_TAKEN, reading(joint, 3));
            TEST_ASSERT_TRUE(snapshot_is_valid(&snapshot));
        }
        TEST_ASSERT_TRUE(snapshot_is_complete(&snapshot));
    }
}

static void test_each_reading_is_stored_at_its_joint(void) {
    complete(9);
    for (uint32_t joint = 0; joint < JOINTS; ++joint) {
        const num_t mark = num_from_int((int32_t)joint + 1);
        TEST_ASSERT_TRUE(snapshot.position[joint] == mark);
        TEST_ASSERT_TRUE(snapshot.velocity[joint] == mark + NUM(10));
        TEST_ASSERT_TRUE(snapshot.torque[joint] == mark + NUM(20));
    }
}

static void test_a_joint_that_the_robot_does_not_have_is_refused(void) {
    snapshot_begin(&snapshot, 0);
    TEST_ASSERT_EQUAL(SNAPSHOT_NO_JOINT, reading(JOINTS, 0));
    TEST_ASSERT_EQUAL(SNAPSHOT_NO_JOINT, reading(ROBOT_MAX_JOINTS, 0));
    TEST_ASSERT_EQUAL(SNAPSHOT_NO_JOINT, reading(32, 0));
    TEST_ASSERT_EQUAL(SNAPSHOT_NO_JOINT, reading(UINT32_MAX, 0));
}

static void test_a_sync_drops_the_previous_incomplete_cycle(void) {
    snapshot_begin(&snapshot, 1);
    for (uint32_t joint = 0; joint + 1u < JOINTS; ++joint) {
        (void)reading(joint, 1);
    }
    snapshot_begin(&snapshot, 2);
    TEST_ASSERT_EQUAL(SNAPSHOT_TAKEN, reading(JOINTS - 1u, 2));
    TEST_ASSERT_FALSE(snapshot_is_complete(&snapshot));
}

static void test_a_sync_ends_a_complete_snapshot(void) {
    complete(1);
    snapshot_begin(&snapshot, 2);
    TEST_ASSERT_FALSE(snapshot_is_complete(&snapshot));
}

static void test_readings_of_two_cycles_never_make_one_snapshot(void) {
    snapshot_begin(&snapshot, 5);
    for (uint32_t joint = 0; joint < JOINTS; ++joint) {
        const bool stale = joint == 3u;
        TEST_ASSERT_EQUAL(stale ? SNAPSHOT_LATE : SNAPSHOT_TAKEN, reading(joint, stale ? 4 : 5));
    }
    TEST_ASSERT_FALSE(snapshot_is_complete(&snapshot));
    TEST_ASSERT_EQUAL(SNAPSHOT_COMPLETED, reading(3, 5));
}

static void test_only_the_current_cycles_nibble_is_accepted(void) {
    for (uint16_t cycle = 0; cycle < 16u; ++cycle) {
        for (uint16_t behind = 0; behind < 16u; ++behind) {
            snapshot_begin(&snapshot, cycle);
            const snapshot_status_t expected = (behind == 0u)   ? SNAPSHOT_TAKEN
                                               : (behind <= 8u) ? SNAPSHOT_LATE
                                                                : SNAPSHOT_WRONG_CYCLE;
            TEST_ASSERT_EQUAL(expected, reading(0, (uint16_t)(cycle - behind)));
        }
    }
}

static void test_a_duplicate_is_refused_and_the_first_reading_stays(void) {
    snapshot_begin(&snapshot, 7);
    (void)reading(2, 7);
    TEST_ASSERT_EQUAL(SNAPSHOT_DUPLICATE, snapshot_add(&snapshot, 2, 7, NUM(99), NUM(99), NUM(99)));
    TEST_ASSERT_TRUE(snapshot.position[2] == NUM(3));
    TEST_ASSERT_FALSE(snapshot_is_complete(&snapshot));
}

static void test_a_duplicate_after_completion_changes_nothing(void) {
    complete(7);
    TEST_ASSERT_EQUAL(SNAPSHOT_DUPLICATE, reading(2, 7));
    TEST_ASSERT_TRUE(snapshot_is_complete(&snapshot));
}

static void test_a_snapshot_is_taken_once(void) {
    complete(7);
    (void)snapshot_take(&snapshot);
    TEST_ASSERT_FALSE(snapshot_is_complete(&snapshot));
    TEST_ASSERT_EQUAL(SNAPSHOT_DUPLICATE, reading(0, 7));
    TEST_ASSERT_FALSE(snapshot_is_complete(&snapshot));
    complete(8);
}

static void test_the_first_snapshot_has_no_predecessor(void) {
    TEST_ASSERT_EQUAL_UINT(0, take(100));
}

static void test_the_gap_counts_cycles_since_the_last_evaluated_snapshot(void) {
    (void)take(100);
    TEST_ASSERT_EQUAL_UINT(1, take(101));
    snapshot_begin(&snapshot, 102);
    (void)reading(0, 102); /* the others are lost */
    TEST_ASSERT_EQUAL_UINT(2, take(103));
    complete(104); /* complete, but not taken */
    TEST_ASSERT_EQUAL_UINT(2, take(105));
    TEST_ASSERT_EQUAL_UINT(4, take(109)); /* three Syncs are lost */
}

static void test_the_gap_is_right_across_the_wrap_of_the_cycle_number(void) {
    (void)take(65534);
    TEST_ASSERT_EQUAL_UINT(1, take(65535));
    TEST_ASSERT_EQUAL_UINT(3, take(2));
    TEST_ASSERT_EQUAL_UINT(65535, take(1));
}

static void test_a_cycle_number_that_jumps_back_is_a_gap_too_long_to_bridge(void) {
    (void)take(1000);
    TEST_ASSERT_EQUAL_UINT(65528, take(992));
}

static void test_the_same_cycle_begun_again_has_no_predecessor(void) {
    (void)take(5);
    TEST_ASSERT_EQUAL_UINT(0, take(5));
}

static void test_a_corrupt_state_is_not_valid(void) {
    (void)take(5);
    const snapshot_t good = snapshot;
    TEST_ASSERT_TRUE(snapshot_is_valid(&good));
    snapshot_t corrupt[7] = {good, good, good, good, good, good, good};
    corrupt[0].expected = 0u;      /* no joint */
    corrupt[1].expected = 0x7Du;   /* joints with a hole */
    corrupt[2].received = 0xFFu;   /* a joint that is not expected */
    corrupt[3].received = 0x3Fu;   /* taken without having been complete */
    corrupt[4].taken_cycle = 4u;   /* taken, but not this cycle */
    corrupt[5].referenced = false; /* taken, but never was */
    corrupt[6].begun = false;      /* readings without a cycle */
    for (uint32_t i = 0; i < 7u; ++i) {
        TEST_ASSERT_FALSE(snapshot_is_valid(&corrupt[i]));
    }
    snapshot_t fresh;
    TEST_ASSERT_TRUE(snapshot_init(&fresh, JOINTS));
    TEST_ASSERT_TRUE(snapshot_is_valid(&fresh));
    fresh.received = 1u; /* a reading before any Sync */
    TEST_ASSERT_FALSE(snapshot_is_valid(&fresh));
    fresh.received = 0u;
    fresh.expected = 0x7Du; /* joints with a hole */
    TEST_ASSERT_FALSE(snapshot_is_valid(&fresh));
    fresh.expected = 0x7Fu;
    fresh.referenced = true; /* one taken before any Sync */
    TEST_ASSERT_FALSE(snapshot_is_valid(&fresh));
}

static void test_a_restart_gives_the_initial_state(void) {
    (void)take(5);
    snapshot_restart(&snapshot);
    snapshot_t fresh;
    TEST_ASSERT_TRUE(snapshot_init(&fresh, JOINTS));
    TEST_ASSERT_EQUAL_MEMORY(&fresh, &snapshot, sizeof fresh);
    TEST_ASSERT_EQUAL(SNAPSHOT_NO_SYNC, reading(0, 5));
}

static void test_a_state_with_a_single_error_is_not_valid(void) {
    snapshot_t other;
    TEST_ASSERT_TRUE(snapshot_init(&other, JOINTS));
    other.expected = 0u; /* no joint is expected, and none was received */
    TEST_ASSERT_FALSE(snapshot_is_valid(&other));
    TEST_ASSERT_TRUE(snapshot_init(&other, JOINTS));
    snapshot_begin(&other, 3);
    other.received = 0x80u; /* of a joint that is not expected, in a cycle without an evaluation */
    TEST_ASSERT_FALSE(snapshot_is_valid(&other));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_robot_has_1_to_8_joints);
    RUN_TEST(test_nothing_is_taken_before_the_first_sync);
    RUN_TEST(test_it_is_complete_only_with_the_last_joint_for_every_number_of_joints);
    RUN_TEST(test_each_reading_is_stored_at_its_joint);
    RUN_TEST(test_a_joint_that_the_robot_does_not_have_is_refused);
    RUN_TEST(test_a_sync_drops_the_previous_incomplete_cycle);
    RUN_TEST(test_a_sync_ends_a_complete_snapshot);
    RUN_TEST(test_readings_of_two_cycles_never_make_one_snapshot);
    RUN_TEST(test_only_the_current_cycles_nibble_is_accepted);
    RUN_TEST(test_a_duplicate_is_refused_and_the_first_reading_stays);
    RUN_TEST(test_a_duplicate_after_completion_changes_nothing);
    RUN_TEST(test_a_snapshot_is_taken_once);
    RUN_TEST(test_the_first_snapshot_has_no_predecessor);
    RUN_TEST(test_the_gap_counts_cycles_since_the_last_evaluated_snapshot);
    RUN_TEST(test_the_gap_is_right_across_the_wrap_of_the_cycle_number);
    RUN_TEST(test_a_cycle_number_that_jumps_back_is_a_gap_too_long_to_bridge);
    RUN_TEST(test_the_same_cycle_begun_again_has_no_predecessor);
    RUN_TEST(test_a_corrupt_state_is_not_valid);
    RUN_TEST(test_a_restart_gives_the_initial_state);
    RUN_TEST(test_a_state_with_a_single_error_is_not_valid);
    return UNITY_END();
}
