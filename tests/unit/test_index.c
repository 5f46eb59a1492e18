#include "index.h"

#include "bank.h"

#include "core_fixture.h"
#include "robots.h"
#include "vec3.h"

#define N     7u
#define DECAY 0.951229424500714 /* exp(-50/s 1 ms) */

static const robot_t *robot;
static subspace_config_t config;
static index_t index_state;
static motion_t motion;
static observer_t observer;
static regressor_t regressor;
static vec3_t acceleration;
static double torque[N]; /* external torque on the arm, with the observer's sign */
static num_t pose[ROBOT_MAX_JOINTS];

static void move_to(double turn) {
    const double q[N] = {0.3, 0.8, -0.4, -1.3, 0.6, 0.9, 0.2};
    const num_t still[ROBOT_MAX_JOINTS] = {0};
    for (uint32_t i = 0; i < N; ++i) {
        pose[i] = num_of(q[i] + turn);
    }
    motion_step(&motion, robot, pose, still);
}

void setUp(void) {
    robot = &robot_ku_dex;
    config = (subspace_config_t){.order = (uint32_t)ORDER_FILTER_FIRST,
                                 .projector = (uint32_t)PROJECTOR_HARD,
                                 .tolerance = NUM(0.005),
                                 .lever_m = NUM(0.1)};
    index_init(&index_state);
    motion_init(&motion);
    observer_init(&observer);
    acceleration = (vec3_t){NUM(0), NUM(0), NUM(0)};
    memset(torque, 0, sizeof(torque));
    move_to(0.0);
}
void tearDown(void) {
    TEST_ASSERT_EQUAL(0, index_state.saturations);
    TEST_ASSERT_EQUAL(0, (index_state.projection.subspace.saturations + index_state.projection.soft.saturations));
}

static void step(index_kind_t kind) {
    uint32_t saturations = 0;
    const vec3_t across = vec3_across(acceleration, vec3_unit(robot->gravity, &saturations), &saturations);
    const bool matters = num_wide(NUM(5), vec3_length(across)) >= num_widen(NUM(1)); /* 5 kg against 1 N */
    const acceleration_t measured = {.sideways =
                                         matters ? vec3_unit(across, &saturations) : (vec3_t){NUM(0), NUM(0), NUM(0)}};
    const index_config_t task = {.kind = (uint32_t)kind,
                                 .components = (kind == INDEX_CONTACT) ? INDEX_ALL_COMPONENTS : 0u};
    index_step(&index_state, &config, &task, robot, &motion, &observer, &measured, &regressor);
}

static void set_residual(const double r[]) {
    for (uint32_t i = 0; i < N; ++i) {
        observer.residual[i] = num_of(r[i]);
    }
}

/* J^T times force (N) and moment (Nm) at the end-effector. */
static void wrench(const double w[6], double tau[N]) {
    for (uint32_t i = 0; i < N; ++i) {
        tau[i] = 0.0;
        for (uint32_t row = 0; row < 6u; ++row) {
            tau[i] += value_of(motion.jacobian[row][i]) * w[row];
        }
    }
}

static double size_of(const num_t v[]) {
    double square = 0.0;
    for (uint32_t i = 0; i < N; ++i) {
        square += value_of(v[i]) * value_of(v[i]);
    }
    return sqrt(square);
}

/* The part that no wrench at the end-effector explains, and so no payload: the arm's own motion with a resting hand. */
static void unexplained_by_all(double size, double tau[N]) {
    index_t scratch;
    index_init(&scratch);
    for (uint32_t i = 0; i < N; ++i) {
        observer.residual[i] = num_of((i == 3u) ? 10.0 : 1.0);
    }
    const index_config_t task = {.kind = INDEX_CONTACT, .components = INDEX_ALL_COMPONENTS};
    const acceleration_t none = {0};
    index_step(&scratch, &config, &task, robot, &motion, &observer, &none, &regressor);
    const double length = size_of(scratch.unexplained);
    TEST_ASSERT_TRUE(length > 0.1);
    for (uint32_t i = 0; i < N; ++i) {
        tau[i] = value_of(scratch.unexplained[i]) * size / length;
        observer.residual[i] = NUM(0);
    }
}

static void test_without_a_task_the_index_is_the_residual(void) {
    random_start(61);
    for (int round = 0; round < 100; ++round) {
        double r[N];
        for (uint32_t i = 0; i < N; ++i) {
            r[i] = 30.0 * random_one();
        }
        set_residual(r);
        step(INDEX_RESIDUAL);
        TEST_ASSERT_EQUAL_MEMORY(observer.residual, index_state.unexplained, N * sizeof(num_t));
        TEST_ASSERT_EQUAL(0, index_state.rank);
    }
}

