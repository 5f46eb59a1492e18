/* The steps of the search for the touched link, each against double precision. Intrusive: locate.c is included. */
#include "locate.h"

#define locate_init  included_locate_init
#define locate_begin included_locate_begin
#define locate_step  included_locate_step
#include "../../firmware/core/locate.c"

#include "core_fixture.h"

static locate_t state;
static observer_t observer;
static index_t explains;
static explained_t explained;
static lever_config_t shape;
static motion_t motion;
static uint32_t held;

void setUp(void) {
    held = 0;
    random_start(49);
    locate_init(&state);
    observer = (observer_t){.gain = NUM(0.5)};
    explains = (index_t){0};
    explained = (explained_t){0};
    memset(&motion, 0, sizeof(motion));
}
void tearDown(void) {}

static void test_the_logarithm_is_within_a_hundredth(void) {
    for (double x = 1.0; x < 511.0; x *= 1.01) {
        ASSERT_CLOSE(log(x), value_of(logarithm(num_of(x), &held)), 0.01);
    }
    TEST_ASSERT_TRUE(logarithm(NUM(0.5), &held) == NUM(0));
#ifndef TAUPERP_FIXED /* the largest number of Q9.22 is 512 */
    ASSERT_CLOSE(log(1000.0), value_of(logarithm(1000.0f, &held)), 0.01);
    ASSERT_CLOSE(log(1024.0), value_of(logarithm(1e6f, &held)), 0.01);
#endif
}

static const num_t alike[ROBOT_MAX_JOINTS] = {NUM(0.6), NUM(0.6), NUM(0.6), NUM(0.6), NUM(0.6), NUM(0.6), NUM(0.6)};

static bool step(uint32_t joints, bool calm) {
    return locate_step(&state, &shape, joints, &motion, &observer, &explains, &explained, calm);
}

static void test_a_search_begins_without_what_the_last_one_found(void) {
    memset(&state, 0x11, sizeof(state));
    state.before[3] = NUM(7);
    locate_begin(&state, 7u, 20u, alike);
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        TEST_ASSERT_TRUE((state.change[i] == NUM(0)) && (state.weight[i] == NUM(1)));
    }
    TEST_ASSERT_EQUAL(20u + 7u, state.steps);
    TEST_ASSERT_EQUAL(0, state.link);
    TEST_ASSERT_EQUAL(0, state.best_link);
    TEST_ASSERT_TRUE((state.best == NUM(511)) && (state.second == NUM(511)));
    TEST_ASSERT_TRUE((state.force_n.x == NUM(0)) && (state.force_n.y == NUM(0)) && (state.force_n.z == NUM(0)));
    TEST_ASSERT_TRUE(state.before[3] == NUM(7));
    ASSERT_CLOSE(0.05, value_of(state.part), 1e-6);
    ASSERT_CLOSE(0.15, value_of(state.sigma), 1e-6);
}

/* The largest threshold over the own one, up to 16. Without thresholds sigma is 0.05 Nm. */
static void test_the_weights_follow_the_thresholds(void) {
    static const double thresholds[2][5] = {{1.6, 0.4, 0.01, 0.0, 6.4}, {0.4, 0.01, 1.6, 0.0, 6.4}};
    static const double weights[2][5] = {{1.0, 4.0, 16.0, 16.0, 1.0}, {4.0, 16.0, 1.0, 16.0, 1.0}};
    for (uint32_t k = 0; k < 2u; ++k) {
        num_t threshold[ROBOT_MAX_JOINTS] = {NUM(0)};
        for (uint32_t i = 0; i < 5u; ++i) {
            threshold[i] = num_of(thresholds[k][i]); /* the fifth is of a joint that the arm does not have */
        }
        locate_begin(&state, 4u, 1u, threshold);
        for (uint32_t i = 0; i < 5u; ++i) {
            ASSERT_CLOSE(weights[k][i], value_of(state.weight[i]), 1e-3);
        }
        ASSERT_CLOSE(0.4, value_of(state.sigma), 1e-6);
    }
    static const num_t none[ROBOT_MAX_JOINTS] = {NUM(0)};
    locate_begin(&state, 4u, 1u, none);
    ASSERT_CLOSE(0.05, value_of(state.sigma), 1e-6);
}

