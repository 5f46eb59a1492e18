/* Intrusive: this program contains its own self-test, in which one answer of one stage can be wrong. The self-test must
 * fail on each of them, and pass where an answer is off by less than its tolerance. */
#define self_test_step spoiled_self_test_step /* the function, and the field of guard_t */
#include "core_fixture.h"
#include "crc32.h"
#include "guard_parts.h"

/* Number of the answer that is wrong; 0: none. Each of them is wrong by `error`. */
static int wrong;
static double error;
static unsigned checks, projections, bounds_asked, steps; /* calls since the start */

static void spoil(int number, num_t *answer) {
    if (wrong == number) {
        *answer = *answer + num_of(error);
    }
}

static uint32_t other_finish(uint32_t crc) {
    return crc32_finish(crc) ^ ((wrong == 1) ? 1u : 0u);
}

static e2e_status_t other_check(e2e_receiver_t *receiver, const uint8_t *data, uint8_t length, const uint8_t *ids,
                                uint8_t max_delta) {
    const e2e_status_t status = e2e_check(receiver, data, length, ids, max_delta);
    ++checks;
    return ((wrong >= 2) && (wrong <= 4) && (checks == (unsigned)wrong - 1u)) ? E2E_REPEATED : status;
}

static void other_hard(projection_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS],
                       num_t tolerance, const num_t tau[], num_t rest[]) {
    projection_hard(self, n, k, column, tolerance, tau, rest);
    ++projections;
    const int first = (projections == 1u) ? 10 : 20;
    self->rank += (wrong == first) ? 1u : 0u;
    spoil(first + 1, &rest[0]);
    spoil(first + 2, &rest[1]);
    spoil(first + 3, &rest[2]);
    spoil((projections == 1u) ? 0 : 24, &self->smallest);
}

static void other_soft(projection_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t s,
                       const num_t tau[], num_t rest[], uint32_t first, num_t first_rest[]) {
    projection_soft(self, n, k, column, s, tau, rest, first, first_rest);
    spoil(30, &rest[0]);
    spoil(31, &rest[1]);
    spoil(32, &self->smallest);
}

static void other_motion(motion_t *self, const robot_t *robot, const num_t q[], const num_t qd[]) {
    motion_step(self, robot, q, qd);
    if (robot->joint_count == 1u) { /* the pendulum */
        spoil(40, &self->gravity[0]);
        spoil(41, &self->momentum[0]);
        spoil(42, &self->coriolis[0]);
        spoil(43, &self->jacobian[0][0]);
        spoil(44, &self->jacobian[2][0]);
    }
}

static void other_explained(explained_t *self, const explained_config_t *bounds, const subspace_config_t *config,
                            uint32_t debounce, const robot_t *robot, const observer_t *observer,
                            const acceleration_t *acceleration, const index_config_t *task, const index_t *index) {
    explained_step(self, bounds, config, debounce, robot, observer, acceleration, task, index);
    ++bounds_asked;
    if (bounds_asked == 1u) {
        spoil(50, &self->coefficient[0]);
        self->tripped = self->tripped && (wrong != 51);
        self->excess = (wrong == 52) ? EXPLAINED_MOMENT : self->excess;
    } else {
        self->tripped = self->tripped || (wrong == 53);
    }
}

static void other_stages(guard_t *self, const task_config_t *task, const snapshot_t *snapshot, uint32_t gap,
                         vec3_t acceleration) {
    stages_step(self, task, snapshot, gap, acceleration);
    ++steps;
    for (uint32_t i = 0; i < self->joints; ++i) {
        spoil((steps == 2u) ? (60 + (int)i) : -1, &self->observer.residual[i]); /* the first that is checked */
        self->detector.above[i] =
            (wrong == 70 + (int)i) ? (task->detector.debounce_ticks - 1u) : self->detector.above[i];
        self->detector.value_nm[i] = (wrong == 80 + (int)i) ? NUM(0) : self->detector.value_nm[i];
    }
    self->detector.tripped = self->detector.tripped && (wrong != 90);
}