static void test_a_payload_at_any_pose_is_explained(void) {
    random_start(62);
    for (int round = 0; round < 300; ++round) {
        double r[N];
        setUp();
        move_to(random_in(-1.0, 1.0));
        acceleration =
            (vec3_t){num_of(3.0 + 2.0 * random_one()), num_of(5.0 * random_one()), num_of(5.0 * random_one())};
        const double pull = 0.3 * random_one(); /* kg of inertia */
        const double w[6] = {pull * value_of(acceleration.x),
                             pull * value_of(acceleration.y),
                             -29.0 + random_one(),
                             random_one(),
                             random_one(),
                             random_one()};
        wrench(w, r);
        set_residual(r);
        step(INDEX_PAYLOAD);
        TEST_ASSERT_EQUAL(5, index_state.rank);
        ASSERT_CLOSE(0.0, size_of(index_state.unexplained), 2e-4);
    }
}

static void test_a_force_across_gravity_and_acceleration_is_not_a_payload(void) {
    const double w[6] = {0.0, 20.0, 0.0, 0.0, 0.0, 0.0};
    double r[N];
    acceleration.x = NUM(3);
    wrench(w, r);
    set_residual(r);
    step(INDEX_PAYLOAD);
    TEST_ASSERT_TRUE(size_of(index_state.unexplained) > 1.0);
}

static void test_any_wrench_at_the_end_effector_is_explained_in_contact(void) {
    random_start(63);
    for (int round = 0; round < 300; ++round) {
        double r[N];
        setUp();
        move_to(random_in(-1.0, 1.0));
        const double w[6] = {40.0 * random_one(), 40.0 * random_one(), 40.0 * random_one(),
                             4.0 * random_one(),  4.0 * random_one(),  4.0 * random_one()};
        wrench(w, r);
        set_residual(r);
        step(INDEX_CONTACT);
        /* Near a singularity the dropped direction leaks at most its singular value times the wrench. */
        const double dropped = (index_state.rank < 6u) ? value_of(index_state.smallest) : 0.0;
        TEST_ASSERT_TRUE(index_state.rank >= 5u);
        ASSERT_CLOSE(0.0, size_of(index_state.unexplained), 2e-4 + 98.0 * dropped);
    }
}

static void test_what_no_wrench_explains_stays_as_it_is(void) {
    const index_kind_t kinds[] = {INDEX_RESIDUAL, INDEX_PAYLOAD, INDEX_CONTACT};
    double r[N];
    unexplained_by_all(8.0, r);
    acceleration.y = NUM(2);
    for (uint32_t k = 0; k < 3u; ++k) {
        index_init(&index_state);
        set_residual(r);
        step(kinds[k]);
        for (uint32_t i = 0; i < N; ++i) {
            ASSERT_CLOSE(r[i], value_of(index_state.unexplained[i]), 5e-5);
        }
    }
}

static void test_no_acceleration_and_one_along_gravity_drop_the_column_and_agree(void) {
    const double r[N] = {3.0, -8.0, 2.0, 7.0, -1.0, 2.0, 0.5};
    num_t at_rest[N];
    set_residual(r);
    step(INDEX_PAYLOAD);
    TEST_ASSERT_EQUAL(4, index_state.rank);
    memcpy(at_rest, index_state.unexplained, sizeof(at_rest));
    const double along[] = {-30.0, -9.81, -0.001, 0.001, 9.81, 30.0};
    for (uint32_t a = 0; a < 6u; ++a) {
        acceleration.z = num_of(along[a]);
        step(INDEX_PAYLOAD);
        TEST_ASSERT_EQUAL(4, index_state.rank);
        for (uint32_t i = 0; i < N; ++i) {
            ASSERT_CLOSE(value_of(at_rest[i]), value_of(index_state.unexplained[i]), 2e-5);
        }
    }
}

static void test_gravity_in_any_direction_is_told_from_acceleration(void) {
    robot_t tilted = robot_ku_dex;
    robot = &tilted;
    random_start(64);
    for (int round = 0; round < 200; ++round) {
        const double g[3] = {9.0 * random_one(), 9.0 * random_one(), 9.0 * random_one()};
        tilted.gravity = (vec3_t){num_of(g[0]), num_of(g[1]), num_of(g[2])};
        const double scale = random_in(-2.0, 2.0);
        acceleration = (vec3_t){num_of(scale * g[0]), num_of(scale * g[1]), num_of(scale * g[2])};
        step(INDEX_PAYLOAD);
        TEST_ASSERT_EQUAL(4, index_state.rank);
        acceleration.x = num_of(scale * g[0] + 2.0 * g[1]);
        acceleration.y = num_of(scale * g[1] - 2.0 * g[0]);
        if (hypot(g[0], g[1]) > 0.5) {
            step(INDEX_PAYLOAD);
            TEST_ASSERT_EQUAL(5, index_state.rank);
        }
    }
}

