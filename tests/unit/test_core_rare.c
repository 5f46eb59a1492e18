/* Cases of the core that hardly any matrix or motion reaches. Intrusive: bidiagonal.c and sight.c are included, so that
 * their steps can be called with the state in which they matter. */
#include "detector.h"
#include "explained.h"
#include "jacobi.h"
#include "lever.h"
#include "regressor.h"
#include "soft.h"

#define bidiagonal_square      included_square
#define bidiagonal_diagonalise included_diagonalise
#define bidiagonal_rotate_back included_rotate_back
#include "bidiagonal.h"
#undef BIDIAGONAL_MAX_SWEEPS
#define BIDIAGONAL_MAX_SWEEPS 1u
#include "../../firmware/core/bidiagonal.c"

#define sight_init included_sight_init
#define sight_step included_sight_step
#include "../../firmware/core/sight.c"

#include "core_fixture.h"
#include "robots.h"

static uint32_t saturations;

void setUp(void) {
    saturations = 0;
}
void tearDown(void) {
    TEST_ASSERT_EQUAL(0, saturations);
}

static void test_a_late_sweep_has_no_shift_where_a_small_row_stands_before_a_large_last_one(void) {
    bidiagonal_t b = {.rows = 4u, .diagonal = {NUM(2), NUM(2), NUM(2), NUM(1)}};
    const block_t block = {.first = 0u, .last = 3u};
    TEST_ASSERT_TRUE(wants_shift(&b, block, late_sweeps, &saturations));
    b.diagonal[0] = NUM(0.01);
    TEST_ASSERT_FALSE(wants_shift(&b, block, late_sweeps, &saturations));
    TEST_ASSERT_TRUE(wants_shift(&b, block, late_sweeps - 1u, &saturations));
    TEST_ASSERT_FALSE(wants_shift(&b, block, unshifted_sweeps - 1u, &saturations));
}

static void test_a_chase_that_restarts_keeps_the_shift_only_without_a_fill_in(void) {
    const num_wide_t shift = num_wide(NUM(0.5), NUM(0.5));
    const num_t negligible = NUM(0.001);
    bool lost = false;
    num_rotation_t right = restarted_chase(NUM(1), NUM(3), NUM(4), shift, false, negligible, &lost, &saturations);
    TEST_ASSERT_FALSE(lost);
    ASSERT_CLOSE(5.0, value_of(right.length), 1e-5); /* the unshifted rotation of (3, 4) */
    right = restarted_chase(NUM(0), NUM(3), NUM(4), shift, true, negligible, &lost, &saturations);
    TEST_ASSERT_FALSE(lost);
    const num_rotation_t none = num_rotation(NUM(1), NUM(0), &saturations);
    TEST_ASSERT_TRUE(right.sin != none.sin);
    for (uint32_t i = 0; i < 2u; ++i) { /* once lost, the shift stays lost */
        right = restarted_chase(NUM(1), NUM(3), NUM(4), shift, true, negligible, &lost, &saturations);
        TEST_ASSERT_TRUE(lost);
        TEST_ASSERT_TRUE(right.sin == none.sin);
    }
    right = restarted_chase(NUM(0), NUM(3), NUM(4), shift, true, negligible, &lost, &saturations);
    TEST_ASSERT_TRUE(lost); /* though this fill-in is nothing */
    TEST_ASSERT_TRUE(right.sin != none.sin);
}

static void test_a_matrix_that_wants_more_sweeps_than_there_are_is_not_done(void) {
    bidiagonal_t b = {.rows = 3u, .diagonal = {NUM(1), NUM(2), NUM(3)}, .above = {NUM(1), NUM(1)}};
    bidiagonal_path_t path;
    included_diagonalise(&b, NUM(0.005), true, &path, &saturations);
    TEST_ASSERT_FALSE(path.done);
    TEST_ASSERT_EQUAL(1, path.sweeps);
}

