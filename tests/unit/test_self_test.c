/* The self-test notices each part that answers wrongly. This program contains its own self-test, in which one answer at
 * a time is changed after the part has computed it. */
#define self_test_step changed_self_test_step
#include "crc32.h"
#include "guard_parts.h"

typedef enum {
    NOTHING,
    CRC,
    E2E_FIRST,
    E2E_REFUSED,
    E2E_SECOND,
    EXPLAINED_RANK,
    EXPLAINED_0,
    EXPLAINED_1,
    EXPLAINED_2,
    KEPT_RANK,
    KEPT_0,
    KEPT_1,
    KEPT_2,
    KEPT_SMALLEST,
    SOFT_0,
    SOFT_1,
    SOFT_SMALLEST,
    GRAVITY,
    MOMENTUM,
    CORIOLIS,
    JACOBIAN_X,
    JACOBIAN_Z,
    LIMIT_MISSED,
    LIMIT_NAME,
    LIMIT_SIZE,
    LIMIT_TOO_SMALL,
    FIRST_RESIDUAL,
    LAST_RESIDUAL,
    NEVER_TRIPPED,
    FIRST_COUNT,
    LAST_COUNT,
    NO_INDEX,
    PARTS
} part_t;

static part_t broken;
static unsigned calls[PARTS];

static bool now(part_t part) {
    return broken == part;
}

static void add(num_t *value) {
    *value += NUM(0.05);
}

static uint32_t changed_crc32_finish(uint32_t crc) {
    return crc32_finish(crc) ^ (now(CRC) ? 1u : 0u);
}

static e2e_status_t changed_e2e_check(e2e_receiver_t *self, const uint8_t *data, uint8_t length, const uint8_t *ids,
                                      uint8_t max_delta) {
    const e2e_status_t status = e2e_check(self, data, length, ids, max_delta);
    const part_t part = (part_t)((unsigned)E2E_FIRST + calls[E2E_FIRST]);
    ++calls[E2E_FIRST];
    return now(part) ? E2E_SOME_LOST : status;
}

static void changed_projection_hard(projection_t *self, uint32_t rows, uint32_t k,
                                    const num_t column[][ROBOT_MAX_JOINTS], num_t tolerance, const num_t tau[],
                                    num_t rest[]) {
    projection_hard(self, rows, k, column, tolerance, tau, rest);
    const unsigned first = (calls[KEPT_RANK] == 0u) ? (unsigned)EXPLAINED_RANK : (unsigned)KEPT_RANK;
    ++calls[KEPT_RANK];
    if (now((part_t)first)) {
        ++self->rank;
    }
    for (unsigned i = 0; i < 3u; ++i) {
        if (now((part_t)(first + 1u + i))) {
            add(&rest[i]);
        }
    }
    if (now(KEPT_SMALLEST) && (first == (unsigned)KEPT_RANK)) {
        add(&self->smallest);
    }
}

static void changed_projection_soft(projection_t *self, uint32_t rows, uint32_t k,
                                    const num_t column[][ROBOT_MAX_JOINTS], num_t softness, const num_t tau[],
                                    num_t rest[], uint32_t first, num_t first_rest[]) {
    projection_soft(self, rows, k, column, softness, tau, rest, first, first_rest);
    for (unsigned i = 0; i < 2u; ++i) {
        if (now((part_t)((unsigned)SOFT_0 + i))) {
            add(&rest[i]);
        }
    }
    if (now(SOFT_SMALLEST)) {
        add(&self->smallest);
    }
}

static void changed_motion_step(motion_t *self, const robot_t *robot, const num_t q[], const num_t qd[]) {
    motion_step(self, robot, q, qd);
    num_t *const results[] = {&self->gravity[0], &self->momentum[0], &self->coriolis[0], &self->jacobian[0][0],
                              &self->jacobian[2][0]};
    for (unsigned i = 0; i < 5u; ++i) {
        if (now((part_t)((unsigned)GRAVITY + i))) {
            add(results[i]);
        }
    }
}

static void changed_explained_step(explained_t *self, const explained_config_t *limits,
                                   const subspace_config_t *subspace, uint32_t debounce_ticks, const robot_t *robot,
                                   const observer_t *observer, const acceleration_t *acceleration,
                                   const index_config_t *task, const index_t *index) {
    explained_step(self, limits, subspace, debounce_ticks, robot, observer, acceleration, task, index);
    const bool first = calls[LIMIT_MISSED] == 0u;
    ++calls[LIMIT_MISSED];
    if (first && now(LIMIT_MISSED)) {
        self->tripped = false;
    }
    if (first && now(LIMIT_NAME)) {
        self->excess = EXPLAINED_MOMENT;
    }
    if (first && now(LIMIT_SIZE)) {
        self->coefficient[0] += NUM(1);
    }
    if (!first && now(LIMIT_TOO_SMALL)) {
        self->tripped = true;
    }
}

