/* The correction of a measured torque before any other use. */
#include "sensor.h"

#include "core_fixture.h"

#define JOINTS 7u

static sensor_config_t config;
static num_t velocity[ROBOT_MAX_JOINTS], torque[ROBOT_MAX_JOINTS], corrected[ROBOT_MAX_JOINTS];

void setUp(void) {
    memset(&config, 0, sizeof(config));
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        velocity[i] = NUM(0);
        torque[i] = num_from_int((int32_t)i - 3);
    }
}
void tearDown(void) {}

static void correct(void) {
    sensor_correct(&config, JOINTS, velocity, torque, corrected);
}

static void assert_near(double expected, num_t actual) {
    ASSERT_CLOSE(expected, value_of(actual), 1e-5);
}

static void test_zeros_leave_every_bit_of_the_torque(void) {
    velocity[2] = NUM(1.5);
    correct();
    TEST_ASSERT_EQUAL_MEMORY(torque, corrected, JOINTS * sizeof(num_t));
}

static void test_the_offset_is_subtracted(void) {
    config.offset_nm[1] = NUM(0.25);
    config.offset_nm[4] = NUM(-0.5);
    correct();
    assert_near(-2.25, corrected[1]);
    assert_near(1.5, corrected[4]);
}

static void test_friction_has_the_sign_of_the_velocity_and_fades_at_rest(void) {
    for (uint32_t i = 0; i < JOINTS; ++i) {
        config.friction_nm[i] = NUM(0.4);
        torque[i] = NUM(0);
    }
    velocity[0] = NUM(2);
    velocity[1] = NUM(-2);
    velocity[2] = NUM(0.5 * SENSOR_FULL_FRICTION_RAD_S);
    velocity[3] = NUM(0);
    correct();
    assert_near(-0.4, corrected[0]);
    assert_near(0.4, corrected[1]);
    assert_near(-0.2, corrected[2]);
    assert_near(0.0, corrected[3]);
}

static void test_a_torque_is_corrected_in_place(void) {
    config.offset_nm[0] = NUM(1);
    sensor_correct(&config, JOINTS, velocity, torque, torque);
    assert_near(-4.0, torque[0]);
}

static void test_settings_beyond_their_bounds_are_refused(void) {
    TEST_ASSERT_TRUE(sensor_config_is_valid(&config));
    config.friction_nm[7] = NUM(-0.1);
    TEST_ASSERT_FALSE(sensor_config_is_valid(&config));
    config.friction_nm[7] = NUM(64.5);
    TEST_ASSERT_FALSE(sensor_config_is_valid(&config));
    config.friction_nm[7] = NUM(64);
    config.offset_nm[0] = NUM(-64);
    TEST_ASSERT_TRUE(sensor_config_is_valid(&config));
    config.offset_nm[0] = NUM(-64.5);
    TEST_ASSERT_FALSE(sensor_config_is_valid(&config));
}

static void test_a_joint_that_the_arm_does_not_have_is_not_written(void) {
    corrected[JOINTS] = NUM(9);
    correct();
    TEST_ASSERT_TRUE(corrected[JOINTS] == NUM(9));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_zeros_leave_every_bit_of_the_torque);
    RUN_TEST(test_the_offset_is_subtracted);
    RUN_TEST(test_friction_has_the_sign_of_the_velocity_and_fades_at_rest);
    RUN_TEST(test_a_torque_is_corrected_in_place);
    RUN_TEST(test_settings_beyond_their_bounds_are_refused);
    RUN_TEST(test_a_joint_that_the_arm_does_not_have_is_not_written);
    return UNITY_END();
}
