/* Each limit of the explained part from both sides, and the estimate against double precision. The columns are unit
 * vectors and not softened, so that a coefficient is the torque of its joint. */
#include "core_fixture.h"
#include "explained.h"
#include "token.h"
#include "vec3.h"

static robot_t robot;
static observer_t observer;
static acceleration_t acceleration;
static index_t index_state;
static explained_t explained;
static explained_config_t limits;
static subspace_config_t config;
static index_config_t task;

void setUp(void) {
    memset(&robot, 0, sizeof(robot));
    memset(&observer, 0, sizeof(observer));
    memset(&acceleration, 0, sizeof(acceleration));
    memset(&task, 0, sizeof(task));
    robot.joint_count = ROBOT_MAX_JOINTS;
    robot.gravity.z = NUM(-10);
    index_init(&index_state);
    explained_init(&explained);
    config = (subspace_config_t){.order = (uint32_t)ORDER_FILTER_FIRST,
                                 .projector = (uint32_t)PROJECTOR_HARD,
                                 .lever_m = NUM(0.25),
                                 .softness = NUM(0)};
    limits = (explained_config_t){.mass_max_kg = NUM(3),
                                  .arm_max_m = NUM(0.5),
                                  .force_max_n = NUM(140),
                                  .moment_max_nm = NUM(40),
                                  .force_slack_n = NUM(25),
                                  .moment_slack_nm = NUM(10)};
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        limits.residual_max_nm[i] = num_of(100.0 + i);
    }
}
void tearDown(void) {}

static void step(void) {
    explained_step(&explained, &limits, &config, 2u, &robot, &observer, &acceleration, &task, &index_state);
}

/* The excess with these coefficients. */
static excess_t excess_of(uint32_t count, const double w[]) {
    index_state.columns = count;
    memset(index_state.column, 0, sizeof(index_state.column));
    for (uint32_t c = 0; c < count; ++c) {
        index_state.column[c][c] = NUM(1);
        index_state.explained[c] = num_of(w[c]);
    }
    explained.task = NULL;
    step();
    for (uint32_t c = 0; c < count; ++c) {
        TEST_ASSERT_TRUE(explained.coefficient[c] == num_of(w[c]));
    }
    return explained.excess;
}

/* Nothing at `size`, `kind` a little beyond: coefficient `at` is `scale` times the value that is limited. */
static void assert_limit(uint32_t count, uint32_t at, double scale, double size, excess_t kind) {
    double w[SUBSPACE_MAX_COLUMNS] = {0.0};
    w[at] = scale * size * 0.9995;
    TEST_ASSERT_EQUAL(EXPLAINED_NOTHING, excess_of(count, w));
    w[at] = scale * size * 1.0005;
    TEST_ASSERT_EQUAL(kind, excess_of(count, w));
    ASSERT_CLOSE(size, value_of(explained.limit), 1e-3);
    ASSERT_CLOSE(size * 1.0005, value_of(explained.value), 1e-3);
}

static void test_a_payload_is_limited_by_its_weight_and_its_arm(void) {
    task.kind = (uint32_t)INDEX_PAYLOAD;
    acceleration.size = NUM(2);
    acceleration.across = NUM(1.5);
    assert_limit(5u, 3u, -1.0, 3.0 * (10.0 + 2.0) + 25.0, EXPLAINED_FORCE); /* down */
    assert_limit(5u, 3u, 1.0, 25.0, EXPLAINED_FORCE);                       /* up: the slack alone */
    assert_limit(5u, 4u, 1.0, 3.0 * 1.5 + 25.0, EXPLAINED_FORCE);           /* sideways */
    assert_limit(5u, 4u, -1.0, 3.0 * 1.5 + 25.0, EXPLAINED_FORCE);
    for (uint32_t axis = 0; axis < 3u; ++axis) {
        assert_limit(5u, axis, 4.0, 0.5 * 36.0 + 10.0, EXPLAINED_MOMENT);
        assert_limit(5u, axis, -4.0, 0.5 * 36.0 + 10.0, EXPLAINED_MOMENT);
    }
}

