#include "motion.h"

#include "core_fixture.h"
#include "robots.h"

#define TIGHT 4e-6

static motion_t motion;
static num_t q[ROBOT_MAX_JOINTS], qd[ROBOT_MAX_JOINTS];

void setUp(void) {
    motion_init(&motion);
    memset(q, 0, sizeof(q));
    memset(qd, 0, sizeof(qd));
}
void tearDown(void) {}

static void set_state(uint32_t joints, double position, double velocity) {
    for (uint32_t i = 0; i < joints; ++i) {
        q[i] = num_of(position * random_one());
        qd[i] = num_of(velocity * random_one());
    }
}

static void test_a_pendulum_agrees_with_its_closed_form(void) {
    const links_t link = {.mass = {2.0}, .com = {0.3}, .inertia = {0.04}, .length = {0.6}};
    const robot_t robot = planar_arm(&link, 1);
    random_start(11);
    for (int i = 0; i < 1000; ++i) {
        set_state(1, 3.0, 5.0);
        motion_step(&motion, &robot, q, qd);
        const double angle = value_of(q[0]);
        ASSERT_CLOSE((0.04 + 2.0 * 0.09) * value_of(qd[0]), value_of(motion.momentum[0]), TIGHT);
        ASSERT_CLOSE(0.0, value_of(motion.coriolis[0]), TIGHT);
        ASSERT_CLOSE(2.0 * 0.3 * 9.81 * cos(angle), value_of(motion.gravity[0]), TIGHT);
        ASSERT_CLOSE(-0.6 * sin(angle), value_of(motion.jacobian[0][0]), TIGHT);
        ASSERT_CLOSE(0.0, value_of(motion.jacobian[1][0]), TIGHT);
        ASSERT_CLOSE(0.6 * cos(angle), value_of(motion.jacobian[2][0]), TIGHT);
        ASSERT_CLOSE(-1.0, value_of(motion.jacobian[4][0]), TIGHT);
    }
}

static void test_two_links_agree_with_their_closed_form(void) {
    const links_t *const l = &two_links;
    const robot_t robot = planar_arm(l, 2);
    const double far = l->inertia[1] + l->mass[1] * l->com[1] * l->com[1];
    const double near = l->inertia[0] + l->mass[0] * l->com[0] * l->com[0] + l->mass[1] * l->length[0] * l->length[0];
    const double coupling = l->mass[1] * l->length[0] * l->com[1];
    const double moment_near = l->mass[0] * l->com[0] + l->mass[1] * l->length[0];
    const double moment_far = l->mass[1] * l->com[1];
    random_start(12);
    for (int i = 0; i < 1000; ++i) {
        set_state(2, 3.0, 5.0);
        motion_step(&motion, &robot, q, qd);
        const double q1 = value_of(q[0]), q2 = value_of(q[1]), w1 = value_of(qd[0]), w2 = value_of(qd[1]);
        const double m12 = far + coupling * cos(q2);
        const double m11 = near + far + 2.0 * coupling * cos(q2);
        ASSERT_CLOSE(m11 * w1 + m12 * w2, value_of(motion.momentum[0]), 4.0 * TIGHT);
        ASSERT_CLOSE(m12 * w1 + far * w2, value_of(motion.momentum[1]), TIGHT);
        ASSERT_CLOSE(0.0, value_of(motion.coriolis[0]), 8.0 * TIGHT);
        ASSERT_CLOSE(-coupling * sin(q2) * w1 * (w1 + w2), value_of(motion.coriolis[1]), 8.0 * TIGHT);
        const double g2 = 9.81 * moment_far * cos(q1 + q2);
        ASSERT_CLOSE(9.81 * moment_near * cos(q1) + g2, value_of(motion.gravity[0]), 4.0 * TIGHT);
        ASSERT_CLOSE(g2, value_of(motion.gravity[1]), 2.0 * TIGHT);
        const double x2 = l->length[1] * cos(q1 + q2), z2 = l->length[1] * sin(q1 + q2);
        ASSERT_CLOSE(-l->length[0] * sin(q1) - z2, value_of(motion.jacobian[0][0]), TIGHT);
        ASSERT_CLOSE(l->length[0] * cos(q1) + x2, value_of(motion.jacobian[2][0]), TIGHT);
        ASSERT_CLOSE(-z2, value_of(motion.jacobian[0][1]), TIGHT);
        ASSERT_CLOSE(x2, value_of(motion.jacobian[2][1]), TIGHT);
    }
}

