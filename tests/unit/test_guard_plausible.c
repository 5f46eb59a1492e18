/* The plausibility of a joint's readings without the rest of the guard: the bounds of guard_plausible.c as numbers. At
 * 1 kHz and K = 50 1/s a joint at rest may be off by 0.0015 rad + 0.05 rad/s / 48.77 1/s = 0.002525 rad, and a joint
 * that moves by 5.5 ms of its velocity more. */
#include "core_fixture.h"
#include "guard_fixture.h"
#include "guard_parts.h"

static plausibility_t plausibility;
static guard_config_t config;
static snapshot_t snapshot;
static motion_t motion;

void setUp(void) {
    config = make_config();
    memset(&snapshot, 0, sizeof(snapshot));
    memset(&motion, 0, sizeof(motion));
    plausibility_init(&plausibility);
}
void tearDown(void) {}

static uint32_t step(uint32_t gap) {
    for (uint32_t i = 0; i < JOINTS; ++i) { /* no reading is frozen */
        snapshot.torque[i] = (snapshot.torque[i] > NUM(0)) ? NUM(-1) : NUM(1);
    }
    plausibility_step(&plausibility, &config.observer, JOINTS, gap, &snapshot, &motion);
    return plausibility.fault;
}

static void start_at(double position, double velocity) {
    setUp();
    snapshot.position[3] = num_of(position);
    snapshot.velocity[3] = num_of(velocity);
    TEST_ASSERT_EQUAL(0, step(0u));
}

static void move(double by) {
    snapshot.position[3] = snapshot.position[3] + num_of(by);
}

/* The joint moves as its velocity says for `gap` cycles of 1 ms, and by `more`. */
static uint32_t fault_of(double velocity, uint32_t gap, double more) {
    start_at(0.5, velocity);
    move(velocity * 0.001 * gap + more);
    return step(gap);
}

static void assert_bound(double velocity, uint32_t gap, double bound) {
    TEST_ASSERT_EQUAL(0, fault_of(velocity, gap, bound - 1e-5));
    TEST_ASSERT_EQUAL(0, fault_of(velocity, gap, -bound + 1e-5));
    TEST_ASSERT_EQUAL(GUARD_REASON_IMPLAUSIBLE, fault_of(velocity, gap, bound + 1e-5));
    TEST_ASSERT_EQUAL(3, plausibility.joint);
    TEST_ASSERT_EQUAL(GUARD_REASON_IMPLAUSIBLE, fault_of(velocity, gap, -bound - 1e-5));
}

static void test_a_joint_at_rest_may_jump_by_two_and_a_half_milliradians(void) {
    for (uint32_t gap = 1; gap <= CONFIG_MAX_GAP; ++gap) {
        assert_bound(0.0, gap, 0.002525);
    }
}

static void test_a_joint_that_moves_may_be_late_by_its_velocity(void) {
    for (uint32_t gap = 1; gap <= CONFIG_MAX_GAP; ++gap) {
        const double late_s = 0.003 + 2.5 * 0.001 * gap;
        assert_bound(1.0, gap, 0.002525 + late_s);
        assert_bound(-1.0, gap, 0.002525 + late_s);
    }
}

/* Of two velocities the mean counts for the way, and the faster one for the bound. */
static void test_a_velocity_that_changes_counts_by_its_mean(void) {
    for (int faster = 0; faster < 2; ++faster) {
        for (int sign = -1; sign <= 1; sign += 2) {
            start_at(0.0, (faster == 0) ? 0.0 : -2.0);
            snapshot.velocity[3] = num_of((faster == 0) ? -2.0 : 0.0);
            move(-0.001 + sign * (0.002525 + 2.0 * 0.0055 - 1e-5));
            TEST_ASSERT_EQUAL(0, step(1u));
            start_at(0.0, (faster == 0) ? 0.0 : -2.0);
            snapshot.velocity[3] = num_of((faster == 0) ? -2.0 : 0.0);
            move(-0.001 + sign * (0.002525 + 2.0 * 0.0055 + 1e-5));
            TEST_ASSERT_EQUAL(GUARD_REASON_IMPLAUSIBLE, step(1u));
        }
    }
}

