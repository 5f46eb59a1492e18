#include "observer.h"

#include "core_fixture.h"

#define GAIN     50.0  /* 1/s */
#define PERIOD   0.001 /* s */
#define ACCURATE 2e-5  /* of 7 Nm, in either numeric */

static observer_t observer;
static motion_t motion;
static num_t torque[ROBOT_MAX_JOINTS];

void setUp(void) {
    observer_init(&observer);
    motion_init(&motion);
    memset(torque, 0, sizeof(torque));
}
void tearDown(void) {
    TEST_ASSERT_EQUAL(0, observer.saturations);
}

static observer_config_t constants(double gain, double period, torque_sample_t sample) {
    observer_config_t config = {.torque_sample = (uint32_t)sample};
    for (uint32_t g = 0; g < OBSERVER_MAX_GAP; ++g) {
        const double span = period * (double)(g + 1u);
        config.decay[g] = num_of(exp(-gain * span));
        config.gain[g] = num_of(-expm1(-gain * span));
        config.momentum_gain[g] = num_of(-expm1(-gain * span) / span);
    }
    return config;
}

/* One joint's signals at time t s, all linear, so that means over an interval are exact. */
typedef struct {
    double momentum, momentum_slope, drift, drift_slope, torque, torque_slope;
} signals_t;

static void sample(const signals_t *s, double time, double torque_time) {
    motion.momentum[0] = num_of(s->momentum + s->momentum_slope * time);
    motion.coriolis[0] = num_of(0.25 * (s->drift + s->drift_slope * time));
    motion.gravity[0] = num_of(-0.75 * (s->drift + s->drift_slope * time));
    torque[0] = num_of(s->torque + s->torque_slope * torque_time);
}

static void test_the_first_sample_only_sets_the_initial_momentum(void) {
    const observer_config_t config = constants(GAIN, PERIOD, TORQUE_INTERVAL);
    const signals_t still = {.momentum = 30.0};
    sample(&still, 0.0, 0.0);
    torque[0] = NUM(80);
    observer_step(&observer, &config, 7, &motion, torque, 1);
    TEST_ASSERT_TRUE(observer.started);
    TEST_ASSERT_TRUE(observer.residual[0] == NUM(0));
    torque[0] = NUM(0);
    for (int k = 0; k < 100; ++k) {
        observer_step(&observer, &config, 7, &motion, torque, 1);
        TEST_ASSERT_TRUE(observer.residual[0] == NUM(0)); /* a constant momentum of any size is no torque */
    }
}

static void test_a_constant_torque_appears_as_the_first_order_lag_of_the_closed_form(void) {
    const observer_config_t config = constants(GAIN, PERIOD, TORQUE_INTERVAL);
    observer_step(&observer, &config, 1, &motion, torque, 1);
    torque[0] = NUM(-7.5);
    for (int k = 1; k <= 500; ++k) {
        observer_step(&observer, &config, 1, &motion, torque, 1);
        ASSERT_CLOSE(-7.5 * (1.0 - exp(-GAIN * PERIOD * k)), value_of(observer.residual[0]), ACCURATE);
        ASSERT_CLOSE(exp(-GAIN * PERIOD), value_of(observer.decay), 1e-6);
    }
}

static void test_a_torque_that_accelerates_the_arm_is_not_external(void) {
    const observer_config_t config = constants(GAIN, PERIOD, TORQUE_INTERVAL);
    const signals_t s = {.momentum = -4.0, .momentum_slope = 20.0, .drift = -3.0, .torque = 23.0};
    for (int k = 0; k < 200; ++k) {
        sample(&s, k * PERIOD, 0.0); /* tau + drift = dp/dt */
        observer_step(&observer, &config, 1, &motion, torque, 1);
        ASSERT_CLOSE(0.0, value_of(observer.residual[0]), 1e-3); /* 2^-22 of p over T */
    }
}

static void test_coriolis_counts_with_the_torque_and_gravity_against_it(void) {
    const observer_config_t config = constants(GAIN, PERIOD, TORQUE_INTERVAL);
    motion.coriolis[0] = NUM(3);
    motion.gravity[1] = NUM(3);
    observer_step(&observer, &config, 2, &motion, torque, 1);
    observer_step(&observer, &config, 2, &motion, torque, 1);
    ASSERT_CLOSE(3.0 * -expm1(-GAIN * PERIOD), value_of(observer.residual[0]), ACCURATE);
    ASSERT_CLOSE(-3.0 * -expm1(-GAIN * PERIOD), value_of(observer.residual[1]), ACCURATE);
}

