/* Raw signals and physical values: every raw number of each signal that the guard decides on, against raw / per_unit in
 * double, which is the factor of the DBC. */
#include "scale.h"

#include "core_fixture.h"
#include "protocol.h"

void setUp(void) {}
void tearDown(void) {}

static const scale_t scales[] = {PROTOCOL_JOINT_STATE_POSITION_SCALE, PROTOCOL_JOINT_STATE_VELOCITY_SCALE,
                                 PROTOCOL_JOINT_STATE_TORQUE_SCALE, PROTOCOL_TASK_COMMAND_ACCEL_X_SCALE};

static void test_every_raw_number_has_its_value(void) {
    for (uint32_t s = 0; s < sizeof(scales) / sizeof(scales[0]); ++s) {
        for (int32_t raw = -32768; raw <= 32767; raw += (SPARSER > 1) ? 31 : 1) {
            const double exact = (double)raw / scales[s].per_unit;
            if (fabs(exact) < 511.0) {
                ASSERT_CLOSE(exact, value_of(scale_to_num(raw, scales[s])), IF_FIXED(2.4e-7, 1.3e-7 * fabs(exact)));
            }
        }
    }
}

/* 3 and 5 times 2^-1 of a step. float32 has no such steps. */
static void test_half_a_step_is_rounded_away_from_zero(void) {
#ifdef TAUPERP_FIXED
    const scale_t half = {.multiplier = 1, .shift = 1u, .per_unit = 100};
    TEST_ASSERT_EQUAL_INT32(2, scale_to_num(3, half));
    TEST_ASSERT_EQUAL_INT32(3, scale_to_num(5, half));
    TEST_ASSERT_EQUAL_INT32(-2, scale_to_num(-3, half));
    TEST_ASSERT_EQUAL_INT32(-3, scale_to_num(-5, half));
    TEST_ASSERT_EQUAL_INT32(2, scale_to_num(4, half));
    TEST_ASSERT_EQUAL_INT32(0, scale_to_num(0, half));
#endif
}

static int32_t raw_of(double value) {
    return scale_to_raw(num_of(value), PROTOCOL_JOINT_STATE_TORQUE_SCALE, -3000, 2000);
}

static void test_a_value_is_the_nearest_raw_number(void) {
    const int32_t per_unit = ((scale_t)PROTOCOL_JOINT_STATE_TORQUE_SCALE).per_unit;
    const double step = 1.0 / per_unit;
    for (int32_t raw = -2999; raw < 2000; ++raw) {
        TEST_ASSERT_EQUAL(raw, raw_of(step * raw));
        TEST_ASSERT_EQUAL(raw, raw_of(step * (raw + 0.49)));
        TEST_ASSERT_EQUAL(raw, raw_of(step * (raw - 0.49)));
    }
}

static void test_half_a_raw_number_is_rounded_away_from_zero(void) {
    const scale_t tenth = {.per_unit = 4};
    TEST_ASSERT_EQUAL(3, scale_to_raw(NUM(0.625), tenth, -100, 100));
    TEST_ASSERT_EQUAL(2, scale_to_raw(NUM(0.375), tenth, -100, 100));
    TEST_ASSERT_EQUAL(-3, scale_to_raw(NUM(-0.625), tenth, -100, 100));
    TEST_ASSERT_EQUAL(-2, scale_to_raw(NUM(-0.375), tenth, -100, 100));
    TEST_ASSERT_EQUAL(0, scale_to_raw(NUM(0), tenth, -100, 100));
}

static void test_a_value_beyond_the_signal_is_its_end(void) {
    TEST_ASSERT_EQUAL(2000, raw_of(500.0));
    TEST_ASSERT_EQUAL(-3000, raw_of(-500.0));
#ifndef TAUPERP_FIXED
    TEST_ASSERT_EQUAL(2000, scale_to_raw(1.0f / 0.0f, PROTOCOL_JOINT_STATE_TORQUE_SCALE, -3000, 2000));
    TEST_ASSERT_EQUAL(-3000, scale_to_raw(0.0f / 0.0f, PROTOCOL_JOINT_STATE_TORQUE_SCALE, -3000, 2000));
#endif
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_every_raw_number_has_its_value);
    RUN_TEST(test_half_a_step_is_rounded_away_from_zero);
    RUN_TEST(test_a_value_is_the_nearest_raw_number);
    RUN_TEST(test_half_a_raw_number_is_rounded_away_from_zero);
    RUN_TEST(test_a_value_beyond_the_signal_is_its_end);
    return UNITY_END();
}
