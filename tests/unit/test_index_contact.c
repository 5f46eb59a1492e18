/* Contacts by component: subsets, axes, points, fast components. */
#include "index_fixture.h"

void setUp(void) {
    start();
}
void tearDown(void) {
    assert_no_saturation();
}

static void look_at(const index_config_t *task) {
    const acceleration_t none = {0};
    index_step(&index_state, &config, task, robot, &motion, &observer, &none, &regressor);
}

/* A force at a point: J^T of [f; arm x f], the arm in the base frame. */
static void force_at(const double arm[3], const double f[3], double tau[N]) {
    const double w[6] = {
        f[0], f[1], f[2], arm[1] * f[2] - arm[2] * f[1], arm[2] * f[0] - arm[0] * f[2], arm[0] * f[1] - arm[1] * f[0]};
    wrench(w, tau);
}

/* Axes and point in the last link's frame, and the same in the base frame. */
static void tool_frame(index_config_t *task, double axis[3][3], double arm[3]) {
    const vec3_t *const row[3] = {&motion.tool_x, &motion.tool_y, &motion.tool_z};
    for (uint32_t i = 0; i < 3u; ++i) {
        const double v[3] = {value_of(row[i]->x), value_of(row[i]->y), value_of(row[i]->z)};
        arm[i] = 0.0;
        for (uint32_t a = 0; a < 3u; ++a) {
            axis[a][i] = 0.0;
            for (uint32_t j = 0; j < 3u; ++j) {
                axis[a][i] += v[j] * value_of(task->axis[a][j]);
            }
            arm[i] += v[a] * value_of(task->point[a]);
        }
    }
}

static void test_a_subset_of_components_explains_only_these(void) {
    const double force[6] = {10.0, -20.0, 15.0, 0.0, 0.0, 0.0};
    const double moment[6] = {0.0, 0.0, 0.0, 3.0, 2.0, -3.0};
    const index_config_t forces = {.kind = INDEX_CONTACT, .components = 0x07u};
    const acceleration_t none = {0};
    double r[N];
    wrench(force, r);
    set_residual(r);
    index_step(&index_state, &config, &forces, robot, &motion, &observer, &none, &regressor);
    TEST_ASSERT_EQUAL(3, index_state.columns);
    ASSERT_CLOSE(0.0, size_of(index_state.unexplained), 2e-4);
    wrench(moment, r);
    set_residual(r);
    index_step(&index_state, &config, &forces, robot, &motion, &observer, &none, &regressor);
    TEST_ASSERT_TRUE(size_of(index_state.unexplained) > 0.5);
}

static void test_a_contact_at_a_point_explains_every_force_there_and_no_moment(void) {
    const double c = 0.6, s = 0.8;
    const index_config_t task = {
        .kind = INDEX_CONTACT,
        .components = 7u,
        .frame = FRAME_TOOL,
        .axis = {{num_of(c), num_of(s), NUM(0)}, {num_of(-s), num_of(c), NUM(0)}, {NUM(0), NUM(0), NUM(1)}},
        .point = {NUM(0.1), NUM(-0.2), NUM(0.3)}};
    random_start(66);
    for (int round = 0; round < 100; ++round) {
        index_config_t copy = task;
        double axis[3][3], arm[3], r[N];
        move_to(random_in(-1.0, 1.0));
        tool_frame(&copy, axis, arm);
        const double f[3] = {40.0 * random_one(), 40.0 * random_one(), 40.0 * random_one()};
        force_at(arm, f, r);
        set_residual(r);
        look_at(&copy);
        TEST_ASSERT_EQUAL(3, index_state.columns);
        if (index_state.rank == 3u) {
            ASSERT_CLOSE(0.0, size_of(index_state.unexplained), 5e-4);
        }
        const double moment[6] = {0.0, 0.0, 0.0, 3.0, -4.0, 5.0};
        wrench(moment, r);
        set_residual(r);
        look_at(&copy);
        TEST_ASSERT_TRUE(size_of(index_state.unexplained) > 0.5);
    }
}

static void test_one_component_explains_only_its_axis(void) {
    index_config_t task = {.kind = INDEX_CONTACT,
                           .components = 2u,
                           .frame = FRAME_TOOL,
                           .axis = {{NUM(1), NUM(0), NUM(0)}, {NUM(0), NUM(1), NUM(0)}, {NUM(0), NUM(0), NUM(1)}}};
    double axis[3][3], arm[3], r[N];
    tool_frame(&task, axis, arm);
    for (uint32_t a = 0; a < 3u; ++a) {
        const double f[3] = {30.0 * axis[a][0], 30.0 * axis[a][1], 30.0 * axis[a][2]};
        force_at(arm, f, r);
        set_residual(r);
        look_at(&task);
        TEST_ASSERT_TRUE((a == 1u) == (size_of(index_state.unexplained) < 1e-3));
    }
}

