#include "index.h"

#include "core_fixture.h"
#include "robots.h"

#define N     7u
#define DECAY 0.951229424500714 /* exp(-50/s 1 ms) */

static const robot_t *robot;
static subspace_config_t config;
static index_t index_state;
static motion_t motion;
static observer_t observer;
static vec3_t acceleration;
static double torque[N]; /* that acts on the arm from outside, as the observer means it */
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
    config = (subspace_config_t){.basis = (uint32_t)BASIS_INSTANTANEOUS, .tolerance = NUM(0.005), .lever_m = NUM(0.1)};
    index_init(&index_state);
    motion_init(&motion);
    observer_init(&observer);
    acceleration = (vec3_t){NUM(0), NUM(0), NUM(0)};
    memset(torque, 0, sizeof(torque));
    move_to(0.0);
}
void tearDown(void) {
    TEST_ASSERT_EQUAL(0, index_state.saturations);
    TEST_ASSERT_EQUAL(0, index_state.subspace.saturations);
}

static void step(index_kind_t kind) {
    index_step(&index_state, &config, kind, robot, &motion, &observer, acceleration);
}

static void set_residual(const double r[]) {
    for (uint32_t i = 0; i < N; ++i) {
        observer.residual[i] = num_of(r[i]);
    }
}

/* One tick of an observer that sees the torque, and of the index. */
static void tick(index_kind_t kind) {
    observer.decay = num_of(DECAY);
    for (uint32_t i = 0; i < N; ++i) {
        observer.residual[i] = num_of(DECAY * value_of(observer.residual[i]) + (1.0 - DECAY) * torque[i]);
    }
    step(kind);
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

/* What no wrench at the end-effector explains, so no payload either: the arm's own motion with a still hand. */
static void unexplained_by_all(double size, double tau[N]) {
    index_t scratch;
    index_init(&scratch);
    for (uint32_t i = 0; i < N; ++i) {
        observer.residual[i] = num_of((i == 3u) ? 10.0 : 1.0);
    }
    index_step(&scratch, &config, INDEX_CONTACT, robot, &motion, &observer, acceleration);
    const double length = size_of(scratch.value);
    TEST_ASSERT_TRUE(length > 0.1);
    for (uint32_t i = 0; i < N; ++i) {
        tau[i] = value_of(scratch.value[i]) * size / length;
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
        TEST_ASSERT_EQUAL_MEMORY(observer.residual, index_state.value, N * sizeof(num_t));
        TEST_ASSERT_EQUAL(0, index_state.subspace.rank);
    }
}

static void test_a_payload_at_any_pose_is_explained(void) {
    random_start(62);
    for (int round = 0; round < 300; ++round) {
        double r[N];
        setUp();
        move_to(random_in(-1.0, 1.0));
        acceleration = (vec3_t){num_of(5.0 * random_one()), num_of(5.0 * random_one()), num_of(5.0 * random_one())};
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
        TEST_ASSERT_EQUAL(5, index_state.subspace.rank);
        ASSERT_CLOSE(0.0, size_of(index_state.value), 2e-4);
    }
}

static void test_a_force_across_gravity_and_acceleration_is_not_a_payload(void) {
    const double w[6] = {0.0, 20.0, 0.0, 0.0, 0.0, 0.0};
    double r[N];
    acceleration.x = NUM(3);
    wrench(w, r);
    set_residual(r);
    step(INDEX_PAYLOAD);
    TEST_ASSERT_TRUE(size_of(index_state.value) > 1.0);
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
        /* Near a singularity the direction that is dropped leaks: no more than its singular value times the wrench. */
        const double dropped = (index_state.subspace.rank < 6u) ? value_of(index_state.subspace.smallest) : 0.0;
        TEST_ASSERT_TRUE(index_state.subspace.rank >= 5u);
        ASSERT_CLOSE(0.0, size_of(index_state.value), 2e-4 + 98.0 * dropped);
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
            ASSERT_CLOSE(r[i], value_of(index_state.value[i]), 5e-5);
        }
    }
}