static void test_singular_values_come_sorted_from_columns_that_need_no_rotation(void) {
    num_t column[SUBSPACE_MAX_COLUMNS][ROBOT_MAX_JOINTS] = {{NUM(0.25)}, {NUM(0), NUM(0.5)}, {NUM(0), NUM(0), NUM(1)}};
    jacobi_t jacobi;
    jacobi_init(&jacobi);
    jacobi_hard(&jacobi, 7u, 3u, (const num_t(*)[ROBOT_MAX_JOINTS])column, NUM(0.005));
    ASSERT_CLOSE(1.0, value_of(jacobi.singular[0]), 1e-5);
    ASSERT_CLOSE(0.5, value_of(jacobi.singular[1]), 1e-5);
    ASSERT_CLOSE(0.25, value_of(jacobi.singular[2]), 1e-5);
    ASSERT_CLOSE(0.25, value_of(jacobi.smallest), 1e-5);
}

static void test_without_columns_a_first_projection_is_the_torque_itself(void) {
    const num_t tau[ROBOT_MAX_JOINTS] = {NUM(1), NUM(-2), NUM(3)};
    num_t rest[ROBOT_MAX_JOINTS], first[ROBOT_MAX_JOINTS];
    soft_t soft;
    soft_init(&soft);
    soft_step(&soft, 0u, 0, NUM(0.05));
    soft_reject(&soft, tau, rest, 1u, first);
    TEST_ASSERT_EQUAL_MEMORY(tau, rest, sizeof(tau));
    TEST_ASSERT_EQUAL_MEMORY(tau, first, sizeof(tau));
}

static void test_a_regressor_starts_again_after_a_gap_that_it_cannot_bridge(void) {
    static const uint32_t gaps[] = {0u, OBSERVER_MAX_GAP + 1u};
    regressor_config_t config = {.used = 1u};
    const observer_config_t gains = {.torque_sample = TORQUE_INSTANT};
    const acceleration_t acceleration = {.token = 1u};
    const num_t velocity[ROBOT_MAX_JOINTS] = {NUM(0)};
    observer_t observer;
    motion_t motion;
    observer_init(&observer);
    motion_init(&motion);
    motion_step(&motion, &robot_ku_dex, velocity, velocity);
    for (size_t i = 0; i < sizeof(gaps) / sizeof(gaps[0]); ++i) {
        regressor_t regressor;
        regressor_init(&regressor);
        regressor.torque[2] = NUM(5);
        observer.gap = gaps[i];
        regressor_step(&regressor, &config, &gains, &robot_ku_dex, &motion, &observer, &acceleration, velocity);
        TEST_ASSERT_TRUE(regressor.torque[2] == NUM(0));
    }
}

static void test_a_link_that_does_not_exist_is_the_first_one(void) {
    motion_t motion;
    motion_init(&motion);
    motion.watched = ROBOT_MAX_JOINTS;
    TEST_ASSERT_EQUAL(0, lever_link(&motion));
    motion.watched = ROBOT_MAX_JOINTS - 1u;
    TEST_ASSERT_EQUAL(ROBOT_MAX_JOINTS - 1u, lever_link(&motion));
}

static void test_an_excess_that_lasts_for_ever_stays_tripped(void) {
    const explained_config_t limits = {.force_max_n = NUM(1), .moment_max_nm = NUM(1)};
    const subspace_config_t config = {.order = ORDER_PROJECT_FIRST, .lever_m = NUM(0.1), .softness = NUM(0.05)};
    const index_config_t task = {.kind = INDEX_RESIDUAL};
    const acceleration_t acceleration = {.token = 1u};
    explained_t explained;
    index_t index;
    observer_t observer;
    explained_init(&explained);
    index_init(&index);
    observer_init(&observer);
    observer.residual[0] = NUM(5); /* above a limit of zero */
    explained.above = UINT32_MAX;
    explained_step(&explained, &limits, &config, 2u, &robot_ku_dex, &observer, &acceleration, &task, &index);
    TEST_ASSERT_TRUE(explained.tripped);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, explained.above);
}