static void test_axes_of_the_base_frame_at_the_tip_are_the_plain_wrench(void) {
    const index_config_t plain = {.kind = INDEX_CONTACT, .components = 0x2Du};
    index_config_t framed = plain;
    const double r[N] = {3.0, -8.0, 2.0, 7.0, -1.0, 2.0, 0.5};
    num_t expected[N];
    framed.frame = FRAME_BASE;
    for (uint32_t a = 0; a < 3u; ++a) {
        framed.axis[a][a] = NUM(1);
    }
    set_residual(r);
    look_at(&plain);
    memcpy(expected, index_state.unexplained, sizeof(expected));
    look_at(&framed);
    for (uint32_t i = 0; i < N; ++i) {
        ASSERT_CLOSE(value_of(expected[i]), value_of(index_state.unexplained[i]), 2e-4);
    }
}

static void test_the_sudden_remainder_lacks_only_the_fast_components(void) {
    const index_config_t task = {.kind = INDEX_CONTACT, .components = INDEX_ALL_COMPONENTS, .fast = 7u};
    const index_config_t forces = {.kind = INDEX_CONTACT, .components = 7u};
    const double w[6] = {20.0, -10.0, 30.0, 2.0, 3.0, -4.0};
    double r[N];
    num_t sudden[N];
    config.projector = (uint32_t)PROJECTOR_SOFT;
    wrench(w, r);
    set_residual(r);
    look_at(&task);
    TEST_ASSERT_TRUE(size_of(index_state.unexplained) < 0.1);
    TEST_ASSERT_TRUE(size_of(index_state.sudden) > 0.5);
    memcpy(sudden, index_state.sudden, sizeof(sudden));
    look_at(&forces);
    TEST_ASSERT_EQUAL_MEMORY(sudden, index_state.unexplained, sizeof(sudden));
    TEST_ASSERT_TRUE(size_of(index_state.sudden) < 1e-9); /* without a fast component there is no `sudden` */
}

static void test_the_soft_projector_weights_the_acceleration_by_its_trust(void) {
    const index_config_t task = {.kind = INDEX_PAYLOAD};
    const double w[6] = {20.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    acceleration_t trusted = {.sideways = {NUM(1), NUM(0), NUM(0)}};
    double r[N], before = 0.0;
    config.projector = (uint32_t)PROJECTOR_SOFT;
    wrench(w, r);
    set_residual(r);
    for (int k = 0; k <= 1000; ++k) {
        trusted.trust = num_of(1e-3 * k);
        index_step(&index_state, &config, &task, robot, &motion, &observer, &trusted, &regressor);
        const double left = size_of(index_state.unexplained);
        TEST_ASSERT_TRUE((k == 0) || (left <= before + 1e-3));
        before = left;
    }
    TEST_ASSERT_TRUE(before < 0.1);
}

/* The projectors' sums have room for columns below 64. No arm that robot_is_valid accepts has such a Jacobian. */
static void test_a_column_beyond_the_range_of_the_projectors_saturates_and_is_counted(void) {
    const index_config_t task = {.kind = INDEX_CONTACT,
                                 .components = 9u,
                                 .frame = FRAME_BASE,
                                 .axis = {{NUM(0.6), NUM(0.8), 0}, {NUM(-0.8), NUM(0.6), 0}, {0, 0, NUM(1)}}};
    motion.jacobian[0][2] = NUM(-63);
    motion.jacobian[1][2] = NUM(-63);
    look_at(&task);
    ASSERT_CLOSE(IF_FIXED(-64.0, -63.0 * 1.4), value_of(index_state.column[0][2]), 1e-4);
    TEST_ASSERT_EQUAL(IF_FIXED(1, 0), index_state.saturations);
    index_state.saturations = 0;
    index_state.projection.subspace.saturations = 0;
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_subset_of_components_explains_only_these);
    RUN_TEST(test_a_contact_at_a_point_explains_every_force_there_and_no_moment);
    RUN_TEST(test_one_component_explains_only_its_axis);
    RUN_TEST(test_axes_of_the_base_frame_at_the_tip_are_the_plain_wrench);
    RUN_TEST(test_the_sudden_remainder_lacks_only_the_fast_components);
    RUN_TEST(test_the_soft_projector_weights_the_acceleration_by_its_trust);
    RUN_TEST(test_a_column_beyond_the_range_of_the_projectors_saturates_and_is_counted);
    return UNITY_END();
}