static void test_the_drift_of_both_ends_is_averaged(void) {
    const observer_config_t config = constants(GAIN, PERIOD, TORQUE_INTERVAL);
    motion.gravity[0] = NUM(10);
    observer_step(&observer, &config, 1, &motion, torque, 1);
    motion.gravity[0] = NUM(20);
    observer_step(&observer, &config, 1, &motion, torque, 1);
    ASSERT_CLOSE(-15.0 * -expm1(-GAIN * PERIOD), value_of(observer.residual[0]), ACCURATE);
}

static void test_a_mean_torque_is_used_unchanged_and_an_instant_one_is_averaged(void) {
    const torque_sample_t kinds[] = {TORQUE_INTERVAL, TORQUE_INSTANT};
    const double expected[] = {10.0, 6.0};
    for (uint32_t kind = 0; kind < 2u; ++kind) {
        const observer_config_t config = constants(GAIN, PERIOD, kinds[kind]);
        observer_init(&observer);
        torque[0] = NUM(2);
        observer_step(&observer, &config, 1, &motion, torque, 1);
        torque[0] = NUM(10);
        observer_step(&observer, &config, 1, &motion, torque, 1);
        ASSERT_CLOSE(expected[kind] * -expm1(-GAIN * PERIOD), value_of(observer.residual[0]), ACCURATE);
    }
}

static void test_a_gap_is_one_step_of_the_longer_period(void) {
    const observer_config_t config = constants(GAIN, PERIOD, TORQUE_INSTANT);
    random_start(21);
    for (uint32_t gap = 1; gap <= OBSERVER_MAX_GAP; ++gap) {
        const observer_config_t slow = constants(GAIN, PERIOD * gap, TORQUE_INSTANT);
        observer_t other;
        observer_init(&observer);
        observer_init(&other);
        for (int k = 0; k < 300; ++k) {
            motion.momentum[0] = num_of(0.02 * random_one());
            motion.coriolis[0] = num_of(5.0 * random_one());
            motion.gravity[0] = num_of(30.0 * random_one());
            torque[0] = num_of(40.0 * random_one());
            observer_step(&observer, &config, 1, &motion, torque, gap);
            observer_step(&other, &slow, 1, &motion, torque, 1);
            TEST_ASSERT_TRUE(observer.residual[0] == other.residual[0]);
            TEST_ASSERT_TRUE(observer.decay == other.decay);
        }
    }
}

/* The mean of a ramp over the whole gap, from samples that are means over one cycle each. */
static void test_a_gap_between_mean_torques_causes_no_error_for_a_steady_change(void) {
    const observer_config_t config = constants(GAIN, PERIOD, TORQUE_INTERVAL);
    const signals_t s = {.torque = 5.0, .torque_slope = 4000.0};
    for (uint32_t gap = 1; gap <= OBSERVER_MAX_GAP; ++gap) {
        observer_init(&observer);
        sample(&s, 0.0, -0.5 * PERIOD);
        observer_step(&observer, &config, 1, &motion, torque, 1);
        sample(&s, 0.0, (gap - 0.5) * PERIOD);
        observer_step(&observer, &config, 1, &motion, torque, gap);
        const double mean = 5.0 + 4000.0 * 0.5 * gap * PERIOD;
        ASSERT_CLOSE(mean * -expm1(-GAIN * PERIOD * gap), value_of(observer.residual[0]), ACCURATE);
    }
}

static void test_cycles_lost_while_the_torque_is_constant_change_nothing(void) {
    const observer_config_t config = constants(GAIN, PERIOD, TORQUE_INTERVAL);
    const signals_t s = {.momentum = 2.0, .momentum_slope = 1.5, .torque = 12.0};
    uint32_t cycle = 0;
    sample(&s, 0.0, 0.0);
    observer_step(&observer, &config, 1, &motion, torque, 1);
    random_start(22);
    while (cycle < 400u) {
        const uint32_t gap = 1u + (uint32_t)(2.0 * (random_one() + 1.0)) % OBSERVER_MAX_GAP;
        cycle += gap;
        sample(&s, cycle * PERIOD, 0.0);
        observer_step(&observer, &config, 1, &motion, torque, gap);
        ASSERT_CLOSE(10.5 * (1.0 - exp(-GAIN * PERIOD * cycle)), value_of(observer.residual[0]), 5e-4);
    }
}