static void changed_stages_step(guard_t *self, const task_config_t *task, const snapshot_t *snapshot, uint32_t gap,
                                vec3_t acceleration) {
    const uint32_t last = self->joints - 1u;
    stages_step(self, task, snapshot, gap, acceleration);
    if (now(FIRST_RESIDUAL)) {
        self->observer.residual[0] = NUM(-1);
    }
    if (now(LAST_RESIDUAL)) {
        self->observer.residual[last] = NUM(-1);
    }
    if (now(NEVER_TRIPPED)) {
        self->detector.tripped = false;
    }
    if (now(FIRST_COUNT)) {
        self->detector.above[0] = 0;
    }
    if (now(LAST_COUNT)) {
        self->detector.above[last] = 0;
    }
    if (now(NO_INDEX)) {
        self->detector.value_nm[last] = NUM(0);
    }
}

#define crc32_finish(crc)    changed_crc32_finish(crc)
#define e2e_check(...)       changed_e2e_check(__VA_ARGS__)
#define projection_hard(...) changed_projection_hard(__VA_ARGS__)
#define projection_soft(...) changed_projection_soft(__VA_ARGS__)
#define motion_step(...)     changed_motion_step(__VA_ARGS__)
#define explained_step(...)  changed_explained_step(__VA_ARGS__)
#define stages_step(...)     changed_stages_step(__VA_ARGS__)
#define is_near              self_test_is_near
#define rest                 self_test_rest
#include "../../firmware/guard/guard_self_test.c"
#undef crc32_finish
#undef motion_step
#undef is_near
#undef rest

#include "guard_fixture.h"

static bench_t bench;

void setUp(void) {
    broken = NOTHING;
    memset(calls, 0, sizeof(calls));
    start(&bench);
}
void tearDown(void) {}

static self_test_t test_whole(void) {
    self_test_t result = SELF_TEST_RUNNING;
    for (uint32_t i = 0; (i < START_LIMIT) && (result == SELF_TEST_RUNNING); ++i) {
        result = changed_self_test_step(&bench.guard);
    }
    return result;
}

static void test_a_guard_whose_parts_all_answer_passes(void) {
    TEST_ASSERT_EQUAL(SELF_TEST_PASSED, test_whole());
}

static void test_each_part_that_answers_wrongly_fails_the_self_test(void) {
    for (unsigned part = (unsigned)NOTHING + 1u; part < (unsigned)PARTS; ++part) {
        setUp();
        broken = (part_t)part;
        char name[16];
        snprintf(name, sizeof(name), "part %u", part);
        TEST_ASSERT_EQUAL_MESSAGE(SELF_TEST_FAILED, test_whole(), name);
    }
}

static void test_an_installation_without_the_first_task_is_tested_with_its_own(void) {
    guard_config_t config = make_config();
    config.task[TASK_NONE].index.kind = INDEX_OFF;
    seal_config(&config);
    start_with(&bench, &config);
    TEST_ASSERT_EQUAL(SELF_TEST_PASSED, test_whole());
}

/* The block's check refuses it. The search ends at the last row. */
static void test_a_block_that_lost_its_tasks_ends_the_self_test(void) {
    for (uint32_t t = 0; t < TASK_COUNT; ++t) {
        bench.config.task[t].index.kind = INDEX_OFF;
    }
    TEST_ASSERT_NOT_EQUAL(SELF_TEST_RUNNING, test_whole());
}

static void test_torque_sampled_at_one_instant_is_tested_with_its_own_mean(void) {
    guard_config_t config = make_config();
    config.observer.torque_sample = TORQUE_INSTANT;
    seal_config(&config);
    start_with(&bench, &config);
    TEST_ASSERT_EQUAL(SELF_TEST_PASSED, test_whole());
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_guard_whose_parts_all_answer_passes);
    RUN_TEST(test_each_part_that_answers_wrongly_fails_the_self_test);
    RUN_TEST(test_an_installation_without_the_first_task_is_tested_with_its_own);
    RUN_TEST(test_a_block_that_lost_its_tasks_ends_the_self_test);
    RUN_TEST(test_torque_sampled_at_one_instant_is_tested_with_its_own_mean);
    return UNITY_END();
}
