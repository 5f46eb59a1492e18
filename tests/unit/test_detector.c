#include "detector.h"
#include "token.h"

#include "core_fixture.h"

#define JOINTS 7u

static detector_t detector;
static detector_config_t task;
static bank_t bank;
static num_t *const value = bank.channel[0].output;

void setUp(void) {
    detector_init(&detector);
    memset(&bank, 0, sizeof(bank));
    task = (detector_config_t){.channels = 1u, .debounce_ticks = 2};
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        task.threshold_nm[0][i] = NUM(2);
    }
}
void tearDown(void) {}

static void step(void) {
    detector_step(&detector, &task, JOINTS, &bank);
}

static void test_below_every_threshold_nothing_trips(void) {
    for (uint32_t i = 0; i < JOINTS; ++i) {
        value[i] = (i % 2u == 0u) ? NUM(2) : NUM(-2); /* a value at the threshold is not above it */
    }
    for (int k = 0; k < 1000; ++k) {
        step();
        TEST_ASSERT_FALSE(detector.tripped);
        TEST_ASSERT_FALSE(detector.any_above);
    }
}

static void test_without_any_torque_the_first_joint_is_reported(void) {
    step();
    TEST_ASSERT_EQUAL(0, detector.joint);
}

static void test_a_trip_takes_its_debounce_of_consecutive_ticks(void) {
    for (uint32_t debounce = 1; debounce <= 5u; ++debounce) {
        detector_init(&detector);
        task.debounce_ticks = debounce;
        value[3] = NUM(2.001);
        for (uint32_t tick = 1; tick <= 8u; ++tick) {
            step();
            TEST_ASSERT_EQUAL(tick >= debounce, detector.tripped);
            TEST_ASSERT_TRUE(detector.any_above);
        }
    }
}

static void test_one_tick_below_starts_the_count_again(void) {
    task.debounce_ticks = 3;
    for (int round = 0; round < 10; ++round) {
        value[0] = NUM(5);
        step();
        step();
        TEST_ASSERT_FALSE(detector.tripped);
        value[0] = NUM(1);
        step();
        TEST_ASSERT_FALSE(detector.any_above);
    }
    value[0] = NUM(5);
    step();
    step();
    step();
    TEST_ASSERT_TRUE(detector.tripped);
}

static void test_ticks_of_different_joints_do_not_add_up(void) {
    for (uint32_t k = 0; k < 100u; ++k) {
        memset(&bank, 0, sizeof(bank));
        value[k % 2u] = NUM(5);
        step();
        TEST_ASSERT_TRUE(detector.any_above);
        TEST_ASSERT_FALSE(detector.tripped);
    }
}

static void test_either_sign_trips_and_is_reported(void) {
    const double sizes[] = {3.5, -3.5};
    for (uint32_t s = 0; s < 2u; ++s) {
        detector_init(&detector);
        value[4] = num_of(sizes[s]);
        step();
        step();
        TEST_ASSERT_TRUE(detector.tripped);
        TEST_ASSERT_EQUAL(4, detector.joint);
        TEST_ASSERT_TRUE(detector.value_nm[detector.joint] == num_of(sizes[s]));
        TEST_ASSERT_TRUE(detector.threshold_nm[detector.joint] == NUM(2));
    }
}

static void test_the_joint_furthest_above_its_own_threshold_is_reported(void) {
    task.threshold_nm[0][1] = NUM(10);
    task.threshold_nm[0][5] = NUM(0.5);
    value[1] = NUM(15);   /* 1.5 times */
    value[2] = NUM(5);    /* 2.5 times */
    value[5] = NUM(-1.5); /* 3 times */
    step();
    TEST_ASSERT_EQUAL(5, detector.joint);
    TEST_ASSERT_TRUE(detector.value_nm[detector.joint] == NUM(-1.5));
    TEST_ASSERT_TRUE(detector.threshold_nm[detector.joint] == NUM(0.5));
    value[2] = NUM(6.5);
    step();
    TEST_ASSERT_EQUAL(2, detector.joint);
    value[1] = NUM(-60);
    step();
    TEST_ASSERT_EQUAL(1, detector.joint);
}