/* As one that differs from it by a micrometre: no other number means that there is no offset. */
static void test_an_offset_of_one_metre_along_any_axis_counts(void) {
    motion_t near;
    motion_init(&near);
    for (uint32_t axis = 0; axis < 3u; ++axis) {
        robot_t robot = planar_arm(&two_links, 2);
        num_t *const offset[] = {&robot.joint[1].offset.x, &robot.joint[1].offset.y, &robot.joint[1].offset.z};
        *offset[0] = NUM(0);
        *offset[axis] = NUM(1);
        set_state(2, 3.0, 5.0);
        motion_step(&motion, &robot, q, qd);
        *offset[axis] = NUM(1.000001);
        motion_step(&near, &robot, q, qd);
        for (uint32_t row = 0; row < 3u; ++row) {
            ASSERT_CLOSE(value_of(near.jacobian[row][0]), value_of(motion.jacobian[row][0]), 1e-5);
        }
        ASSERT_CLOSE(value_of(near.momentum[0]), value_of(motion.momentum[0]), 1e-3);
        ASSERT_CLOSE(value_of(near.tip.x), value_of(motion.tip.x), 1e-5);
        ASSERT_CLOSE(value_of(near.tip.y), value_of(motion.tip.y), 1e-5);
        ASSERT_CLOSE(value_of(near.tip.z), value_of(motion.tip.z), 1e-5);
    }
}

static void test_the_zero_of_a_joint_is_added_to_its_reading(void) {
    robot_t robot = planar_arm(&two_links, 2);
    q[0] = NUM(0.4);
    q[1] = NUM(-0.7);
    motion_step(&motion, &robot, q, qd);
    const motion_t plain = motion;
    robot.joint[0].zero_rad = NUM(1.5);
    robot.joint[1].zero_rad = NUM(-0.25);
    q[0] -= NUM(1.5);
    q[1] += NUM(0.25);
    motion_step(&motion, &robot, q, qd);
    for (uint32_t i = 0; i < 2u; ++i) {
        ASSERT_CLOSE(value_of(plain.gravity[i]), value_of(motion.gravity[i]), 4.0 * TIGHT);
    }
}

static double kinetic(const robot_t *robot, motion_t *scratch) {
    double energy = 0.0;
    motion_step(scratch, robot, q, qd);
    for (uint32_t i = 0; i < robot->joint_count; ++i) {
        energy += 0.5 * value_of(scratch->momentum[i]) * value_of(qd[i]);
    }
    return energy;
}

/* Checks each term against another one where no closed form is available: (C^T qd)_i = dT/dq_i. */
static void test_coriolis_is_the_slope_of_the_kinetic_energy(void) {
    const robot_t *const robot = &robot_ku_dex;
    const double step = 1e-2;
    motion_t scratch;
    motion_init(&scratch);
    random_start(13);
    for (int round = 0; round < 50; ++round) {
        set_state(7, 2.0, 1.5);
        motion_step(&motion, robot, q, qd);
        for (uint32_t i = 0; i < 7u; ++i) {
            const num_t here = q[i];
            q[i] = here + num_of(step);
            const double above = kinetic(robot, &scratch);
            q[i] = here - num_of(step);
            const double below = kinetic(robot, &scratch);
            q[i] = here;
            ASSERT_CLOSE((above - below) / (2.0 * step), value_of(motion.coriolis[i]), 3e-3);
        }
    }
}

