/* The torque of a force at a point of a link, against double precision: arbitrary motion of eight joints. */
#include "lever.h"

#include "core_fixture.h"

static motion_t motion;
static lever_config_t shape;
static uint32_t saturations;

static vec3_t any(double size) {
    return (vec3_t){
        .x = num_of(size * random_one()), .y = num_of(size * random_one()), .z = num_of(size * random_one())};
}

void setUp(void) {
    random_start(45);
    saturations = 0;
    memset(&motion, 0, sizeof(motion));
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        for (uint32_t row = 0; row < 6u; ++row) {
            motion.jacobian[row][i] = num_of(random_one());
        }
        for (uint32_t axis = 0; axis < 3u; ++axis) {
            shape.middle[i][axis] = num_of(random_one());
        }
    }
    motion.link_x = any(1.0);
    motion.link_y = any(1.0);
    motion.link_z = any(1.0);
    motion.link_origin = any(2.0);
    motion.tip = any(2.0);
}
void tearDown(void) {
    TEST_ASSERT_EQUAL(0, saturations);
}

static double inner(vec3_t a, const num_t b[]) {
    return value_of(a.x) * value_of(b[0]) + value_of(a.y) * value_of(b[1]) + value_of(a.z) * value_of(b[2]);
}

static void test_the_arm_goes_from_the_tip_to_the_middle_of_the_link(void) {
    for (uint32_t link = 0; link < ROBOT_MAX_JOINTS; ++link) {
        motion.watched = link;
        TEST_ASSERT_EQUAL(link, lever_link(&motion));
        const vec3_t arm = lever_arm(&motion, &shape, &saturations);
        const num_t *const middle = shape.middle[link];
        ASSERT_CLOSE(value_of(motion.link_origin.x) + inner(motion.link_x, middle) - value_of(motion.tip.x),
                     value_of(arm.x), 2e-6);
        ASSERT_CLOSE(value_of(motion.link_origin.y) + inner(motion.link_y, middle) - value_of(motion.tip.y),
                     value_of(arm.y), 2e-6);
        ASSERT_CLOSE(value_of(motion.link_origin.z) + inner(motion.link_z, middle) - value_of(motion.tip.z),
                     value_of(arm.z), 2e-6);
    }
}

/* A flipped bit of the number must not read behind the table. */
static void test_a_link_that_does_not_exist_counts_as_the_first(void) {
    motion.watched = ROBOT_MAX_JOINTS;
    TEST_ASSERT_EQUAL(0, lever_link(&motion));
    motion.watched = UINT32_MAX;
    TEST_ASSERT_EQUAL(0, lever_link(&motion));
}

static void test_only_joints_up_to_the_link_carry_the_force(void) {
    for (uint32_t link = 0; link < ROBOT_MAX_JOINTS; ++link) {
        motion.watched = link;
        const vec3_t arm = any(1.0), force = any(3.0), moment = any(2.0);
        const double f[3] = {value_of(force.x), value_of(force.y), value_of(force.z)};
        const double a[3] = {value_of(arm.x), value_of(arm.y), value_of(arm.z)};
        const double m[3] = {value_of(moment.x) + a[1] * f[2] - a[2] * f[1],
                             value_of(moment.y) + a[2] * f[0] - a[0] * f[2],
                             value_of(moment.z) + a[0] * f[1] - a[1] * f[0]};
        num_t torque[ROBOT_MAX_JOINTS];
        for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
            torque[i] = NUM(99);
        }
        lever_torque(&motion, arm, force, moment, torque, &saturations);
        for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
            double expected = 0.0;
            for (uint32_t axis = 0; (i <= link) && (axis < 3u); ++axis) {
                expected +=
                    value_of(motion.jacobian[axis][i]) * f[axis] + value_of(motion.jacobian[3u + axis][i]) * m[axis];
            }
            ASSERT_CLOSE(expected, value_of(torque[i]), 1e-5);
        }
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_arm_goes_from_the_tip_to_the_middle_of_the_link);
    RUN_TEST(test_a_link_that_does_not_exist_counts_as_the_first);
    RUN_TEST(test_only_joints_up_to_the_link_carry_the_force);
    return UNITY_END();
}