/* With the soft projector the last column has the length of the trust, which the coefficient does not have. */
static void test_a_payload_under_the_soft_projector_counts_sideways_by_its_trust(void) {
    task.kind = (uint32_t)INDEX_PAYLOAD;
    config.projector = (uint32_t)PROJECTOR_SOFT;
    acceleration.trust = NUM(0.25);
    assert_limit(5u, 4u, 4.0, 25.0, EXPLAINED_FORCE);
    assert_limit(5u, 3u, 1.0, 25.0, EXPLAINED_FORCE);
}

static void test_a_force_and_a_moment_have_their_limits_in_every_direction(void) {
    task.kind = (uint32_t)INDEX_CONTACT;
    task.components = INDEX_ALL_COMPONENTS;
    double force[6] = {0.0};
    double moment[6] = {0.0};
    uint32_t component[INDEX_COMPONENTS];
    TEST_ASSERT_EQUAL(6, index_order(&task, component));
    for (uint32_t c = 0; c < 6u; ++c) {
        force[c] = (component[c] < 3u) ? 60.0 : 0.0; /* 104 N in all, 35 Nm */
        moment[c] = (component[c] < 3u) ? 0.0 : 80.0;
        if (component[c] < 3u) {
            assert_limit(6u, c, 1.0, 140.0, EXPLAINED_FORCE);
            assert_limit(6u, c, -1.0, 140.0, EXPLAINED_FORCE);
        } else {
            assert_limit(6u, c, 4.0, 40.0, EXPLAINED_MOMENT);
            assert_limit(6u, c, -4.0, 40.0, EXPLAINED_MOMENT);
        }
    }
    TEST_ASSERT_EQUAL(EXPLAINED_NOTHING, excess_of(6u, force));
    TEST_ASSERT_EQUAL(EXPLAINED_NOTHING, excess_of(6u, moment));
    limits.force_max_n = NUM(103);
    limits.moment_max_nm = NUM(34);
    TEST_ASSERT_EQUAL(EXPLAINED_FORCE, excess_of(6u, force));
    ASSERT_CLOSE(60.0 * sqrt(3.0), value_of(explained.value), 1e-3);
    TEST_ASSERT_EQUAL(EXPLAINED_MOMENT, excess_of(6u, moment));
    ASSERT_CLOSE(80.0 * sqrt(3.0) * 0.25, value_of(explained.value), 1e-3);
}

static void test_a_regressor_is_limited_at_rest(void) {
    task.kind = (uint32_t)INDEX_REGRESSOR;
    const double weight_max = 3.0 * 9.81;
    assert_limit(5u, 0u, 1.0 / (3.0 * 9.81), weight_max + 25.0, EXPLAINED_FORCE);
    assert_limit(5u, 0u, -1.0 / (3.0 * 9.81), 25.0, EXPLAINED_FORCE);
    for (uint32_t axis = 1; axis < 4u; ++axis) {
        assert_limit(5u, axis, 1.0 / (0.3 * 9.81), 0.5 * weight_max + 10.0, EXPLAINED_MOMENT);
        assert_limit(5u, axis, -1.0 / (0.3 * 9.81), 0.5 * weight_max + 10.0, EXPLAINED_MOMENT);
    }
    assert_limit(5u, 4u, 1.0 / (0.03 * 10.0), 0.5 * weight_max + 10.0, EXPLAINED_MOMENT);
    assert_limit(5u, 4u, -1.0 / (0.03 * 10.0), 0.5 * weight_max + 10.0, EXPLAINED_MOMENT);
}

/* Far beyond the range of a product in Q9.22, and still an excess. */
static void test_the_largest_coefficients_exceed_every_limit(void) {
    task.kind = (uint32_t)INDEX_REGRESSOR;
    for (uint32_t c = 0; c < 5u; ++c) {
        double w[SUBSPACE_MAX_COLUMNS] = {0.0};
        w[c] = 500.0;
        TEST_ASSERT_EQUAL((c == 0u) ? EXPLAINED_FORCE : EXPLAINED_MOMENT, excess_of(5u, w));
        w[c] = -500.0;
        TEST_ASSERT_EQUAL((c == 0u) ? EXPLAINED_FORCE : EXPLAINED_MOMENT, excess_of(5u, w));
    }
}

