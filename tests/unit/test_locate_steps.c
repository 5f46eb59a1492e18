/* The steps of the search for the touched link, each against double precision. Intrusive: locate.c is included. */
#include "locate.h"

#define locate_init  included_locate_init
#define locate_begin included_locate_begin
#define locate_step  included_locate_step
#include "../../firmware/core/locate.c"

#include "core_fixture.h"

static locate_t search;
static lever_config_t shape;
static motion_t motion;
static uint32_t held;

void setUp(void) {
    held = 0;
    random_start(49);
    locate_init(&search);
    memset(&motion, 0, sizeof(motion));
}
void tearDown(void) {}

static void test_the_logarithm_is_within_a_hundredth(void) {
    for (double x = 1.0; x < 511.0; x *= 1.01) {
        ASSERT_CLOSE(log(x), value_of(logarithm(num_of(x), &held)), 0.01);
    }
    TEST_ASSERT_TRUE(logarithm(NUM(0.5), &held) == NUM(0));
}

static void test_a_search_begins_without_what_the_last_one_found(void) {
    memset(&search, 0x11, sizeof(search));
    search.before[3] = NUM(7);
    locate_begin(&search, 7u);
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        TEST_ASSERT_TRUE((search.cost[i] == NUM(0)) && (search.largest[i] == NUM(0)));
    }
    TEST_ASSERT_EQUAL(3u * 7u, search.steps);
    TEST_ASSERT_EQUAL(0, search.link);
    TEST_ASSERT_TRUE((search.force_n.x == NUM(0)) && (search.force_n.y == NUM(0)) && (search.force_n.z == NUM(0)));
    TEST_ASSERT_TRUE(search.before[3] == NUM(7));
}

/* Costs are over 16: a link is named if it leads by 1 and costs less than 60. */
static void test_a_link_is_named_if_it_leads_and_explains_the_change(void) {
    for (uint32_t best = 0; best < 7u; ++best) {
        for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
            search.cost[i] = num_of((i == best) ? 3.74 : 3.74 + 0.0626);
            for (uint32_t axis = 0; axis < 3u; ++axis) {
                search.force[i][axis] = num_of(10.0 * i + axis + 1.0);
            }
        }
        search.cost[7] = NUM(0); /* of no link */
        decide(&search, 7u);
        TEST_ASSERT_EQUAL(best + 1u, search.link);
        ASSERT_CLOSE(-10.0 * best - 1.0, value_of(search.force_n.x), 1e-5);
        ASSERT_CLOSE(-10.0 * best - 2.0, value_of(search.force_n.y), 1e-5);
        ASSERT_CLOSE(-10.0 * best - 3.0, value_of(search.force_n.z), 1e-5);
        search.cost[(best + 3u) % 7u] = num_of(3.74 + 0.0624); /* too near */
        decide(&search, 7u);
        TEST_ASSERT_EQUAL(0, search.link);
        for (uint32_t i = 0; i < 7u; ++i) {
            search.cost[i] = (i == best) ? num_of(3.751) : NUM(10);
        }
        decide(&search, 7u);
        TEST_ASSERT_EQUAL(0, search.link);
    }
}

static void test_the_residual_before_a_contact_is_followed_while_the_arm_is_calm(void) {
    num_t residual[ROBOT_MAX_JOINTS];
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        residual[i] = num_of(12.8 + 1.28 * i);
    }
    TEST_ASSERT_FALSE(locate_step(&search, &shape, 7u, &motion, residual, false));
    TEST_ASSERT_TRUE(search.before[0] == NUM(0));
    TEST_ASSERT_FALSE(locate_step(&search, &shape, 7u, &motion, residual, true));
    for (uint32_t i = 0; i < 7u; ++i) {
        ASSERT_CLOSE(0.1 + 0.01 * i, value_of(search.before[i]), 1e-6);
    }
    TEST_ASSERT_TRUE(search.before[7] == NUM(0));
}