static void test_a_shifted_rotation_of_a_row_that_begins_with_zero_is_none(void) {
    const num_rotation_t rotation = num_shifted_rotation(NUM(0), NUM(2), num_wide(NUM(1), NUM(1)), &saturations);
    TEST_ASSERT_TRUE(rotation.sin == 0);
}

static void test_channels_beyond_the_last_one_are_not_used(void) {
    bank_config_t config = {.channels = BANK_MAX_CHANNELS + 1u};
    detector_config_t task = {.channels = 0x1Fu, .debounce_ticks = 1u};
    const num_t one[ROBOT_MAX_JOINTS] = {NUM(1)};
    bank_t bank;
    detector_t detector;
    for (uint32_t c = 0; c < BANK_MAX_CHANNELS; ++c) {
        config.channel[c].in[0] = NUM(1);
        task.threshold_nm[c][0] = NUM(0.5);
    }
    bank_init(&bank);
    detector_init(&detector);
    bank_step(&bank, &config, 1u, 1u, one, one, 1u);
    detector_step(&detector, &task, 1u, &bank);
    TEST_ASSERT_TRUE(detector.channel[0] < BANK_MAX_CHANNELS);
    TEST_ASSERT_TRUE(detector.tripped);
}

/* An offset along one axis alone, and a twist by a right angle of either sign, against a joint that is a millionth off
 * and so takes no shortcut. */
static void test_a_joint_moves_the_same_whatever_shortcut_its_twist_and_offset_allow(void) {
    num_t q[ROBOT_MAX_JOINTS], qd[ROBOT_MAX_JOINTS];
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        q[i] = num_of(0.3 * i - 1.0);
        qd[i] = num_of(0.5 - 0.2 * i);
    }
    for (uint32_t kind = 0; kind < 8u; ++kind) {
        robot_t robot = robot_ku_dex;
        motion_t motion, reference;
        const uint32_t axis = kind % 4u; /* 3: no offset */
        robot.joint[2].offset = (vec3_t){.x = (axis == 0u) ? NUM(0.5) : NUM(0),
                                         .y = (axis == 1u) ? NUM(0.5) : NUM(0),
                                         .z = (axis == 2u) ? NUM(0.5) : NUM(0)};
        robot.joint[2].cos_twist = NUM(0);
        robot.joint[2].sin_twist = (kind < 4u) ? NUM(1) : NUM(-1);
        motion_init(&motion);
        motion_init(&reference);
        motion_step(&motion, &robot, q, qd);
        robot.joint[2].cos_twist = NUM(1e-6);
        robot.joint[2].offset.x += NUM(1e-6);
        robot.joint[2].offset.y += NUM(1e-6);
        robot.joint[2].offset.z += NUM(1e-6);
        motion_step(&reference, &robot, q, qd);
        for (uint32_t i = 0; i < 7u; ++i) {
            ASSERT_CLOSE(value_of(reference.gravity[i]), value_of(motion.gravity[i]), 3e-4);
            ASSERT_CLOSE(value_of(reference.momentum[i]), value_of(motion.momentum[i]), 3e-4);
            ASSERT_CLOSE(value_of(reference.coriolis[i]), value_of(motion.coriolis[i]), 3e-4);
            for (uint32_t row = 0; row < MOTION_TWIST_ROWS; ++row) {
                ASSERT_CLOSE(value_of(reference.jacobian[row][i]), value_of(motion.jacobian[row][i]), 3e-5);
            }
        }
    }
}