/* Costs are over 16: a link is named if it leads by 2 and costs less than 60. */
static void test_a_link_is_named_if_it_leads_and_explains_the_change(void) {
    static const double best[] = {3.74, 3.74, 3.625, 3.75, 3.751};
    static const double lead[] = {0.1251, 0.1249, 0.125, 5.0, 5.0};
    for (uint32_t k = 0; k < 5u; ++k) {
        locate_begin(&state, 7u, 1u, alike);
        state.steps = 1u; /* the last one, without a change */
        state.best = num_of(best[k]);
        state.second = num_of(best[k] + lead[k]);
        state.best_link = 5u;
        TEST_ASSERT_TRUE(step(7u, false));
        TEST_ASSERT_EQUAL((k == 0u) ? 5 : 0, state.link);
    }
}

/* One value in each tick: r of seven joints, a pause, six coefficients. */
static void test_what_was_before_a_contact_is_followed_while_the_arm_is_calm(void) {
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        observer.residual[i] = num_of(0.8 + 0.08 * i);
    }
    for (uint32_t c = 0; c < SUBSPACE_MAX_COLUMNS; ++c) {
        explained.coefficient[c] = num_of(1.6 + 0.16 * c);
    }
    TEST_ASSERT_FALSE(step(7u, false));
    TEST_ASSERT_TRUE(state.before[0] == NUM(0));
    for (uint32_t round = 0; round < 14u; ++round) {
        TEST_ASSERT_FALSE(step(7u, true));
    }
    for (uint32_t i = 0; i < 7u; ++i) {
        ASSERT_CLOSE(0.1 + 0.01 * i, value_of(state.before[i]), 1e-5);
    }
    TEST_ASSERT_TRUE(state.before[7] == NUM(0));
    for (uint32_t c = 0; c < SUBSPACE_MAX_COLUMNS; ++c) {
        ASSERT_CLOSE(0.2 + 0.02 * c, value_of(state.load[c]), 1e-5);
    }
    explains.columns = 2u; /* what the coefficients explain is not of the rest */
    explains.column[0][0] = NUM(0.5);
    explains.column[1][0] = NUM(-0.25);
    const double rest = 0.8 - (0.5 * 0.2 - 0.25 * 0.22);
    TEST_ASSERT_FALSE(step(7u, true));
    ASSERT_CLOSE(0.1 + (rest - 0.1) / 8.0, value_of(state.before[0]), 1e-5);
}

/* The mean of y less what was before, where `update` is y times the gain. */
static void test_the_change_is_a_mean_beyond_what_was_before(void) {
    locate_begin(&state, 2u, 4u, alike);
    state.before[1] = NUM(3);
    state.load[0] = NUM(10);
    explains.columns = 1u;
    explains.column[0][1] = NUM(0.2);
    for (uint32_t k = 0; k < 4u; ++k) {
        observer.update[1] = num_of(0.5 * (5.0 + k));
        observer.update[2] = NUM(9); /* of a joint that the arm does not have */
        TEST_ASSERT_FALSE(step(2u, false));
    }
    ASSERT_CLOSE(0.0, value_of(state.change[0]), 1e-6);
    ASSERT_CLOSE(6.5 - 5.0, value_of(state.change[1]), 1e-5);
    TEST_ASSERT_TRUE(state.change[2] == NUM(0));
    TEST_ASSERT_EQUAL(2, state.steps);
}

/* Changes around sigma, 0.125 Nm. */
static void test_a_change_within_the_noise_tells_nothing(void) {
    static const num_t halves[ROBOT_MAX_JOINTS] = {NUM(0.5), NUM(0.5)};
    static const double change[] = {0.1249, 0.125, 0.1251};
    for (uint32_t k = 0; k < 3u; ++k) {
        locate_begin(&state, 2u, 1u, halves);
        state.steps = 2u;
        motion.watched = 0u;
        state.change[1] = num_of(change[k]);
        state.change[2] = NUM(50); /* of a joint that the arm does not have */
        TEST_ASSERT_FALSE(step(2u, false));
        TEST_ASSERT_EQUAL(k > 0u, state.best < NUM(511));
        TEST_ASSERT_EQUAL(1, motion.watched);
        TEST_ASSERT_TRUE(step(2u, false));
        TEST_ASSERT_EQUAL(0, motion.watched);
    }
}

