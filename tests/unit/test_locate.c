/* The touched link and its force: torques of known forces on a known link. */
#include "locate.h"

#include "core_fixture.h"
#include "robots.h"
#include "vec3.h"

#define N     7u
#define TICKS 20u

static const robot_t *robot;
static motion_t motion;
static locate_t locate;
static lever_config_t shape;
static num_t pose[ROBOT_MAX_JOINTS];
static num_t residual[ROBOT_MAX_JOINTS];
static num_t threshold[ROBOT_MAX_JOINTS];
static observer_t observer;
static index_t explains;
static explained_t explained;

/* Of ku_dex, as the configuration block has them. */
static const double middle[N][3] = {{0.0, 0.0, -0.045}, {0.0, -0.09, 0.0},  {0.0, 0.0, 0.28}, {0.0, -0.085, 0.0},
                                    {0.0, 0.0, 0.26},   {0.0, -0.035, 0.0}, {0.0, 0.0, 0.125}};
static const double half_m[N] = {0.053, 0.06, 0.054, 0.054, 0.045, 0.035, 0.03};

void setUp(void) {
    const double q[N] = {0.3, 0.8, -0.4, -1.3, 0.6, 0.9, 0.2};
    robot = &robot_ku_dex;
    motion_init(&motion);
    locate_init(&locate);
    shape = (lever_config_t){0};
    observer = (observer_t){0};
    explains = (index_t){0};
    explained = (explained_t){0};
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        pose[i] = (i < N) ? num_of(q[i]) : NUM(0);
        residual[i] = NUM(0);
        threshold[i] = NUM(0.3);
        for (uint32_t a = 0; (i < N) && (a < 3u); ++a) {
            shape.middle[i][a] = num_of(middle[i][a]);
        }
        shape.half_m[i] = (i < N) ? num_of(half_m[i]) : NUM(0);
    }
}
void tearDown(void) {}

/* With y = r, as after a long time. */
static bool locate_now(bool calm) {
    observer.gain = NUM(0.0625);
    for (uint32_t i = 0; i < N; ++i) {
        observer.residual[i] = residual[i];
        observer.update[i] = residual[i] / 16;
    }
    return locate_step(&locate, &shape, N, &motion, &observer, &explains, &explained, calm);
}

static bool step(bool calm) {
    const num_t still[ROBOT_MAX_JOINTS] = {NUM(0)};
    motion_step(&motion, robot, pose, still);
    return locate_now(calm);
}

/* The search to its end. Returns the ticks that it took. */
static uint32_t search(void) {
    locate_begin(&locate, N, TICKS, threshold);
    uint32_t ticks = 1;
    while (!step(false) && (ticks < 1000u)) {
        TEST_ASSERT_EQUAL(0, locate.link); /* not known before the end */
        ++ticks;
    }
    return ticks;
}

static vec3_t vec3_of(const double v[3]) {
    return (vec3_t){.x = num_of(v[0]), .y = num_of(v[1]), .z = num_of(v[2])};
}

/* Adds to r that of a force on the robot, `beside` the middle of a link. */
static void push(uint32_t link, const double beside[3], const double force[3]) {
    const num_t still[ROBOT_MAX_JOINTS] = {NUM(0)};
    const double balanced[3] = {-force[0], -force[1], -force[2]};
    const vec3_t f = vec3_of(balanced);
    num_t torque[ROBOT_MAX_JOINTS];
    uint32_t held = 0;
    motion.watched = link;
    motion_step(&motion, robot, pose, still);
    lever_torque(&motion, lever_arm(&motion, &shape, &held), f, vec3_cross(vec3_of(beside), f, &held), torque, &held);
    for (uint32_t i = 0; i < N; ++i) {
        residual[i] = residual[i] + torque[i];
    }
}

static const double side[3] = {0.03, 0.04, 0.0};
static const double blow[3] = {30.0, -20.0, 25.0};
static const double weight[3] = {0.0, 0.0, -30.0};

static double error_of(const double force[3]) {
    return sqrt(pow(value_of(locate.force_n.x) - force[0], 2.0) + pow(value_of(locate.force_n.y) - force[1], 2.0) +
                pow(value_of(locate.force_n.z) - force[2], 2.0));
}

/* Neighbours share a place where their joints meet, so that some pushes are on both. */
static void test_a_push_is_located_on_its_link_with_its_force(void) {
    static const double beside[4][3] = {{0.05, 0, 0}, {-0.03, 0.04, 0}, {0, -0.03, 0.04}, {0.02, 0.03, -0.03}};
    static const double force[4][3] = {{30, -20, 25}, {-20, 35, 10}, {10, 10, -40}, {-30, -30, -10}};
    uint32_t right = 0;
    uint32_t close = 0;
    uint32_t far = 0;
    for (uint32_t k = 0; k < 80u; ++k) {
        const uint32_t link = 2u + (k / 16u);
        setUp();
        push(link, beside[k % 4u], force[(k / 4u) % 4u]);
        TEST_ASSERT_EQUAL(TICKS + N, search());
        far += ((locate.link != 0u) && ((locate.link < link) || (locate.link > link + 2u))) ? 1u : 0u;
        right += (locate.link == link + 1u) ? 1u : 0u;
        close += ((locate.link == link + 1u) && (error_of(force[(k / 4u) % 4u]) < 15.0)) ? 1u : 0u;
    }
    TEST_ASSERT_EQUAL(0, far); /* by more than one link */
    TEST_ASSERT_TRUE(right >= 60u);
    TEST_ASSERT_TRUE(close >= 50u);
}