static void test_below_the_thresholds_the_joint_nearest_to_its_own_is_reported(void) {
    task.threshold_nm[0][6] = NUM(0.25);
    value[0] = NUM(1);
    value[6] = NUM(0.2);
    step();
    TEST_ASSERT_EQUAL(6, detector.joint);
    TEST_ASSERT_FALSE(detector.any_above);
}

static void test_the_count_continues_when_the_task_changes(void) {
    detector_config_t other = task;
    other.threshold_nm[0][2] = NUM(0.5);
    other.debounce_ticks = 4;
    value[2] = NUM(3);
    for (uint32_t tick = 1; tick <= 4u; ++tick) {
        detector_step(&detector, (tick == 1u) ? &task : &other, JOINTS, &bank);
        TEST_ASSERT_EQUAL(tick >= 4u, detector.tripped);
    }
    detector_step(&detector, &task, JOINTS, &bank);
    TEST_ASSERT_TRUE(detector.tripped);
}

static void test_joints_that_the_arm_does_not_have_are_ignored(void) {
    value[JOINTS] = NUM(400);
    step();
    step();
    TEST_ASSERT_FALSE(detector.any_above);
    TEST_ASSERT_FALSE(detector.tripped);
    detector_step(&detector, &task, JOINTS + 1u, &bank);
    TEST_ASSERT_TRUE(detector.any_above);
    TEST_ASSERT_EQUAL(7, detector.joint);
}

/* NaN and infinity; in fixed point the value without a negative, and the largest value. */
static void test_a_value_that_is_not_a_number_is_above_every_threshold(void) {
#ifdef TAUPERP_FIXED
    const num_t bad[] = {INT32_MIN, INT32_MAX, -INT32_MAX};
#else
    const num_t bad[] = {NAN, INFINITY, -INFINITY};
#endif
    for (uint32_t joint = 0; joint < JOINTS; ++joint) {
        for (uint32_t b = 0; b < 3u; ++b) {
            setUp();
            value[(joint + 1u) % JOINTS] = NUM(400);
            value[(joint + 3u) % JOINTS] = NUM(-500);
            value[joint] = bad[b];
            step();
            TEST_ASSERT_EQUAL(1, detector.above[joint]);
            TEST_ASSERT_EQUAL(joint, detector.joint);
            step();
            TEST_ASSERT_TRUE(detector.tripped);
        }
    }
}

static void test_the_count_saturates(void) {
    value[0] = NUM(3);
    detector.above[0] = UINT32_MAX - 1u;
    step();
    step();
    step();
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, detector.above[0]);
    TEST_ASSERT_TRUE(detector.tripped);
}

static void test_among_joints_above_the_one_with_the_full_count_is_reported(void) {
    task.debounce_ticks = 3;
    value[1] = NUM(2.5);
    step();
    step();
    value[5] = NUM(200); /* far above, for one tick */
    step();
    TEST_ASSERT_TRUE(detector.tripped);
    TEST_ASSERT_EQUAL(1, detector.joint);
}

static void test_any_watched_channel_counts_and_no_other(void) {
    task.channels = 0x5u;
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        task.threshold_nm[2][i] = NUM(0.5);
    }
    bank.channel[1].output[3] = NUM(100); /* not used by the task */
    step();
    step();
    TEST_ASSERT_FALSE(detector.any_above);
    value[3] = NUM(2.5);                   /* 1.25 times its threshold; channel 2 follows */
    bank.channel[2].output[3] = NUM(0.75); /* 1.5 times */
    step();
    TEST_ASSERT_FALSE(detector.tripped);
    value[3] = NUM(0);
    step();
    TEST_ASSERT_TRUE(detector.tripped);
    TEST_ASSERT_EQUAL(3, detector.joint);
    TEST_ASSERT_EQUAL(2, detector.channel[3]);
    TEST_ASSERT_TRUE(detector.value_nm[3] == NUM(0.75));
    TEST_ASSERT_TRUE(detector.threshold_nm[3] == NUM(0.5));
}