static void test_an_acceleration_too_small_to_matter_is_dropped(void) {
    acceleration.x = NUM(0.1); /* m/s^2: of 5 kg half a newton, and 1 N matters */
    step(INDEX_PAYLOAD);
    TEST_ASSERT_EQUAL(4, index_state.rank);
    acceleration.x = NUM(0.5);
    step(INDEX_PAYLOAD);
    TEST_ASSERT_EQUAL(5, index_state.rank);
}

static void test_without_gravity_the_whole_acceleration_counts(void) {
    robot_t weightless = robot_ku_dex;
    weightless.gravity = (vec3_t){NUM(0), NUM(0), NUM(0)};
    robot = &weightless;
    step(INDEX_PAYLOAD);
    TEST_ASSERT_EQUAL(3, index_state.rank);
    acceleration.z = NUM(-3);
    const double w[6] = {0.0, 0.0, -25.0, 0.3, 0.0, 0.0};
    double r[N];
    wrench(w, r);
    set_residual(r);
    step(INDEX_PAYLOAD);
    TEST_ASSERT_EQUAL(4, index_state.rank);
    ASSERT_CLOSE(0.0, size_of(index_state.unexplained), 1e-4);
}

static void test_all_zero_input_gives_zero_and_rank_0(void) {
    const index_kind_t kinds[] = {INDEX_RESIDUAL, INDEX_PAYLOAD, INDEX_CONTACT};
    motion_init(&motion); /* a Jacobian of zeros */
    for (uint32_t k = 0; k < 3u; ++k) {
        step(kinds[k]);
        TEST_ASSERT_EQUAL(0, index_state.rank);
        TEST_ASSERT_TRUE(index_state.converged);
        TEST_ASSERT_TRUE(size_of(index_state.unexplained) == 0.0);
    }
    const double r[N] = {1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0};
    set_residual(r);
    step(INDEX_CONTACT);
    TEST_ASSERT_EQUAL_MEMORY(observer.residual, index_state.unexplained, N * sizeof(num_t));
}

static void test_moments_count_by_their_lever(void) {
    const double w[6] = {0.0, 0.0, 0.0, 1.0, -2.0, 0.5};
    double r[N];
    wrench(w, r);
    set_residual(r);
    step(INDEX_PAYLOAD);
    TEST_ASSERT_EQUAL(4, index_state.rank);
    ASSERT_CLOSE(0.0, size_of(index_state.unexplained), 5e-5);
    config.lever_m = NUM(0.001); /* a moment of 1 Nm per N would need a lever of a metre: none is explained */
    step(INDEX_PAYLOAD);
    TEST_ASSERT_EQUAL(1, index_state.rank);
    TEST_ASSERT_TRUE(size_of(index_state.unexplained) > 0.5);
}

static void test_the_tolerance_is_where_a_direction_stops_being_explained(void) {
    step(INDEX_CONTACT);
    subspace_t apart;
    num_t singular[SUBSPACE_MAX_COLUMNS];
    subspace_init(&apart);
    subspace_measure(&apart, N, 6, (const num_t(*)[ROBOT_MAX_JOINTS])index_state.column, NUM(0), singular);
    const double smallest = value_of(apart.smallest);
    TEST_ASSERT_TRUE(smallest > 0.006);
    config.tolerance = num_of(smallest * 1.01);
    step(INDEX_CONTACT);
    TEST_ASSERT_EQUAL(5, index_state.rank);
    config.tolerance = num_of(smallest * 0.99);
    step(INDEX_CONTACT);
    TEST_ASSERT_EQUAL(6, index_state.rank);
}

/* --- project first ------------------------------------------------------------------------------------------------ */

static bank_t bank;
static bank_config_t channels;

/* One tick of an observer with this torque, of the index, and of one first-order channel with the observer's gain. */
static void tick(index_kind_t kind) {
    for (uint32_t i = 0; i < N; ++i) {
        observer.update[i] = num_of((1.0 - DECAY) * torque[i]);
    }
    step(kind);
    bank_step(&bank, &channels, N, 1u, index_state.unexplained, index_state.sudden, 0u);
}

static void project_first(void) {
    setUp();
    config.order = (uint32_t)ORDER_PROJECT_FIRST;
    bank_init(&bank);
    memset(&channels, 0, sizeof(channels));
    channels.channels = 1u;
    channels.channel[0].own[0] = num_of(DECAY);
    channels.channel[0].in[0] = NUM(1);
}