static void test_a_force_from_before_the_contact_does_not_count(void) {
    push(6u, side, weight);
    for (uint32_t i = 0; i < 2000u; ++i) {
        (void)step(true);
    }
    push(3u, side, blow);
    (void)search();
    TEST_ASSERT_EQUAL(4, locate.link);
}

/* One column, as of a payload: its coefficient stays, and its torque follows the column. */
static void test_what_the_task_explained_before_the_contact_moves_with_its_column(void) {
    explains.columns = 1u;
    explained.coefficient[0] = NUM(10);
    for (uint32_t i = 0; i < N; ++i) {
        explains.column[0][i] = NUM(0.5);
        residual[i] = NUM(5);
    }
    for (uint32_t i = 0; i < 2000u; ++i) {
        (void)step(true);
    }
    TEST_ASSERT_TRUE(num_abs(locate.before[0]) < NUM(0.1));
    for (uint32_t i = 0; i < N; ++i) {
        explains.column[0][i] = (i % 2u == 0u) ? NUM(1) : -NUM(1);
        residual[i] = (i % 2u == 0u) ? NUM(10) : -NUM(10);
    }
    push(3u, side, blow);
    (void)search();
    TEST_ASSERT_EQUAL(4, locate.link);
    TEST_ASSERT_TRUE(error_of(blow) < 15.0);
}

/* How often a weak push on link 4 is located on it, of 16, if its joint has this threshold and the others 1.5 Nm. */
static uint32_t located(double own_threshold) {
    uint32_t right = 0;
    for (uint32_t k = 0; k < 16u; ++k) {
        const double around[3] = {0.01 * (double)(k % 4u), 0.01 * (double)(k / 4u), 0.0};
        const double force[3] = {(k % 2u == 0u) ? 12.0 : -12.0, 8.0 - (2.0 * (double)k), 10.0};
        setUp();
        for (uint32_t i = 0; i < N; ++i) {
            threshold[i] = num_of((i == 3u) ? own_threshold : 1.5);
        }
        push(3u, around, force);
        (void)search();
        right += (locate.link == 4u) ? 1u : 0u;
    }
    return right;
}

static void test_a_joint_with_less_noise_counts_for_more(void) {
    TEST_ASSERT_EQUAL(0, located(1.5));
    TEST_ASSERT_EQUAL(16, located(0.1));
}

static void test_without_a_change_no_link_is_reported(void) {
    (void)search();
    TEST_ASSERT_EQUAL(0, locate.link);
    for (uint32_t i = 0; i < N; ++i) { /* no link explains this */
        residual[i] = (i % 2u == 0u) ? NUM(8) : -NUM(8);
    }
    (void)search();
    TEST_ASSERT_EQUAL(0, locate.link);
}

static void test_no_contact_is_searched_before_a_trip(void) {
    push(3u, side, blow);
    for (uint32_t i = 0; i < 100u; ++i) {
        TEST_ASSERT_FALSE(step(false));
    }
    TEST_ASSERT_EQUAL(0, locate.link);
    TEST_ASSERT_TRUE(locate.before[0] == NUM(0)); /* not calm: not learned */
}

static void test_the_mean_follows_a_residual_that_jumps_across_its_range(void) {
    residual[0] = NUM(511);
    for (uint32_t i = 0; i < 1000u; ++i) {
        TEST_ASSERT_FALSE(locate_now(true));
    }
    const num_t before = locate.before[0];
    TEST_ASSERT_TRUE(before > NUM(500));
    residual[0] = -NUM(511);
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS + SUBSPACE_MAX_COLUMNS; ++i) {
        TEST_ASSERT_FALSE(locate_now(true));
    }
    TEST_ASSERT_TRUE(locate.before[0] < before);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_push_is_located_on_its_link_with_its_force);
    RUN_TEST(test_a_force_from_before_the_contact_does_not_count);
    RUN_TEST(test_what_the_task_explained_before_the_contact_moves_with_its_column);
    RUN_TEST(test_a_joint_with_less_noise_counts_for_more);
    RUN_TEST(test_without_a_change_no_link_is_reported);
    RUN_TEST(test_no_contact_is_searched_before_a_trip);
    RUN_TEST(test_the_mean_follows_a_residual_that_jumps_across_its_range);
    return UNITY_END();
}