static void draw(void) {
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        for (uint32_t row = 0; row < 6u; ++row) {
            motion.jacobian[row][i] = num_of(0.3 * random_one());
        }
        for (uint32_t axis = 0; axis < 3u; ++axis) {
            shape.middle[i][axis] = num_of(0.2 * random_one());
        }
        shape.half_m[i] = num_of(0.2 + 0.02 * i);
    }
    motion.link_x = (vec3_t){.x = NUM(0.6), .y = NUM(-0.8), .z = NUM(0)};
    motion.link_y = (vec3_t){.x = NUM(0.8), .y = NUM(0.6), .z = NUM(0)};
    motion.link_z = (vec3_t){.x = NUM(0), .y = NUM(0), .z = NUM(1)};
    motion.link_origin = (vec3_t){.x = NUM(0.1), .y = NUM(0.2), .z = NUM(-0.3)};
    motion.tip = (vec3_t){.x = NUM(0.5), .y = NUM(-0.2), .z = NUM(0.4)};
    motion.watched = 6u;
}

/* Forces along the axes, then moments of half a link about them. */
static void test_the_columns_of_a_link(void) {
    num_t column[COLUMNS][ROBOT_MAX_JOINTS];
    num_t expected[ROBOT_MAX_JOINTS];
    draw();
    locate_begin(&state, 7u, 1u, alike);
    state.weight[0] = NUM(4);
    state.weight[3] = NUM(2);
    make_columns(&motion, &shape, state.weight, column, &held);
    const vec3_t arm = lever_arm(&motion, &shape, &held);
    for (uint32_t c = 0; c < 6u; ++c) {
        const num_t size = (c < 3u) ? NUM(1) : shape.half_m[6];
        const vec3_t unit = {.x = ((c % 3u) == 0u) ? size : NUM(0),
                             .y = ((c % 3u) == 1u) ? size : NUM(0),
                             .z = ((c % 3u) == 2u) ? size : NUM(0)};
        const vec3_t none = {NUM(0), NUM(0), NUM(0)};
        lever_torque(&motion, arm, (c < 3u) ? unit : none, (c < 3u) ? none : unit, expected, &held);
        expected[0] = expected[0] * 4;
        expected[3] = expected[3] * 2;
        TEST_ASSERT_EQUAL_MEMORY(expected, column[c], sizeof(expected));
    }
}

/* Signed overflow would end the test: in fixed point the columns stay below 64, as the projector needs. */
static void test_a_link_of_a_long_arm_is_compared_without_overflow(void) {
    num_t column[COLUMNS][ROBOT_MAX_JOINTS];
    num_t change[ROBOT_MAX_JOINTS];
    draw();
    locate_begin(&state, 7u, 1u, alike);
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        change[i] = NUM(1);
        state.weight[i] = NUM(16);
        for (uint32_t row = 0; row < 3u; ++row) {
            motion.jacobian[row][i] = NUM(55);
        }
    }
    make_columns(&motion, &shape, state.weight, column, &held);
    TEST_ASSERT_TRUE(num_abs(column[0][0]) > NUM(63.9));
#ifdef TAUPERP_FIXED
    TEST_ASSERT_TRUE(num_abs(column[0][0]) < NUM(64));
#endif
    look(&state, &shape, &motion, change, NUM(1));
    TEST_ASSERT_EQUAL(7, state.best_link);
}