/* The same change of 0.149 Nm, and of 0.151 Nm, around a residual of 5 Nm before the contact. */
static void test_a_change_within_the_noise_tells_nothing(void) {
    num_t residual[ROBOT_MAX_JOINTS] = {NUM(0)};
    for (uint32_t above = 0; above < 2u; ++above) {
        locate_begin(&search, 2u);
        search.before[1] = NUM(5);
        motion.watched = 0u;
        residual[1] = num_of((above == 0u) ? 5.149 : 5.151);
        residual[2] = NUM(50); /* of a joint that the arm does not have */
        TEST_ASSERT_FALSE(locate_step(&search, &shape, 2u, &motion, residual, false));
        TEST_ASSERT_EQUAL(above == 1u, search.cost[0] > NUM(0));
        TEST_ASSERT_EQUAL(1, motion.watched);
        TEST_ASSERT_FALSE(locate_step(&search, &shape, 2u, &motion, residual, false));
        TEST_ASSERT_EQUAL(0, motion.watched);
        TEST_ASSERT_EQUAL(4, search.steps);
        for (uint32_t left = 4u; left > 0u; --left) {
            TEST_ASSERT_EQUAL(left == 1u, locate_step(&search, &shape, 2u, &motion, residual, false));
        }
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
    make_columns(&motion, &shape, column, &held);
    const vec3_t arm = lever_arm(&motion, &shape, &held);
    for (uint32_t c = 0; c < 6u; ++c) {
        const num_t size = (c < 3u) ? NUM(1) : shape.half_m[6];
        const vec3_t unit = {.x = ((c % 3u) == 0u) ? size : NUM(0),
                             .y = ((c % 3u) == 1u) ? size : NUM(0),
                             .z = ((c % 3u) == 2u) ? size : NUM(0)};
        const vec3_t none = {NUM(0), NUM(0), NUM(0)};
        lever_torque(&motion, arm, (c < 3u) ? unit : none, (c < 3u) ? none : unit, expected, &held);
        TEST_ASSERT_EQUAL_MEMORY(expected, column[c], sizeof(expected));
    }
}

/* Cost of what the columns leave, and of how many they are; the force by the largest change. */
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
        locate_begin(&search, 7u);
        look(&search, &shape, &motion, change, num_of(size[round]));
        const num_t once = search.cost[6];
        make_columns(&motion, &shape, column, &held);
        soft_step(&search.soft, COLUMNS, (const num_t(*)[ROBOT_MAX_JOINTS])column, NUM(LOCATE_SOFT));
        soft_reject(&search.soft, change, rest, 0u, rest);
        double cost = 0.0;
        for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
            cost += value_of(change[i]) * value_of(rest[i]);
        }
        const double noises = fmin(size[round] / 0.15, 100.0);
        cost *= 0.5 * noises * noises / 16.0;
        for (uint32_t c = 0; c < COLUMNS; ++c) {
            cost += log(value_of(search.soft.triangle[c][c]) / LOCATE_SOFT) / 16.0;
        }
        ASSERT_CLOSE(cost / 3.0, value_of(once), 0.01 + 2e-3 * cost);
        look(&search, &shape, &motion, change, num_of(0.5 * size[round])); /* smaller: its force is not taken */
        TEST_ASSERT_TRUE(search.cost[6] > once);
        for (uint32_t axis = 0; axis < 3u; ++axis) {
            double force = 0.0;
            for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
                force += value_of(column[axis][i]) * value_of(rest[i]);
            }
            force *= size[round] / (LOCATE_SOFT * LOCATE_SOFT);
            ASSERT_CLOSE(force, value_of(search.force[6][axis]), 0.02 * fabs(force) + 0.02 * size[round]);
        }
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_logarithm_is_within_a_hundredth);
    RUN_TEST(test_a_search_begins_without_what_the_last_one_found);
    RUN_TEST(test_a_link_is_named_if_it_leads_and_explains_the_change);
    RUN_TEST(test_the_residual_before_a_contact_is_followed_while_the_arm_is_calm);
    RUN_TEST(test_a_change_within_the_noise_tells_nothing);
    RUN_TEST(test_the_columns_of_a_link);
    RUN_TEST(test_the_cost_and_the_force_of_a_link);
    return UNITY_END();
}
