#include "robot.h"

#include "core_fixture.h"
#include "robots.h"

static robot_t robot;

void setUp(void) {
    robot = planar_arm(&two_links, 2);
}
void tearDown(void) {}

static void test_the_shipped_tables_are_valid(void) {
    const robot_t *const shipped[] = {&robot_iiwa7, &robot_kinova3, &robot_ku_dex, &robot_panda, &robot_panda_bare};
    for (uint32_t i = 0; i < sizeof(shipped) / sizeof(shipped[0]); ++i) {
        TEST_ASSERT_TRUE(robot_is_valid(shipped[i]));
    }
}

static void test_only_one_to_eight_joints_are_valid(void) {
    for (uint32_t n = 0; n <= 40u; ++n) {
        robot_t other = planar_arm(&two_links, 1);
        for (uint32_t i = 1; (i < n) && (i < ROBOT_MAX_JOINTS); ++i) {
            other.joint[i] = other.joint[0];
        }
        other.joint_count = n;
        TEST_ASSERT_EQUAL((n >= 1u) && (n <= 8u), robot_is_valid(&other));
    }
    robot.joint_count = UINT32_MAX;
    TEST_ASSERT_FALSE(robot_is_valid(&robot));
}

static void test_entries_after_the_last_joint_are_not_valid(void) {
    TEST_ASSERT_TRUE(robot_is_valid(&robot));
    robot.joint[7].torque_max_nm = NUM(1);
    TEST_ASSERT_FALSE(robot_is_valid(&robot));
    robot.joint[7].torque_max_nm = NUM(0);
    robot.joint[2].offset.x = NUM(0.001);
    TEST_ASSERT_FALSE(robot_is_valid(&robot));
}

static void test_a_twist_that_is_not_of_unit_length_is_not_valid(void) {
    robot.joint[1].cos_twist = NUM(0.6);
    TEST_ASSERT_FALSE(robot_is_valid(&robot));
    robot.joint[1].sin_twist = NUM(-0.8);
    TEST_ASSERT_TRUE(robot_is_valid(&robot));
    robot.joint[1].sin_twist = NUM(-0.8001);
    TEST_ASSERT_FALSE(robot_is_valid(&robot));
    robot.joint[1].sin_twist = NUM(-0.7999);
    TEST_ASSERT_FALSE(robot_is_valid(&robot));
}

/* Found by proof_robot: in fixed point the sum of squares overflowed. */
static void test_entries_at_the_end_of_the_numbers_are_not_valid(void) {
    for (uint32_t row = 0; row < 3u; ++row) {
        robot_t other = robot;
        other.base[row][0] = NUM(511.9);
        other.base[row][1] = NUM(-511.9);
        other.base[row][2] = NUM(511.9);
        TEST_ASSERT_FALSE(robot_is_valid(&other));
    }
    robot.joint[1].cos_twist = NUM(511.9);
    robot.joint[1].sin_twist = NUM(511.9);
    TEST_ASSERT_FALSE(robot_is_valid(&robot));
}

static void test_a_base_row_that_is_not_of_unit_length_is_not_valid(void) {
    for (uint32_t row = 0; row < 3u; ++row) {
        robot_t other = robot;
        other.base[row][0] = NUM(0.5);
        TEST_ASSERT_FALSE(robot_is_valid(&other));
        other.base[row][0] = NUM(0);
        other.base[row][1] = NUM(0);
        other.base[row][2] = NUM(0);
        TEST_ASSERT_FALSE(robot_is_valid(&other));
    }
}

static void test_limits_out_of_order_are_not_valid(void) {
    robot_t other = robot;
    other.joint[0].position_min_rad = other.joint[0].position_max_rad;
    TEST_ASSERT_FALSE(robot_is_valid(&other));
    other = robot;
    other.joint[1].velocity_max_rad_s = NUM(0);
    TEST_ASSERT_FALSE(robot_is_valid(&other));
    other = robot;
    other.joint[1].torque_max_nm = NUM(-1);
    TEST_ASSERT_FALSE(robot_is_valid(&other));
}

/* Each number of the table that enters sums of products. */
static num_t *factor(robot_t *self, uint32_t which) {
    robot_joint_t *const joint = &self->joint[1];
    num_t *const factors[] = {&self->gravity.x,   &self->gravity.y,   &self->gravity.z,   &self->tip.x,
                              &self->tip.y,       &self->tip.z,       &joint->offset.x,   &joint->offset.y,
                              &joint->offset.z,   &joint->zero_rad,   &joint->moment_x,   &joint->moment_y,
                              &joint->inertia_xx, &joint->inertia_xy, &joint->inertia_xz, &joint->inertia_yz,
                              &joint->inertia_zz};
    return (which < sizeof(factors) / sizeof(factors[0])) ? factors[which] : NULL;
}