#define crc32_finish    other_finish
#define e2e_check       other_check
#define projection_hard other_hard
#define projection_soft other_soft
#define motion_step     other_motion
#define explained_step  other_explained
#define stages_step     other_stages
#define is_near         self_test_is_near
#define rest            self_test_rest
#include "../../firmware/guard/guard_self_test.c"
#undef crc32_finish
#undef e2e_check
#undef motion_step
#undef explained_step
#undef is_near
#undef rest
#include "guard_fixture.h"

static bench_t bench;

void setUp(void) {
    start(&bench);
    wrong = 0;
    error = 0.0;
    checks = projections = bounds_asked = steps = 0;
}
void tearDown(void) {}

/* The whole self-test. */
static self_test_t tested(void) {
    self_test_t verdict = SELF_TEST_RUNNING;
    for (uint32_t i = 0; (i < 200u) && (verdict == SELF_TEST_RUNNING); ++i) {
        verdict = spoiled_self_test_step(&bench.guard);
    }
    return verdict;
}

static self_test_t verdict_of(int answer, double by) {
    setUp();
    wrong = answer;
    error = by;
    return tested();
}

static void assert_tolerance(int first, int last, double tolerance) {
    for (int answer = first; answer <= last; ++answer) {
        TEST_ASSERT_EQUAL(SELF_TEST_PASSED, verdict_of(answer, 0.8 * tolerance));
        TEST_ASSERT_EQUAL(SELF_TEST_PASSED, verdict_of(answer, -0.8 * tolerance));
        TEST_ASSERT_EQUAL(SELF_TEST_FAILED, verdict_of(answer, 1.2 * tolerance));
        TEST_ASSERT_EQUAL(SELF_TEST_FAILED, verdict_of(answer, -1.2 * tolerance));
    }
}

static void assert_failures(int first, int last) {
    for (int answer = first; answer <= last; ++answer) {
        TEST_ASSERT_EQUAL(SELF_TEST_FAILED, verdict_of(answer, 0.0));
    }
}

static void test_right_answers_pass(void) {
    TEST_ASSERT_EQUAL(SELF_TEST_PASSED, verdict_of(0, 0.0));
}

static void test_a_wrong_crc_or_check_of_a_frame_fails(void) {
    assert_failures(1, 4);
}

static void test_a_wrong_projection_fails(void) {
    assert_failures(10, 10);
    assert_tolerance(11, 13, 1e-4);
    assert_failures(20, 20);
    assert_tolerance(21, 24, 1e-4);
    assert_tolerance(30, 32, 1e-4);
}

static void test_a_wrong_dynamic_term_fails(void) {
    assert_tolerance(40, 44, 1e-4);
}

/* 1 Nm over 0.5 m, less what the soft estimate leaves: 1.85 N within 0.2 N. */
static void test_a_limit_that_does_not_answer_fails(void) {
    TEST_ASSERT_EQUAL(SELF_TEST_PASSED, verdict_of(50, 0.04));
    TEST_ASSERT_EQUAL(SELF_TEST_PASSED, verdict_of(50, -0.3));
    TEST_ASSERT_EQUAL(SELF_TEST_FAILED, verdict_of(50, 0.1));
    TEST_ASSERT_EQUAL(SELF_TEST_FAILED, verdict_of(50, -0.36));
    assert_failures(51, 53);
}

/* A push of the torque limit L: r within L / 128 + 0.01 Nm. */
static void test_a_residual_of_any_joint_that_is_off_fails(void) {
    static const double most[JOINTS] = {200.0, 200.0, 120.0, 120.0, 60.0, 40.0, 40.0};
    for (int i = 0; i < (int)JOINTS; ++i) {
        assert_tolerance(60 + i, 60 + i, most[i] / 128.0 + 0.01);
    }
}

/* 40 / 128 + 0.01 = 0.3225 Nm. */
static void test_the_tolerance_of_a_residual_is_sharp(void) {
    TEST_ASSERT_EQUAL(SELF_TEST_PASSED, verdict_of(66, 0.3215));
    TEST_ASSERT_EQUAL(SELF_TEST_FAILED, verdict_of(66, 0.3235));
}

static void test_an_arm_of_eight_joints_passes(void) {
    const guard_config_t config = make_config_of_eight();
    start_with(&bench, &config);
    TEST_ASSERT_EQUAL(SELF_TEST_PASSED, tested());
}