/* A value equal to its limit is not an excess. */
static void test_a_limit_itself_is_permitted(void) {
    double w[SUBSPACE_MAX_COLUMNS] = {0.0};
    task.kind = (uint32_t)INDEX_PAYLOAD;
    w[3] = 25.0;
    TEST_ASSERT_EQUAL(EXPLAINED_NOTHING, excess_of(5u, w));
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        observer.residual[i] = limits.residual_max_nm[i];
    }
    TEST_ASSERT_EQUAL(EXPLAINED_NOTHING, excess_of(5u, w));
    TEST_ASSERT_EQUAL(0, explained.joint);
}

static void test_the_weight_of_a_payload_is_no_moment(void) {
    double w[SUBSPACE_MAX_COLUMNS] = {0.0};
    task.kind = (uint32_t)INDEX_PAYLOAD;
    limits.arm_max_m = NUM(0);
    w[3] = -50.0;
    TEST_ASSERT_EQUAL(EXPLAINED_NOTHING, excess_of(5u, w));
}

static void test_every_joint_has_its_own_limit_on_the_residual(void) {
    task.kind = (uint32_t)INDEX_RESIDUAL;
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        observer.residual[i] = num_of(((i % 2u) == 0u) ? 100.5 + i : -100.5 - i);
        step();
        TEST_ASSERT_EQUAL(EXPLAINED_RESIDUAL, explained.excess);
        TEST_ASSERT_EQUAL(i, explained.joint);
        ASSERT_CLOSE(100.5 + i, value_of(explained.value), 1e-4);
        ASSERT_CLOSE(100.0 + i, value_of(explained.limit), 1e-4);
        observer.residual[i] = NUM(0);
    }
    observer.residual[1] = NUM(200); /* the first of two is named, and its numbers */
    observer.residual[5] = NUM(300);
    step();
    TEST_ASSERT_EQUAL(1, explained.joint);
    ASSERT_CLOSE(200.0, value_of(explained.value), 1e-4);
    robot.joint_count = 7u;
    observer.residual[1] = NUM(0);
    observer.residual[5] = NUM(0);
    observer.residual[7] = NUM(300); /* of no joint */
    step();
    TEST_ASSERT_EQUAL(EXPLAINED_NOTHING, explained.excess);
    TEST_ASSERT_EQUAL(0, explained.joint);
}

/* The first excess is recorded, whatever follows. */
static void test_an_excess_of_force_comes_before_one_of_the_residual(void) {
    double w[SUBSPACE_MAX_COLUMNS] = {0.0};
    task.kind = (uint32_t)INDEX_PAYLOAD;
    w[0] = 400.0;
    w[3] = 26.0;
    observer.residual[2] = NUM(300);
    TEST_ASSERT_EQUAL(EXPLAINED_FORCE, excess_of(5u, w));
    ASSERT_CLOSE(26.0, value_of(explained.value), 1e-4);
    TEST_ASSERT_EQUAL(0, explained.joint);
}

static void test_an_excess_trips_in_its_second_tick(void) {
    task.kind = (uint32_t)INDEX_RESIDUAL;
    observer.residual[0] = NUM(300);
    step();
    TEST_ASSERT_FALSE(explained.tripped);
    TEST_ASSERT_EQUAL(1, explained.above);
    step();
    TEST_ASSERT_TRUE(explained.tripped);
    explained.above = UINT32_MAX;
    step();
    TEST_ASSERT_EQUAL(UINT32_MAX, explained.above);
    observer.residual[0] = NUM(0);
    explained_step(&explained, &limits, &config, 0u, &robot, &observer, &acceleration, &task, &index_state);
    TEST_ASSERT_FALSE(explained.tripped);
    TEST_ASSERT_EQUAL(0, explained.above);
}

static void test_the_token_is_that_of_the_index_passed_on(void) {
    index_state.token = 12345u;
    step();
    TEST_ASSERT_EQUAL_HEX32(token_next(12345u, TOKEN_EXPLAINED, 0u), explained.token);
}

/* --- the estimate ------------------------------------------------------------------------------------------------- */

#define DECAY 0.9375