static void test_lengths_moments_and_inertias_stay_below_64(void) {
    uint32_t count = 0;
    for (robot_t other = robot; factor(&other, count) != NULL; other = robot) {
        const bool is_length = (count >= 3u) && (count <= 8u); /* of the tip and of an offset: of the reach, below 60 */
        *factor(&other, count) = NUM(63.9);
        TEST_ASSERT_EQUAL(!is_length, robot_is_valid(&other));
        *factor(&other, count) = NUM(55);
        TEST_ASSERT_TRUE(robot_is_valid(&other));
        *factor(&other, count) = NUM(64);
        TEST_ASSERT_FALSE(robot_is_valid(&other));
        *factor(&other, count) = NUM(-64);
        TEST_ASSERT_FALSE(robot_is_valid(&other));
        ++count;
    }
    TEST_ASSERT_EQUAL(17, count);
}

/* The two links reach 0.95 m. */
static void test_no_point_of_the_arm_is_60_m_away(void) {
    robot.tip.x = NUM(59.54);
    TEST_ASSERT_TRUE(robot_is_valid(&robot));
    robot.tip.x = NUM(59.56);
    TEST_ASSERT_FALSE(robot_is_valid(&robot));
    robot.tip.x = NUM(59.04);
    robot.joint[0].offset.z = NUM(-0.5);
    TEST_ASSERT_TRUE(robot_is_valid(&robot));
    robot.joint[0].offset.z = NUM(-0.52);
    TEST_ASSERT_FALSE(robot_is_valid(&robot));
}

/* In Q9.22 the sum of three such lengths is beyond 32 bits. */
static void test_lengths_at_the_end_of_the_numbers_are_not_valid(void) {
    const vec3_t far = {NUM(511.9), NUM(511.9), NUM(511.9)};
    robot_t other = robot;
    other.tip = far;
    TEST_ASSERT_FALSE(robot_is_valid(&other));
    robot.joint[0].offset = far;
    TEST_ASSERT_FALSE(robot_is_valid(&robot));
}

static void test_an_arm_without_joints_or_torque_is_not_valid(void) {
    robot_t other = robot;
    other.joint_count = 0u;
    memset(other.joint, 0, sizeof(other.joint));
    TEST_ASSERT_FALSE(robot_is_valid(&other));
    robot.joint[1].velocity_max_rad_s = NUM(0.5); /* a slow and weak joint is valid */
    robot.joint[1].torque_max_nm = NUM(0.5);
    TEST_ASSERT_TRUE(robot_is_valid(&robot));
    robot.joint[1].torque_max_nm = NUM(0);
    TEST_ASSERT_FALSE(robot_is_valid(&robot));
}

/* Values that are not numbers: NaN and infinity in float, the value without a negative in fixed point. */
static void test_values_that_are_not_numbers_are_not_valid(void) {
#ifdef TAUPERP_FIXED
    const num_t bad[] = {INT32_MIN};
#else
    const num_t bad[] = {NAN, -INFINITY};
#endif
    for (uint32_t b = 0; b < sizeof(bad) / sizeof(bad[0]); ++b) {
        for (uint32_t i = 0; i < 17u; ++i) {
            robot_t other = robot;
            *factor(&other, i) = bad[b];
            TEST_ASSERT_FALSE(robot_is_valid(&other));
        }
        num_t *const others[] = {&robot.base[2][2], &robot.joint[1].sin_twist, &robot.joint[0].position_max_rad,
                                 &robot.joint[0].velocity_max_rad_s};
        for (uint32_t i = 0; i < 4u; ++i) {
            const num_t good = *others[i];
            *others[i] = bad[b];
            TEST_ASSERT_FALSE(robot_is_valid(&robot));
            *others[i] = good;
        }
        TEST_ASSERT_TRUE(robot_is_valid(&robot));
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_shipped_tables_are_valid);
    RUN_TEST(test_only_one_to_eight_joints_are_valid);
    RUN_TEST(test_entries_after_the_last_joint_are_not_valid);
    RUN_TEST(test_a_twist_that_is_not_of_unit_length_is_not_valid);
    RUN_TEST(test_entries_at_the_end_of_the_numbers_are_not_valid);
    RUN_TEST(test_a_base_row_that_is_not_of_unit_length_is_not_valid);
    RUN_TEST(test_limits_out_of_order_are_not_valid);
    RUN_TEST(test_lengths_moments_and_inertias_stay_below_64);
    RUN_TEST(test_values_that_are_not_numbers_are_not_valid);
    RUN_TEST(test_no_point_of_the_arm_is_60_m_away);
    RUN_TEST(test_lengths_at_the_end_of_the_numbers_are_not_valid);
    RUN_TEST(test_an_arm_without_joints_or_torque_is_not_valid);
    return UNITY_END();
}