static void test_the_channel_nearest_to_its_threshold_is_reported_at_any_place(void) {
    task.channels = 0x5u;
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        task.threshold_nm[1][i] = NUM(1);
        task.threshold_nm[2][i] = NUM(1);
    }
    value[3] = NUM(1.5);
    bank.channel[1].output[3] = NUM(100); /* not used by the task */
    bank.channel[2].output[3] = NUM(0.25);
    step();
    TEST_ASSERT_EQUAL(0, detector.channel[3]);
    TEST_ASSERT_TRUE(detector.value_nm[3] == NUM(1.5));
}

static void test_among_joints_equally_far_above_the_first_is_reported(void) {
    value[1] = NUM(3);
    value[4] = NUM(3);
    step();
    step();
    TEST_ASSERT_TRUE(detector.tripped);
    TEST_ASSERT_EQUAL(1, detector.joint);
#ifndef TAUPERP_FIXED
    value[1] = NAN;
    value[4] = NAN;
    step();
    TEST_ASSERT_EQUAL(1, detector.joint);
#endif
}

static void test_all_four_channels_are_compared(void) {
    task.channels = 0x0Fu;
    for (uint32_t nearest = 0; nearest < BANK_MAX_CHANNELS; ++nearest) {
        for (uint32_t c = 0; c < BANK_MAX_CHANNELS; ++c) {
            task.threshold_nm[c][2] = num_of(2.0 + c);
            bank.channel[c].output[2] = num_of(((c == nearest) ? -0.75 : 0.5) * (2.0 + c));
        }
        step();
        TEST_ASSERT_EQUAL(nearest, detector.channel[2]);
        TEST_ASSERT_TRUE(detector.value_nm[2] == num_of(-0.75 * (2.0 + nearest)));
        TEST_ASSERT_TRUE(detector.threshold_nm[2] == num_of(2.0 + nearest));
    }
}

static void test_without_a_watched_channel_the_first_one_is_reported(void) {
    task.channels = 0u;
    for (uint32_t c = 0; c < BANK_MAX_CHANNELS; ++c) {
        task.threshold_nm[c][2] = num_of(2.0 + c);
        bank.channel[c].output[2] = num_of(1.0 - c);
    }
    step();
    TEST_ASSERT_EQUAL(0, detector.channel[2]);
    TEST_ASSERT_TRUE(detector.value_nm[2] == NUM(1));
    TEST_ASSERT_TRUE(detector.threshold_nm[2] == NUM(2));
}

static void test_the_token_is_that_of_the_bank_passed_on(void) {
    bank.token = 12345u;
    step();
    TEST_ASSERT_EQUAL_HEX32(token_next(12345u, TOKEN_DETECTOR, 0u), detector.token);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_below_every_threshold_nothing_trips);
    RUN_TEST(test_without_any_torque_the_first_joint_is_reported);
    RUN_TEST(test_a_trip_takes_its_debounce_of_consecutive_ticks);
    RUN_TEST(test_one_tick_below_starts_the_count_again);
    RUN_TEST(test_ticks_of_different_joints_do_not_add_up);
    RUN_TEST(test_either_sign_trips_and_is_reported);
    RUN_TEST(test_the_joint_furthest_above_its_own_threshold_is_reported);
    RUN_TEST(test_below_the_thresholds_the_joint_nearest_to_its_own_is_reported);
    RUN_TEST(test_the_count_continues_when_the_task_changes);
    RUN_TEST(test_joints_that_the_arm_does_not_have_are_ignored);
    RUN_TEST(test_a_value_that_is_not_a_number_is_above_every_threshold);
    RUN_TEST(test_the_count_saturates);
    RUN_TEST(test_among_joints_above_the_one_with_the_full_count_is_reported);
    RUN_TEST(test_any_watched_channel_counts_and_no_other);
    RUN_TEST(test_the_channel_nearest_to_its_threshold_is_reported_at_any_place);
    RUN_TEST(test_among_joints_equally_far_above_the_first_is_reported);
    RUN_TEST(test_all_four_channels_are_compared);
    RUN_TEST(test_without_a_watched_channel_the_first_one_is_reported);
    RUN_TEST(test_the_token_is_that_of_the_bank_passed_on);
    return UNITY_END();
}