/* Cost of what the columns leave, and of how many they are; the force of the link with the lowest cost. */
static void test_the_cost_and_the_force_of_a_link(void) {
    num_t change[ROBOT_MAX_JOINTS];
    num_t rest[ROBOT_MAX_JOINTS];
    num_t column[COLUMNS][ROBOT_MAX_JOINTS];
    static const double size[] = {0.2, 0.9, 12.0, 40.0};
    for (uint32_t round = 0; round < 4u; ++round) {
        draw();
        for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
            change[i] = num_of(random_one());
        }
        change[2] = NUM(1);
        locate_begin(&state, 7u, 1u, alike);
        look(&state, &shape, &motion, change, num_of(size[round]));
        const num_t once = state.best;
        make_columns(&motion, &shape, state.weight, column, &held);
        soft_step(&state.soft, COLUMNS, (const num_t(*)[ROBOT_MAX_JOINTS])column, NUM(LOCATE_SOFT));
        soft_reject(&state.soft, change, rest, 0u, rest);
        double cost = 0.0;
        for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
            cost += value_of(change[i]) * value_of(rest[i]);
        }
        const double noises = fmin(size[round] / 0.15, 100.0);
        cost *= 0.5 * noises * noises / 16.0;
        for (uint32_t c = 0; c < COLUMNS; ++c) {
            cost += log(value_of(state.soft.triangle[c][c]) / LOCATE_SOFT) / 16.0;
        }
        ASSERT_CLOSE(cost, value_of(once), 0.03 + 6e-3 * cost);
        TEST_ASSERT_EQUAL(7, state.best_link);
        TEST_ASSERT_TRUE(state.second == NUM(511));
        const double found[3] = {value_of(state.force_n.x), value_of(state.force_n.y), value_of(state.force_n.z)};
        for (uint32_t axis = 0; axis < 3u; ++axis) {
            double force = 0.0;
            for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
                force -= value_of(column[axis][i]) * value_of(rest[i]); /* r balances the force */
            }
            force *= size[round] / (LOCATE_SOFT * LOCATE_SOFT);
            ASSERT_CLOSE(force, found[axis], 0.02 * fabs(force) + 0.02 * size[round]);
        }
        look(&state, &shape, &motion, change, num_of(size[round])); /* a second link of the same cost */
        TEST_ASSERT_TRUE((state.best == once) && (state.second == once));
    }
}

/* As many joints as the wire can carry: each one learns, has a change and is a candidate. */
static void test_an_arm_of_eight_joints_is_searched(void) {
    static const num_t threshold[ROBOT_MAX_JOINTS] = {NUM(0.6), NUM(0.6), NUM(0.6), NUM(0.6),
                                                      NUM(0.6), NUM(0.6), NUM(0.6), NUM(1.2)};
    draw();
    observer.residual[7] = NUM(8);
    for (uint32_t k = 0; k < ROBOT_MAX_JOINTS + SUBSPACE_MAX_COLUMNS; ++k) {
        TEST_ASSERT_FALSE(step(8u, true));
    }
    ASSERT_CLOSE(1.0, value_of(state.before[7]), 1e-6);
    locate_begin(&state, 8u, 2u, threshold);
    ASSERT_CLOSE(0.3, value_of(state.sigma), 1e-6);
    observer.update[7] = NUM(2.5);
    motion.watched = 0;
    for (uint32_t k = 0; k < 9u; ++k) {
        TEST_ASSERT_FALSE(step(8u, false));
        TEST_ASSERT_EQUAL(0, state.link);
    }
    ASSERT_CLOSE(4.0, value_of(state.change[7]), 1e-5);
    TEST_ASSERT_EQUAL(7, motion.watched);
    TEST_ASSERT_TRUE(step(8u, false));
    TEST_ASSERT_EQUAL(0, motion.watched);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_logarithm_is_within_a_hundredth);
    RUN_TEST(test_a_search_begins_without_what_the_last_one_found);
    RUN_TEST(test_the_weights_follow_the_thresholds);
    RUN_TEST(test_a_link_is_named_if_it_leads_and_explains_the_change);
    RUN_TEST(test_what_was_before_a_contact_is_followed_while_the_arm_is_calm);
    RUN_TEST(test_the_change_is_a_mean_beyond_what_was_before);
    RUN_TEST(test_a_change_within_the_noise_tells_nothing);
    RUN_TEST(test_the_columns_of_a_link);
    RUN_TEST(test_a_link_of_a_long_arm_is_compared_without_overflow);
    RUN_TEST(test_the_cost_and_the_force_of_a_link);
    RUN_TEST(test_an_arm_of_eight_joints_is_searched);
    return UNITY_END();
}