static void test_the_mass_matrix_is_symmetric_and_positive(void) {
    random_start(14);
    for (int round = 0; round < 100; ++round) {
        double mass[7][7];
        set_state(7, 2.5, 0.0);
        for (uint32_t j = 0; j < 7u; ++j) {
            memset(qd, 0, sizeof(qd));
            qd[j] = NUM(1);
            motion_step(&motion, &robot_ku_dex, q, qd);
            for (uint32_t i = 0; i < 7u; ++i) {
                mass[i][j] = value_of(motion.momentum[i]);
            }
        }
        for (uint32_t i = 0; i < 7u; ++i) {
            TEST_ASSERT_TRUE(mass[i][i] > 0.0);
            for (uint32_t j = 0; j < i; ++j) {
                ASSERT_CLOSE(mass[i][j], mass[j][i], 2e-5);
                TEST_ASSERT_TRUE(mass[i][j] * mass[i][j] < mass[i][i] * mass[j][j]);
            }
        }
    }
}

/* A point mass at the tip has the gravity torque -Jv^T m g. The table of a longer last link must agree. */
static void test_the_jacobian_is_the_lever_of_a_weight_at_the_tip(void) {
    robot_t robot = planar_arm(&two_links, 2);
    robot_t loaded = robot;
    const double mass = 2.0;
    loaded.joint[1].moment_x += num_of(mass * two_links.length[1]);
    loaded.joint[0].moment_x += num_of(mass * two_links.length[0]);
    motion_t with;
    motion_init(&with);
    random_start(15);
    for (int round = 0; round < 100; ++round) {
        set_state(2, 3.0, 0.0);
        motion_step(&motion, &robot, q, qd);
        motion_step(&with, &loaded, q, qd);
        for (uint32_t i = 0; i < 2u; ++i) {
            const double weight = value_of(with.gravity[i]) - value_of(motion.gravity[i]);
            ASSERT_CLOSE(mass * 9.81 * value_of(motion.jacobian[2][i]), weight, 1e-4);
        }
    }
}

static void test_rows_after_the_last_joint_stay_zero(void) {
    const robot_t robot = planar_arm(&two_links, 2);
    random_start(16);
    set_state(8, 2.0, 2.0);
    motion_step(&motion, &robot, q, qd);
    for (uint32_t i = 2; i < ROBOT_MAX_JOINTS; ++i) {
        TEST_ASSERT_TRUE(motion.momentum[i] == NUM(0) && motion.coriolis[i] == NUM(0) && motion.gravity[i] == NUM(0));
        for (uint32_t row = 0; row < MOTION_TWIST_ROWS; ++row) {
            TEST_ASSERT_TRUE(motion.jacobian[row][i] == NUM(0));
        }
    }
}

static void test_at_rest_only_gravity_remains(void) {
    random_start(17);
    set_state(7, 2.0, 0.0);
    motion_step(&motion, &robot_panda, q, qd);
    for (uint32_t i = 0; i < 7u; ++i) {
        TEST_ASSERT_TRUE(motion.momentum[i] == NUM(0));
        TEST_ASSERT_TRUE(motion.coriolis[i] == NUM(0));
    }
    robot_t weightless = robot_panda;
    weightless.gravity = (vec3_t){NUM(0), NUM(0), NUM(0)};
    motion_step(&motion, &weightless, q, qd);
    for (uint32_t i = 0; i < 7u; ++i) {
        TEST_ASSERT_TRUE(motion.gravity[i] == NUM(0));
    }
}

/* Random bits in every input: the pass terminates, under the sanitizers. */
static void test_the_pass_terminates_for_any_bits(void) {
    robot_t robot = robot_ku_dex;
    robot.joint[2].zero_rad = NUM(1.5);
    robot.joint[4].zero_rad = NUM(-1.5);
    random_start(18);
    for (int round = 0; round < DRAWS(20000); ++round) {
        for (uint32_t i = 0; i < 8u; ++i) {
            uint32_t bits = (uint32_t)((random_one() + 1.0) * 2147483647.0);
            memcpy(&q[i], &bits, sizeof(bits));
            bits = (uint32_t)((random_one() + 1.0) * 2147483647.0);
            memcpy(&qd[i], &bits, sizeof(bits));
        }
        motion_step(&motion, &robot, q, qd);
    }
#ifdef TAUPERP_FIXED
    TEST_ASSERT_TRUE(motion.saturations > 0u);
#endif
}