static void test_a_gap_too_long_to_bridge_restarts_the_observer(void) {
    const observer_config_t config = constants(GAIN, PERIOD, TORQUE_INTERVAL);
    const uint32_t gaps[] = {0, OBSERVER_MAX_GAP + 1u, UINT32_MAX};
    for (uint32_t i = 0; i < 3u; ++i) {
        torque[0] = NUM(9);
        for (int k = 0; k < 50; ++k) {
            observer_step(&observer, &config, 1, &motion, torque, 1);
        }
        TEST_ASSERT_TRUE(observer.residual[0] > NUM(5));
        motion.momentum[0] += NUM(20); /* any change in the meantime */
        observer_step(&observer, &config, 1, &motion, torque, gaps[i]);
        TEST_ASSERT_TRUE(observer.residual[0] == NUM(0));
        TEST_ASSERT_TRUE(observer.update[0] == NUM(0));
        TEST_ASSERT_TRUE(observer.decay == NUM(0));
        observer_step(&observer, &config, 1, &motion, torque, 1);
        ASSERT_CLOSE(9.0 * -expm1(-GAIN * PERIOD), value_of(observer.residual[0]), ACCURATE);
    }
}

static void test_joints_that_the_arm_does_not_have_stay_zero(void) {
    const observer_config_t config = constants(GAIN, PERIOD, TORQUE_INTERVAL);
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        torque[i] = num_of(1.0 + i);
    }
    for (int k = 0; k < 10; ++k) {
        observer_step(&observer, &config, 3, &motion, torque, 1);
    }
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        const double expected = (i < 3u) ? (1.0 + i) * (1.0 - exp(-GAIN * PERIOD * 9.0)) : 0.0;
        ASSERT_CLOSE(expected, value_of(observer.residual[i]), ACCURATE);
    }
}

static void test_the_largest_torques_of_the_wire_do_not_overflow(void) {
    const observer_config_t config = constants(GAIN, PERIOD, TORQUE_INSTANT);
    torque[0] = NUM(327.67);
    motion.coriolis[0] = NUM(100);
    motion.gravity[0] = NUM(-80);
    for (int k = 0; k < 1000; ++k) {
        observer_step(&observer, &config, 1, &motion, torque, 1);
    }
    ASSERT_CLOSE(507.67, value_of(observer.residual[0]), 1e-3);
}

static void test_a_start_keeps_the_samples_of_its_joints_and_bridges_nothing(void) {
    const observer_config_t config = constants(GAIN, PERIOD, TORQUE_INTERVAL);
    motion.momentum[0] = NUM(3);
    motion.momentum[7] = NUM(5);
    observer_step(&observer, &config, 7, &motion, torque, 1);
    TEST_ASSERT_TRUE(observer.momentum[0] == NUM(3));
    TEST_ASSERT_TRUE(observer.momentum[7] == NUM(0));
    TEST_ASSERT_TRUE(observer.decay == NUM(0));
    TEST_ASSERT_TRUE(observer.gain == NUM(1));
    TEST_ASSERT_EQUAL_UINT32(0u, observer.gap);
}

static void test_the_update_is_the_residual_without_its_past(void) {
    const observer_config_t config = constants(GAIN, PERIOD, TORQUE_INTERVAL);
    observer_step(&observer, &config, 7, &motion, torque, 1);
    motion.momentum[0] = NUM(0.01);
    torque[0] = NUM(4);
    observer_step(&observer, &config, 7, &motion, torque, 1);
    TEST_ASSERT_TRUE(observer.update[0] == observer.residual[0]);
    TEST_ASSERT_FALSE(observer.update[0] == NUM(0));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_first_sample_only_sets_the_initial_momentum);
    RUN_TEST(test_a_constant_torque_appears_as_the_first_order_lag_of_the_closed_form);
    RUN_TEST(test_a_torque_that_accelerates_the_arm_is_not_external);
    RUN_TEST(test_coriolis_counts_with_the_torque_and_gravity_against_it);
    RUN_TEST(test_the_drift_of_both_ends_is_averaged);
    RUN_TEST(test_a_mean_torque_is_used_unchanged_and_an_instant_one_is_averaged);
    RUN_TEST(test_a_gap_is_one_step_of_the_longer_period);
    RUN_TEST(test_a_gap_between_mean_torques_causes_no_error_for_a_steady_change);
    RUN_TEST(test_cycles_lost_while_the_torque_is_constant_change_nothing);
    RUN_TEST(test_a_gap_too_long_to_bridge_restarts_the_observer);
    RUN_TEST(test_joints_that_the_arm_does_not_have_stay_zero);
    RUN_TEST(test_the_largest_torques_of_the_wire_do_not_overflow);
    RUN_TEST(test_a_start_keeps_the_samples_of_its_joints_and_bridges_nothing);
    RUN_TEST(test_the_update_is_the_residual_without_its_past);
    return UNITY_END();
}
