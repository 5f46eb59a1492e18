/* The torque that each index explains. Contacts by component: test_index_contact.c; a filter after the projection:
 * test_index_bank.c. */
#include "index_fixture.h"

void setUp(void) {
    start();
}
void tearDown(void) {
    assert_no_saturation();
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

/* Not the sixth column that a contact has left behind. */
static void test_a_payload_after_a_contact_has_five_columns(void) {
    start();
    acceleration = (vec3_t){NUM(3), NUM(-2), NUM(1)};
    step(INDEX_CONTACT);
    TEST_ASSERT_EQUAL(6, index_state.columns);
    step(INDEX_PAYLOAD);
    TEST_ASSERT_EQUAL(5, index_state.columns);
}

/* Whatever trust in it the soft projector would have. */
static void test_the_hard_projector_takes_the_whole_acceleration(void) {
    start();
    acceleration = (vec3_t){NUM(4), NUM(0), NUM(0)};
    step(INDEX_PAYLOAD);
    for (uint32_t i = 0; i < N; ++i) {
        TEST_ASSERT_TRUE(index_state.column[4][i] == motion.jacobian[0][i]);
    }
}

static void test_a_payload_at_any_pose_is_explained(void) {
    random_start(62);
    for (int round = 0; round < 300; ++round) {
        double r[N];
        start();
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
        start();
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

static void test_torque_that_no_wrench_explains_stays_unchanged(void) {
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

static void test_gravity_in_any_direction_is_distinguished_from_acceleration(void) {
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

static void test_directions_below_the_tolerance_are_not_explained(void) {
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

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_without_a_task_the_index_is_the_residual);
    RUN_TEST(test_a_payload_after_a_contact_has_five_columns);
    RUN_TEST(test_the_hard_projector_takes_the_whole_acceleration);
    RUN_TEST(test_a_payload_at_any_pose_is_explained);
    RUN_TEST(test_a_force_across_gravity_and_acceleration_is_not_a_payload);
    RUN_TEST(test_any_wrench_at_the_end_effector_is_explained_in_contact);
    RUN_TEST(test_torque_that_no_wrench_explains_stays_unchanged);
    RUN_TEST(test_no_acceleration_and_one_along_gravity_drop_the_column_and_agree);
    RUN_TEST(test_gravity_in_any_direction_is_distinguished_from_acceleration);
    RUN_TEST(test_an_acceleration_too_small_to_matter_is_dropped);
    RUN_TEST(test_without_gravity_the_whole_acceleration_counts);
    RUN_TEST(test_all_zero_input_gives_zero_and_rank_0);
    RUN_TEST(test_moments_count_by_their_lever);
    RUN_TEST(test_directions_below_the_tolerance_are_not_explained);
    return UNITY_END();
}