static void test_explained_and_unexplained_add_up_to_the_torque(void) {
    random_start(66);
    project_first();
    for (int round = 0; round < 200; ++round) {
        move_to(random_in(-1.0, 1.0));
        for (uint32_t i = 0; i < N; ++i) {
            torque[i] = 20.0 * random_one();
        }
        tick((round % 2 == 0) ? INDEX_PAYLOAD : INDEX_CONTACT);
        for (uint32_t i = 0; i < N; ++i) {
            ASSERT_CLOSE(value_of(observer.update[i]),
                         value_of(index_state.explained[i]) + value_of(index_state.unexplained[i]), 1e-6);
        }
    }
}

static void test_a_payload_that_stays_when_the_task_says_none_appears_as_a_new_torque_does(void) {
    const double w[6] = {0.0, 0.0, -19.62, 0.2, 0.4, 0.0};
    project_first();
    wrench(w, torque);
    for (int k = 0; k < 400; ++k) {
        tick(INDEX_PAYLOAD);
        ASSERT_CLOSE(0.0, size_of(bank.channel[0].output), 1e-3);
    }
    for (int m = 1; m < 300; ++m) {
        tick(INDEX_RESIDUAL);
        for (uint32_t i = 0; i < N; ++i) {
            ASSERT_CLOSE(torque[i] * (1.0 - pow(DECAY, m)), value_of(bank.channel[0].output[i]), 3e-3);
        }
    }
}

static void test_a_moving_arm_keeps_a_payload_explained(void) {
    project_first();
    for (int k = 0; k < 1000; ++k) {
        const double w[6] = {0.0, 0.0, -19.62, 0.2, 0.4, 0.0};
        move_to(0.6 * sin(0.004 * k)); /* up to 2.4 rad/s in every joint */
        wrench(w, torque);
        tick(INDEX_PAYLOAD);
        ASSERT_CLOSE(0.0, size_of(bank.channel[0].output), 2e-3);
    }
}

static void test_switching_each_tick_hides_no_more_than_the_share_of_ticks(void) {
    double unexplained[N];
    setUp();
    unexplained_by_all(8.0, unexplained);
    project_first();
    double across[N];
    const double w[6] = {0.0, 20.0, 0.0, 0.0, 0.0, 0.0};
    wrench(w, across);
    for (uint32_t i = 0; i < N; ++i) {
        torque[i] = unexplained[i] + across[i];
    }
    for (int k = 0; k < 400; ++k) {
        tick((k % 2 == 0) ? INDEX_RESIDUAL : INDEX_CONTACT);
    }
    double square = 0.0;
    for (uint32_t i = 0; i < N; ++i) {
        square += across[i] * across[i];
    }
    TEST_ASSERT_TRUE(size_of(bank.channel[0].output) > 0.45 * sqrt(square));
}

static void test_a_subset_of_components_explains_these_alone(void) {
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

/* --- contacts by component ---------------------------------------------------------------------------------------- */

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

static void test_one_component_explains_its_axis_and_no_other(void) {
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

static void test_the_sudden_remainder_takes_out_the_fast_components_alone(void) {
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

static void test_the_soft_projector_takes_the_acceleration_by_its_trust(void) {
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

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_without_a_task_the_index_is_the_residual);
    RUN_TEST(test_a_payload_at_any_pose_is_explained);
    RUN_TEST(test_a_force_across_gravity_and_acceleration_is_not_a_payload);
    RUN_TEST(test_any_wrench_at_the_end_effector_is_explained_in_contact);
    RUN_TEST(test_what_no_wrench_explains_stays_as_it_is);
    RUN_TEST(test_no_acceleration_and_one_along_gravity_drop_the_column_and_agree);
    RUN_TEST(test_gravity_in_any_direction_is_told_from_acceleration);
    RUN_TEST(test_an_acceleration_too_small_to_matter_is_dropped);
    RUN_TEST(test_without_gravity_the_whole_acceleration_counts);
    RUN_TEST(test_all_zero_input_gives_zero_and_rank_0);
    RUN_TEST(test_moments_count_by_their_lever);
    RUN_TEST(test_the_tolerance_is_where_a_direction_stops_being_explained);
    RUN_TEST(test_explained_and_unexplained_add_up_to_the_torque);
    RUN_TEST(test_a_payload_that_stays_when_the_task_says_none_appears_as_a_new_torque_does);
    RUN_TEST(test_a_moving_arm_keeps_a_payload_explained);
    RUN_TEST(test_switching_each_tick_hides_no_more_than_the_share_of_ticks);
    RUN_TEST(test_a_subset_of_components_explains_these_alone);
    RUN_TEST(test_a_contact_at_a_point_explains_every_force_there_and_no_moment);
    RUN_TEST(test_one_component_explains_its_axis_and_no_other);
    RUN_TEST(test_axes_of_the_base_frame_at_the_tip_are_the_plain_wrench);
    RUN_TEST(test_the_sudden_remainder_takes_out_the_fast_components_alone);
    RUN_TEST(test_the_soft_projector_takes_the_acceleration_by_its_trust);
    return UNITY_END();
}