static void test_no_acceleration_and_one_along_gravity_drop_the_column_and_agree(void) {
    const double r[N] = {3.0, -8.0, 2.0, 7.0, -1.0, 2.0, 0.5};
    num_t at_rest[N];
    set_residual(r);
    step(INDEX_PAYLOAD);
    TEST_ASSERT_EQUAL(4, index_state.subspace.rank);
    memcpy(at_rest, index_state.value, sizeof(at_rest));
    const double along[] = {-30.0, -9.81, -0.001, 0.001, 9.81, 30.0};
    for (uint32_t a = 0; a < 6u; ++a) {
        acceleration.z = num_of(along[a]);
        step(INDEX_PAYLOAD);
        TEST_ASSERT_EQUAL(4, index_state.subspace.rank);
        for (uint32_t i = 0; i < N; ++i) {
            ASSERT_CLOSE(value_of(at_rest[i]), value_of(index_state.value[i]), 2e-5);
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
        TEST_ASSERT_EQUAL(4, index_state.subspace.rank);
        acceleration.x = num_of(scale * g[0] + 2.0 * g[1]);
        acceleration.y = num_of(scale * g[1] - 2.0 * g[0]);
        if (hypot(g[0], g[1]) > 0.5) {
            step(INDEX_PAYLOAD);
            TEST_ASSERT_EQUAL(5, index_state.subspace.rank);
        }
    }
}

static void test_an_acceleration_too_small_to_matter_is_dropped(void) {
    acceleration.x = NUM(0.002); /* m/s^2: by less than 1 m of lever, below the tolerance */
    step(INDEX_PAYLOAD);
    TEST_ASSERT_EQUAL(4, index_state.subspace.rank);
    acceleration.x = NUM(0.5);
    step(INDEX_PAYLOAD);
    TEST_ASSERT_EQUAL(5, index_state.subspace.rank);
}

static void test_without_gravity_the_whole_acceleration_counts(void) {
    robot_t weightless = robot_ku_dex;
    weightless.gravity = (vec3_t){NUM(0), NUM(0), NUM(0)};
    robot = &weightless;
    step(INDEX_PAYLOAD);
    TEST_ASSERT_EQUAL(3, index_state.subspace.rank);
    acceleration.z = NUM(-3);
    const double w[6] = {0.0, 0.0, -25.0, 0.3, 0.0, 0.0};
    double r[N];
    wrench(w, r);
    set_residual(r);
    step(INDEX_PAYLOAD);
    TEST_ASSERT_EQUAL(4, index_state.subspace.rank);
    ASSERT_CLOSE(0.0, size_of(index_state.value), 1e-4);
}

static void test_all_zero_input_gives_zero_and_rank_0(void) {
    const index_kind_t kinds[] = {INDEX_RESIDUAL, INDEX_PAYLOAD, INDEX_CONTACT};
    motion_init(&motion); /* a Jacobian of zeros */
    for (uint32_t k = 0; k < 3u; ++k) {
        step(kinds[k]);
        TEST_ASSERT_EQUAL(0, index_state.subspace.rank);
        TEST_ASSERT_TRUE(index_state.subspace.converged);
        TEST_ASSERT_TRUE(size_of(index_state.value) == 0.0);
    }
    const double r[N] = {1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0};
    set_residual(r);
    step(INDEX_CONTACT);
    TEST_ASSERT_EQUAL_MEMORY(observer.residual, index_state.value, N * sizeof(num_t));
}

static void test_moments_count_by_their_lever(void) {
    const double w[6] = {0.0, 0.0, 0.0, 1.0, -2.0, 0.5};
    double r[N];
    wrench(w, r);
    set_residual(r);
    step(INDEX_PAYLOAD);
    TEST_ASSERT_EQUAL(4, index_state.subspace.rank);
    ASSERT_CLOSE(0.0, size_of(index_state.value), 5e-5);
    config.lever_m = NUM(0.001); /* a moment of 1 Nm per N would need a lever of a metre: none is explained */
    step(INDEX_PAYLOAD);
    TEST_ASSERT_EQUAL(1, index_state.subspace.rank);
    TEST_ASSERT_TRUE(size_of(index_state.value) > 0.5);
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
    TEST_ASSERT_EQUAL(5, index_state.subspace.rank);
    config.tolerance = num_of(smallest * 0.99);
    step(INDEX_CONTACT);
    TEST_ASSERT_EQUAL(6, index_state.subspace.rank);
}

static void test_a_payload_that_stays_when_the_task_says_none_appears_with_the_observers_lag(void) {
    const double w[6] = {0.0, 0.0, -19.62, 0.2, 0.4, 0.0};
    const int held[] = {1, 5, 30, 400}; /* ticks of payload before the change */
    for (uint32_t h = 0; h < 4u; ++h) {
        setUp();
        wrench(w, torque);
        for (int k = 0; k < held[h]; ++k) {
            tick(INDEX_PAYLOAD);
            ASSERT_CLOSE(0.0, size_of(index_state.value), 1e-4);
        }
        tick(INDEX_RESIDUAL);
        ASSERT_CLOSE(0.0, size_of(index_state.value), 1e-4); /* no step at the change */
        for (int m = 1; m < 300; ++m) {
            tick(INDEX_RESIDUAL);
            for (uint32_t i = 0; i < N; ++i) {
                ASSERT_CLOSE(torque[i] * (1.0 - pow(DECAY, m)), value_of(index_state.value[i]), 3e-4);
            }
        }
    }
}

static void test_no_change_of_task_makes_a_jump_while_the_payload_is_explained(void) {
    const double w[6] = {0.0, 0.0, -24.5, 0.3, -0.2, 0.1};
    random_start(65);
    wrench(w, torque);
    for (int k = 0; k < 2000; ++k) { /* from the first tick on, so in the transient too */
        tick((random_one() > 0.0) ? INDEX_PAYLOAD : INDEX_CONTACT);
        ASSERT_CLOSE(0.0, size_of(index_state.value), 2e-4);
    }
}

/* Contact, then none, then payload, which does not explain a force across gravity: it appears only as fast as the
 * observer could have seen it since the contact ended. */
static void test_what_fades_goes_on_fading_through_further_changes(void) {
    const double w[6] = {0.0, 25.0, 0.0, 0.0, 0.0, 0.0};
    wrench(w, torque);
    for (int k = 0; k < 400; ++k) {
        tick(INDEX_CONTACT);
    }
    double whole[N];
    index_t other = {0};
    index_step(&other, &config, INDEX_PAYLOAD, robot, &motion, &observer, acceleration);
    for (uint32_t i = 0; i < N; ++i) {
        whole[i] = value_of(other.value[i]);
    }
    TEST_ASSERT_TRUE(size_of(other.value) > 1.0);
    for (int m = 0; m < 100; ++m) {
        tick((m < 3) ? INDEX_RESIDUAL : INDEX_PAYLOAD);
        for (uint32_t i = 0; (m >= 3) && (i < N); ++i) {
            ASSERT_CLOSE(whole[i] * (1.0 - pow(DECAY, m)), value_of(index_state.value[i]), 3e-4);
        }
    }
}

static void test_switching_back_and_forth_each_tick_makes_no_jump(void) {
    const double w[6] = {0.0, 0.0, -24.5, 0.3, -0.2, 0.1};
    const index_kind_t others[] = {INDEX_RESIDUAL, INDEX_CONTACT};
    for (uint32_t o = 0; o < 2u; ++o) {
        setUp();
        wrench(w, torque);
        tick(INDEX_PAYLOAD);
        for (int k = 0; k < 1000; ++k) {
            tick((k % 2 == 0) ? others[o] : INDEX_PAYLOAD);
            ASSERT_CLOSE(0.0, size_of(index_state.value), 2e-4);
        }
    }
}

/* Whatever the tasks do: what none of them explains is in the index at its full size. */
static void test_no_change_of_task_hides_a_collision(void) {
    const index_kind_t kinds[] = {INDEX_RESIDUAL, INDEX_PAYLOAD, INDEX_CONTACT};
    const double w[6] = {0.0, 0.0, -15.0, 0.1, 0.1, 0.1};
    double push[N], held[N];
    random_start(66);
    unexplained_by_all(1.0, push); /* unit vector */
    wrench(w, held);
    for (int every = 1; every <= 16; every *= 2) {
        setUp();
        index_kind_t kind = INDEX_PAYLOAD;
        for (int k = 0; k < 600; ++k) {
            const double size = (k < 100) ? 0.0 : 6.0;
            for (uint32_t i = 0; i < N; ++i) {
                torque[i] = held[i] + size * push[i];
            }
            if (k % every == 0) {
                kind = kinds[(uint32_t)(1.4999 * (random_one() + 1.0))];
            }
            tick(kind);
            double seen = 0.0;
            for (uint32_t i = 0; i < N; ++i) {
                seen += push[i] * value_of(index_state.value[i]);
            }
            ASSERT_CLOSE((k < 100) ? 0.0 : 6.0 * (1.0 - pow(DECAY, k - 99)), seen, 1e-3);
        }
    }
}

static void test_after_a_restart_of_the_observer_nothing_fades(void) {
    const double w[6] = {0.0, 0.0, -19.62, 0.0, 0.0, 0.0};
    wrench(w, torque);
    for (int k = 0; k < 100; ++k) {
        tick(INDEX_PAYLOAD);
    }
    tick(INDEX_RESIDUAL);
    memset(observer.residual, 0, sizeof(observer.residual));
    observer.decay = NUM(0);
    step(INDEX_RESIDUAL);
    TEST_ASSERT_TRUE(size_of(index_state.value) == 0.0);
    TEST_ASSERT_TRUE(size_of(index_state.fading) == 0.0);
}

static void test_a_gap_lets_what_fades_fade_as_far(void) {
    const double w[6] = {0.0, 0.0, -19.62, 0.0, 0.0, 0.0};
    wrench(w, torque);
    for (int k = 0; k < 400; ++k) {
        tick(INDEX_PAYLOAD);
    }
    tick(INDEX_RESIDUAL);
    observer.decay = num_of(pow(DECAY, 4.0)); /* r is what it was: the torque acts on */
    step(INDEX_RESIDUAL);
    for (uint32_t i = 0; i < N; ++i) {
        ASSERT_CLOSE(torque[i] * (1.0 - pow(DECAY, 4.0)), value_of(index_state.value[i]), 3e-4);
    }
}

static void test_a_filtered_basis_at_rest_is_the_instantaneous_one(void) {
    const double r[N] = {3.0, -8.0, 2.0, 7.0, -1.0, 2.0, 0.5};
    num_t instantaneous[N];
    set_residual(r);
    acceleration.x = NUM(2);
    step(INDEX_PAYLOAD);
    memcpy(instantaneous, index_state.value, sizeof(instantaneous));
    config.basis = (uint32_t)BASIS_FILTERED;
    index_init(&index_state);
    observer.decay = NUM(0); /* the observer's own first sample */
    for (int k = 0; k < 200; ++k) {
        step(INDEX_PAYLOAD);
        observer.decay = num_of(DECAY);
        for (uint32_t i = 0; i < N; ++i) {
            ASSERT_CLOSE(value_of(instantaneous[i]), value_of(index_state.value[i]), 1e-4);
        }
    }
}

static void test_a_filtered_basis_is_the_average_that_the_residual_is(void) {
    double sum = 0.0, weight = 0.0;
    config.basis = (uint32_t)BASIS_FILTERED;
    for (int k = 0; k < 150; ++k) {
        move_to(0.004 * k);
        observer.decay = (k == 0) ? NUM(0) : num_of(DECAY);
        step(INDEX_CONTACT);
        if (k > 0) { /* the first sample only sets p(0): it is not in r */
            sum = DECAY * sum + (1.0 - DECAY) * value_of(motion.jacobian[0][0]);
            weight = DECAY * weight + (1.0 - DECAY);
            ASSERT_CLOSE(sum / weight, value_of(index_state.column[0][0]), 1e-5);
        }
    }
}

static void test_a_filtered_basis_explains_a_constant_force_on_a_moving_arm(void) {
    const double w[6] = {25.0, -10.0, 15.0, 0.5, 1.0, -0.5};
    const basis_kind_t bases[] = {BASIS_INSTANTANEOUS, BASIS_FILTERED};
    double leak[2] = {0.0, 0.0};
    for (uint32_t b = 0; b < 2u; ++b) {
        setUp();
        config.basis = (uint32_t)bases[b];
        for (int k = 1; k < 400; ++k) {
            move_to(0.002 * k - 0.4); /* 2 rad/s */
            wrench(w, torque);
            tick(INDEX_CONTACT);
            leak[b] = fmax(leak[b], size_of(index_state.value));
        }
    }
    TEST_ASSERT_TRUE(leak[0] > 0.02);
    TEST_ASSERT_TRUE(leak[1] < 1e-3);
}

static void test_a_filtered_basis_starts_again_at_a_change_of_task(void) {
    config.basis = (uint32_t)BASIS_FILTERED;
    for (int k = 0; k < 50; ++k) {
        move_to(0.004 * k);
        tick(INDEX_PAYLOAD);
    }
    tick(INDEX_CONTACT);
    for (uint32_t i = 0; i < N; ++i) {
        for (uint32_t axis = 0; axis < 3u; ++axis) {
            TEST_ASSERT_TRUE(index_state.column[axis][i] == motion.jacobian[axis][i]);
        }
    }
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
    RUN_TEST(test_a_payload_that_stays_when_the_task_says_none_appears_with_the_observers_lag);
    RUN_TEST(test_no_change_of_task_makes_a_jump_while_the_payload_is_explained);
    RUN_TEST(test_what_fades_goes_on_fading_through_further_changes);
    RUN_TEST(test_switching_back_and_forth_each_tick_makes_no_jump);
    RUN_TEST(test_no_change_of_task_hides_a_collision);
    RUN_TEST(test_after_a_restart_of_the_observer_nothing_fades);
    RUN_TEST(test_a_gap_lets_what_fades_fade_as_far);
    RUN_TEST(test_a_filtered_basis_at_rest_is_the_instantaneous_one);
    RUN_TEST(test_a_filtered_basis_is_the_average_that_the_residual_is);
    RUN_TEST(test_a_filtered_basis_explains_a_constant_force_on_a_moving_arm);
    RUN_TEST(test_a_filtered_basis_starts_again_at_a_change_of_task);
    return UNITY_END();
}