static void test_a_force_counts_in_a_watched_channel_of_what_is_unexplained_alone(void) {
    const sight_config_t config = {.force_n = NUM(100)};
    const num_t per_newton[ROBOT_MAX_JOINTS] = {NUM(0.5)};
    bank_config_t bank = {.channels = BANK_MAX_CHANNELS + 1u};
    detector_config_t task = {.channels = 1u};
    for (uint32_t c = 0; c < BANK_MAX_CHANNELS; ++c) {
        bank.channel[c].of = CHANNEL_UNEXPLAINED;
        task.threshold_nm[c][0] = NUM(1);
    }
    TEST_ASSERT_TRUE(is_seen(&config, 1u, &bank, &task, per_newton));
    task.channels = 0u;
    TEST_ASSERT_FALSE(is_seen(&config, 1u, &bank, &task, per_newton));
    task.channels = 1u;
    bank.channel[0].high_pass[0] = NUM(0.01);
    TEST_ASSERT_FALSE(is_seen(&config, 1u, &bank, &task, per_newton));
    bank.channel[0].high_pass[0] = NUM(0);
    bank.channel[0].of = CHANNEL_SUDDEN;
    TEST_ASSERT_FALSE(is_seen(&config, 1u, &bank, &task, per_newton));
}

static void test_a_force_is_seen_in_the_last_channel_and_in_none_behind_it(void) {
    static struct {
        bank_config_t bank;
        channel_config_t behind;
    } all; /* a channel of zeros behind the bank */
    const sight_config_t config = {.force_n = NUM(100)};
    num_t per_newton[ROBOT_MAX_JOINTS] = {NUM(0.5)};
    detector_config_t task = {.channels = 0x08u};
    for (uint32_t c = 0; c < BANK_MAX_CHANNELS; ++c) {
        all.bank.channel[c].of = CHANNEL_UNEXPLAINED;
        task.threshold_nm[c][0] = NUM(1);
        task.threshold_nm[c][1] = NUM(1);
    }
    all.bank.channels = BANK_MAX_CHANNELS;
    TEST_ASSERT_TRUE(is_seen(&config, 1u, &all.bank, &task, per_newton));
    all.bank.channels = BANK_MAX_CHANNELS - 1u;
    TEST_ASSERT_FALSE(is_seen(&config, 1u, &all.bank, &task, per_newton));
    all.bank.channels = BANK_MAX_CHANNELS + 1u;
    task.channels = 0x10u;
    all.behind.of = CHANNEL_UNEXPLAINED;
    TEST_ASSERT_FALSE(is_seen(&config, 1u, &all.bank, &task, per_newton));
    task.channels = 1u;
    per_newton[0] = NUM(0);
    per_newton[1] = NUM(0.5); /* of a joint that the arm does not have */
    TEST_ASSERT_FALSE(is_seen(&config, 1u, &all.bank, &task, per_newton));
    TEST_ASSERT_TRUE(is_seen(&config, 2u, &all.bank, &task, per_newton));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_late_sweep_has_no_shift_where_a_small_row_stands_before_a_large_last_one);
    RUN_TEST(test_a_chase_that_restarts_keeps_the_shift_only_without_a_fill_in);
    RUN_TEST(test_a_matrix_that_wants_more_sweeps_than_there_are_is_not_done);
    RUN_TEST(test_singular_values_come_sorted_from_columns_that_need_no_rotation);
    RUN_TEST(test_without_columns_a_first_projection_is_the_torque_itself);
    RUN_TEST(test_a_regressor_starts_again_after_a_gap_that_it_cannot_bridge);
    RUN_TEST(test_a_link_that_does_not_exist_is_the_first_one);
    RUN_TEST(test_an_excess_that_lasts_for_ever_stays_tripped);
    RUN_TEST(test_a_shifted_rotation_of_a_row_that_begins_with_zero_is_none);
    RUN_TEST(test_channels_beyond_the_last_one_are_not_used);
    RUN_TEST(test_a_joint_moves_the_same_whatever_shortcut_its_twist_and_offset_allow);
    RUN_TEST(test_a_force_counts_in_a_watched_channel_of_what_is_unexplained_alone);
    RUN_TEST(test_a_force_is_seen_in_the_last_channel_and_in_none_behind_it);
    return UNITY_END();
}