/* After one step 0.951 of the error is left, after a step over three cycles 0.861. */
static void test_an_error_is_forgotten_as_the_observer_forgets(void) {
    static const double decay[] = {0.951229, 0.904837, 0.860708, 0.818731};
    for (uint32_t gap = 1; gap <= CONFIG_MAX_GAP; ++gap) {
        const double more = 0.002525 - decay[gap - 1u] * 0.0025;
        start_at(0.0, 0.0);
        move(0.0025);
        TEST_ASSERT_EQUAL(0, step(1u));
        move(more - 1e-5);
        TEST_ASSERT_EQUAL(0, step(gap));
        start_at(0.0, 0.0);
        move(0.0025);
        TEST_ASSERT_EQUAL(0, step(1u));
        move(more + 1e-5);
        TEST_ASSERT_EQUAL(GUARD_REASON_IMPLAUSIBLE, step(gap));
    }
}

static void test_a_restart_of_the_observer_forgets_the_last_readings(void) {
    static const uint32_t restarts[] = {0u, CONFIG_MAX_GAP + 1u};
    for (uint32_t i = 0; i < 2u; ++i) {
        start_at(0.0, 0.0);
        move(0.0025);
        TEST_ASSERT_EQUAL(0, step(1u));
        move(1.0);
        TEST_ASSERT_EQUAL(0, step(restarts[i]));
        move(0.0025); /* the error before it is forgotten as well */
        TEST_ASSERT_EQUAL(0, step(1u));
    }
}

static void test_the_first_of_several_joints_is_named(void) {
    start_at(0.0, 0.0);
    snapshot.position[2] = NUM(1);
    snapshot.position[5] = NUM(1);
    TEST_ASSERT_EQUAL(GUARD_REASON_IMPLAUSIBLE, step(1u));
    TEST_ASSERT_EQUAL(2, plausibility.joint);
    TEST_ASSERT_EQUAL(0, step(CONFIG_MAX_GAP + 1u)); /* a fault is that of its step */
}

static void test_the_joint_behind_the_last_one_does_not_count(void) {
    start_at(0.0, 0.0);
    snapshot.position[JOINTS] = NUM(1);
    TEST_ASSERT_EQUAL(0, step(1u));
}

static void test_the_first_snapshot_is_compared_with_nothing(void) {
    snapshot.position[3] = NUM(1);
    TEST_ASSERT_EQUAL(0, step(1u));
    move(0.5);
    TEST_ASSERT_EQUAL(GUARD_REASON_IMPLAUSIBLE, step(1u));
}

static void test_the_first_and_the_eighth_joint_are_looked_at(void) {
    for (uint32_t joint = 0; joint < ROBOT_MAX_JOINTS; joint += ROBOT_MAX_JOINTS - 1u) {
        setUp();
        plausibility_step(&plausibility, &config.observer, ROBOT_MAX_JOINTS, 0u, &snapshot, &motion);
        snapshot.position[joint] = NUM(1);
        plausibility_step(&plausibility, &config.observer, ROBOT_MAX_JOINTS, 1u, &snapshot, &motion);
        TEST_ASSERT_EQUAL(GUARD_REASON_IMPLAUSIBLE, plausibility.fault);
        TEST_ASSERT_EQUAL(joint, plausibility.joint);
    }
}

/* --- frozen ------------------------------------------------------------------------------------------------------- */

/* One snapshot in which the torque of joint 3 stays as it is. */
static uint32_t hold(double gravity) {
    const num_t held = snapshot.torque[3];
    motion.gravity[3] = num_of(gravity);
    for (uint32_t i = 0; i < JOINTS; ++i) {
        snapshot.torque[i] = (i == 3u) ? held : ((snapshot.torque[i] > NUM(0)) ? NUM(-1) : NUM(1));
    }
    plausibility_step(&plausibility, &config.observer, JOINTS, 1u, &snapshot, &motion);
    return plausibility.fault;
}