static void test_a_detector_that_misses_a_joint_fails(void) {
    assert_failures(70, 76);
    assert_failures(80, 86);
    assert_failures(90, 90);
}

/* The known answers, the arm at rest, and 64 steps more than the debounce of 2 ticks. */
static void test_the_chain_has_64_steps_to_rise(void) {
    setUp();
    wrong = 90;
    uint32_t calls = 1;
    while (spoiled_self_test_step(&bench.guard) == SELF_TEST_RUNNING) {
        ++calls;
    }
    TEST_ASSERT_EQUAL(1u + 1u + 64u + 2u, calls);
    TEST_ASSERT_EQUAL(1u + 64u + 2u, steps);
}

/* An observer that takes the sample at the Sync has risen by another share in its first step. */
static void test_an_observer_of_samples_passes_as_well(void) {
    guard_config_t config = make_config();
    config.observer.torque_sample = TORQUE_INSTANT;
    seal_config(&config);
    start_with(&bench, &config);
    run_until(&bench, GUARD_REASON_AWAITING_RESET);
    start_with(&bench, &config);
    wrong = 60;
    error = -(200.0 / 128.0 + 0.01) * 0.8;
    TEST_ASSERT_EQUAL(SELF_TEST_PASSED, tested());
}

/* Tasks that are off have no thresholds: the first configured one lends its own. */
static void test_the_first_configured_task_lends_its_thresholds(void) {
    guard_config_t config = make_config();
    config.task[TASK_NONE].index = (index_config_t){0};
    config.task[TASK_PAYLOAD].index = (index_config_t){0};
    config.task[TASK_NONE].detector.debounce_ticks = 1000u;
    config.task[TASK_CONTACT].detector.debounce_ticks = 5u;
    seal_config(&config);
    start_with(&bench, &config);
    TEST_ASSERT_EQUAL(5u, chain_task(&config).detector.debounce_ticks);
    TEST_ASSERT_EQUAL(INDEX_RESIDUAL, chain_task(&config).index.kind);
    config.task[TASK_CONTACT].index = (index_config_t){0};
    config.task[TASK_COUNT - 1u].index.kind = INDEX_RESIDUAL;
    config.task[TASK_COUNT - 1u].detector.debounce_ticks = 7u;
    TEST_ASSERT_EQUAL(7u, chain_task(&config).detector.debounce_ticks);
}

static void test_an_installation_without_the_first_task_passes(void) {
    guard_config_t config = make_config();
    config.task[TASK_NONE].index.kind = INDEX_OFF;
    seal_config(&config);
    start_with(&bench, &config);
    TEST_ASSERT_EQUAL(SELF_TEST_PASSED, tested());
}

/* The block's check refuses it. The search ends at the last row. */
static void test_a_block_that_lost_its_tasks_ends_the_self_test(void) {
    for (uint32_t t = 0; t < TASK_COUNT; ++t) {
        bench.config.task[t].index.kind = INDEX_OFF;
    }
    TEST_ASSERT_NOT_EQUAL(SELF_TEST_RUNNING, tested());
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_right_answers_pass);
    RUN_TEST(test_a_wrong_crc_or_check_of_a_frame_fails);
    RUN_TEST(test_a_wrong_projection_fails);
    RUN_TEST(test_a_wrong_dynamic_term_fails);
    RUN_TEST(test_a_limit_that_does_not_answer_fails);
    RUN_TEST(test_a_residual_of_any_joint_that_is_off_fails);
    RUN_TEST(test_a_detector_that_misses_a_joint_fails);
    RUN_TEST(test_the_chain_has_64_steps_to_rise);
    RUN_TEST(test_an_observer_of_samples_passes_as_well);
    RUN_TEST(test_the_first_configured_task_lends_its_thresholds);
    RUN_TEST(test_an_installation_without_the_first_task_passes);
    RUN_TEST(test_the_tolerance_of_a_residual_is_sharp);
    RUN_TEST(test_an_arm_of_eight_joints_passes);
    RUN_TEST(test_a_block_that_lost_its_tasks_ends_the_self_test);
    return UNITY_END();
}