/* One sweep of Gauss and Seidel in double precision. */
static void sweep(uint32_t columns, double soft, const double torque[], double w[]) {
    double rest[ROBOT_MAX_JOINTS];
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        rest[i] = torque[i];
        for (uint32_t c = 0; c < columns; ++c) {
            rest[i] -= w[c] * value_of(index_state.column[c][i]);
        }
    }
    for (uint32_t c = 0; c < columns; ++c) {
        double along = 0.0;
        double square = soft;
        for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
            along += value_of(index_state.column[c][i]) * rest[i];
            square += value_of(index_state.column[c][i]) * value_of(index_state.column[c][i]);
        }
        const double change = (along - soft * w[c]) / square;
        w[c] += change;
        for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
            rest[i] -= change * value_of(index_state.column[c][i]);
        }
    }
}

/* Three ticks of one task, then three of another one with fewer columns, then back to more columns. */
static void assert_estimate(index_order_t order, index_kind_t kind, double soft) {
    static const uint32_t columns[9] = {6u, 6u, 6u, 4u, 4u, 4u, 6u, 3u, 6u};
    index_config_t tasks[2] = {{.kind = (uint32_t)kind}, {.kind = (uint32_t)kind}};
    double torque[ROBOT_MAX_JOINTS] = {0.0};
    double w[SUBSPACE_MAX_COLUMNS] = {0.0};
    explained_init(&explained);
    config.order = (uint32_t)order;
    config.softness = NUM(0.5);
    observer.decay = NUM(DECAY);
    for (uint32_t tick = 0; tick < 9u; ++tick) {
        const bool same = (tick != 0u) && (tick != 3u) && (tick != 6u);
        const index_config_t *const row = &tasks[(tick / 3u) % 2u];
        index_state.columns = columns[tick];
        for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
            for (uint32_t c = 0; c < 6u; ++c) {
                index_state.column[c][i] = num_of(2.0 * random_one());
            }
            index_state.explained[i] = num_of(10.0 * random_one());
            torque[i] = ((same && (order == ORDER_PROJECT_FIRST)) ? DECAY * torque[i] : 0.0) +
                        value_of(index_state.explained[i]);
        }
        for (uint32_t c = 0; c < SUBSPACE_MAX_COLUMNS; ++c) {
            w[c] = (same && (c < columns[tick])) ? w[c] : 0.0;
        }
        sweep(columns[tick], soft, torque, w);
        explained_step(&explained, &limits, &config, 2u, &robot, &observer, &acceleration, row, &index_state);
        for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
            ASSERT_CLOSE(torque[i], value_of(explained.torque[i]), 2e-5);
        }
        for (uint32_t c = 0; c < SUBSPACE_MAX_COLUMNS; ++c) {
            ASSERT_CLOSE(w[c], value_of(explained.coefficient[c]), 1e-4);
        }
        TEST_ASSERT_TRUE(explained.task == row);
    }
}

static void test_the_estimate_is_one_sweep_on_the_filtered_torque(void) {
    random_start(41);
    for (uint32_t round = 0; round < 10u; ++round) {
        assert_estimate(ORDER_PROJECT_FIRST, INDEX_CONTACT, 0.25);
        assert_estimate(ORDER_FILTER_FIRST, INDEX_PAYLOAD, 0.25);
        assert_estimate(ORDER_PROJECT_FIRST, INDEX_REGRESSOR, 25.0); /* softer by ten */
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_payload_is_limited_by_its_weight_and_its_arm);
    RUN_TEST(test_a_payload_under_the_soft_projector_counts_sideways_by_its_trust);
    RUN_TEST(test_a_force_and_a_moment_have_their_limits_in_every_direction);
    RUN_TEST(test_a_regressor_is_limited_at_rest);
    RUN_TEST(test_the_largest_coefficients_exceed_every_limit);
    RUN_TEST(test_a_limit_itself_is_permitted);
    RUN_TEST(test_every_joint_has_its_own_limit_on_the_residual);
    RUN_TEST(test_an_excess_of_force_comes_before_one_of_the_residual);
    RUN_TEST(test_an_excess_trips_in_its_second_tick);
    RUN_TEST(test_the_token_is_that_of_the_index_passed_on);
    RUN_TEST(test_the_estimate_is_one_sweep_on_the_filtered_torque);
    RUN_TEST(test_the_weight_of_a_payload_is_no_moment);
    return UNITY_END();
}