static void test_a_torque_is_frozen_after_ten_snapshots_and_half_a_newton_metre(void) {
    for (int sign = -1; sign <= 1; sign += 2) {
        start_at(0.0, 0.0);
        for (int i = 0; i < 9; ++i) {
            TEST_ASSERT_EQUAL(0, hold(sign * 2.0));
        }
        TEST_ASSERT_EQUAL(GUARD_REASON_FROZEN, hold(sign * 0.5));
        TEST_ASSERT_EQUAL(3, plausibility.joint);
        TEST_ASSERT_EQUAL(0, hold(sign * 0.4999));
    }
}

static void test_a_torque_that_moves_by_one_step_starts_again(void) {
    start_at(0.0, 0.0);
    for (int i = 0; i < 9; ++i) {
        TEST_ASSERT_EQUAL(0, hold(0.0));
    }
    motion.gravity[3] = NUM(2); /* the gravity that the new reading is compared with */
    TEST_ASSERT_EQUAL(0, step(1u));
    for (int i = 0; i < 20; ++i) {
        TEST_ASSERT_EQUAL(0, hold(2.0));
    }
    TEST_ASSERT_EQUAL(GUARD_REASON_FROZEN, hold(1.5));
    TEST_ASSERT_EQUAL(0, step(1u)); /* it counts from zero again */
    for (int i = 0; i < 9; ++i) {
        TEST_ASSERT_EQUAL(0, hold(4.0));
    }
    TEST_ASSERT_EQUAL(GUARD_REASON_FROZEN, hold(4.0));
}

static void test_a_torque_may_stay_for_ever_while_the_arm_rests(void) {
    start_at(0.0, 0.0);
    for (int i = 0; i < 260; ++i) { /* a few more than the count holds */
        TEST_ASSERT_EQUAL(0, hold(0.4));
    }
    TEST_ASSERT_EQUAL(GUARD_REASON_FROZEN, hold(0.6));
}

static void test_a_restart_takes_the_gravity_of_its_own_snapshot(void) {
    setUp();
    motion.gravity[3] = NUM(5);
    TEST_ASSERT_EQUAL(0, step(0u));
    for (int i = 0; i < 20; ++i) {
        TEST_ASSERT_EQUAL(0, hold(5.0));
    }
    TEST_ASSERT_EQUAL(0, step(0u));
    for (int i = 0; i < 9; ++i) {
        TEST_ASSERT_EQUAL(0, hold(0.0));
    }
    TEST_ASSERT_EQUAL(GUARD_REASON_FROZEN, hold(0.0));
}

static void test_an_implausible_joint_is_named_before_a_frozen_one(void) {
    start_at(0.0, 0.0);
    for (int i = 0; i < 9; ++i) {
        TEST_ASSERT_EQUAL(0, hold(2.0));
    }
    move(1.0);
    TEST_ASSERT_EQUAL(GUARD_REASON_IMPLAUSIBLE, hold(2.0));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_joint_at_rest_may_jump_by_two_and_a_half_milliradians);
    RUN_TEST(test_a_joint_that_moves_may_be_late_by_its_velocity);
    RUN_TEST(test_a_velocity_that_changes_counts_by_its_mean);
    RUN_TEST(test_an_error_is_forgotten_as_the_observer_forgets);
    RUN_TEST(test_a_restart_of_the_observer_forgets_the_last_readings);
    RUN_TEST(test_the_first_of_several_joints_is_named);
    RUN_TEST(test_the_joint_behind_the_last_one_does_not_count);
    RUN_TEST(test_a_torque_is_frozen_after_ten_snapshots_and_half_a_newton_metre);
    RUN_TEST(test_a_torque_that_moves_by_one_step_starts_again);
    RUN_TEST(test_a_torque_may_stay_for_ever_while_the_arm_rests);
    RUN_TEST(test_a_restart_takes_the_gravity_of_its_own_snapshot);
    RUN_TEST(test_an_implausible_joint_is_named_before_a_frozen_one);
    RUN_TEST(test_the_first_snapshot_is_compared_with_nothing);
    RUN_TEST(test_the_first_and_the_eighth_joint_are_looked_at);
    return UNITY_END();
}