static void test_nothing_saturates_within_the_limits(void) {
    const robot_t *const shipped[] = {&robot_iiwa7, &robot_kinova3, &robot_ku_dex, &robot_panda, &robot_panda_bare};
    random_start(19);
    for (uint32_t r = 0; r < 5u; ++r) {
        for (int round = 0; round < 2000; ++round) {
            for (uint32_t i = 0; i < shipped[r]->joint_count; ++i) {
                const robot_joint_t *const joint = &shipped[r]->joint[i];
                q[i] = num_of(random_in(value_of(joint->position_min_rad), value_of(joint->position_max_rad)));
                qd[i] = (random_one() > 0.0) ? joint->velocity_max_rad_s : -joint->velocity_max_rad_s;
            }
            motion_step(&motion, shipped[r], q, qd);
        }
    }
    TEST_ASSERT_EQUAL(0, motion.saturations);
}

/* An arm on a tilted base, in a gravity of three components, is the arm on a level base in a turned gravity. */
static void test_a_tilted_base_turns_gravity_and_jacobian(void) {
    static const double base[3][3] = {
        {2.0 / 3, -1.0 / 3, 2.0 / 3}, {2.0 / 3, 2.0 / 3, -1.0 / 3}, {-1.0 / 3, 2.0 / 3, 2.0 / 3}};
    static const double gravity[3] = {3.0, -5.0, -7.5};
    robot_t level = robot_ku_dex;
    robot_t tilted = robot_ku_dex;
    double turned[3] = {0.0};
    for (uint32_t row = 0; row < 3u; ++row) {
        for (uint32_t i = 0; i < 3u; ++i) {
            level.base[row][i] = (row == i) ? NUM(1) : NUM(0);
            tilted.base[row][i] = num_of(base[row][i]);
            turned[i] += base[row][i] * gravity[row];
        }
    }
    level.gravity = (vec3_t){.x = num_of(turned[0]), .y = num_of(turned[1]), .z = num_of(turned[2])};
    tilted.gravity = (vec3_t){.x = num_of(gravity[0]), .y = num_of(gravity[1]), .z = num_of(gravity[2])};
    motion_t reference;
    motion_init(&reference);
    random_start(20);
    for (int round = 0; round < 20; ++round) {
        set_state(7, 2.5, 1.0);
        motion_step(&motion, &tilted, q, qd);
        motion_step(&reference, &level, q, qd);
        for (uint32_t i = 0; i < 7u; ++i) {
            ASSERT_CLOSE(value_of(reference.gravity[i]), value_of(motion.gravity[i]), 16.0 * TIGHT);
            ASSERT_CLOSE(value_of(reference.momentum[i]), value_of(motion.momentum[i]), 16.0 * TIGHT);
            for (uint32_t row = 0; row < MOTION_TWIST_ROWS; ++row) {
                const double *const axis = base[row % 3u];
                double expected = 0.0;
                for (uint32_t k = 0; k < 3u; ++k) {
                    expected += axis[k] * value_of(reference.jacobian[(row / 3u) * 3u + k][i]);
                }
                ASSERT_CLOSE(expected, value_of(motion.jacobian[row][i]), 4.0 * TIGHT);
            }
        }
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_pendulum_agrees_with_its_closed_form);
    RUN_TEST(test_two_links_agree_with_their_closed_form);
    RUN_TEST(test_an_offset_of_one_metre_along_any_axis_counts);
    RUN_TEST(test_the_zero_of_a_joint_is_added_to_its_reading);
    RUN_TEST(test_coriolis_is_the_slope_of_the_kinetic_energy);
    RUN_TEST(test_the_mass_matrix_is_symmetric_and_positive);
    RUN_TEST(test_the_jacobian_is_the_lever_of_a_weight_at_the_tip);
    RUN_TEST(test_rows_after_the_last_joint_stay_zero);
    RUN_TEST(test_at_rest_only_gravity_remains);
    RUN_TEST(test_the_pass_terminates_for_any_bits);
    RUN_TEST(test_nothing_saturates_within_the_limits);
    RUN_TEST(test_a_tilted_base_turns_gravity_and_jacobian);
    return UNITY_END();
}
