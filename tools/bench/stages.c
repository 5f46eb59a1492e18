/* stages: the instructions of each stage of the core over random states: for each task of the block, and for each index
 * with a bank of three second-order channels and with a single channel.
 */
#include "guard.h"
#include "report.h"
#include "states.h"

#define STATES 10000u
/* Of the cases that are not tasks of the block. All states where they take seconds. */
#if defined(__ARM_FP) && !defined(TAUPERP_FIXED)
#define INDEX_STATES STATES
#else
#define INDEX_STATES 2000u
#endif
#define SEED 20240229u

extern const guard_config_t board_config;

enum {
    STAGE_MOTION,
    STAGE_OBSERVER,
    STAGE_INDEX,
    STAGE_EXPLAINED,
    STAGE_BANK,
    STAGE_DETECTOR,
    STAGE_TOTAL,
    STAGE_COUNT
};

static const char *const STAGE_NAMES[STAGE_COUNT] = {"motion", "observer", "index", "explained",
                                                     "bank",   "detector", "total"};

static guard_t core; /* only its stages are used */

static void step(const bench_state_t *state, const guard_config_t *config, const task_config_t *task, tally_t tally[]) {
    const robot_t *const robot = &config->robot;
    uint32_t spent[STAGE_COUNT] = {0};

    stretch_begin();
    motion_step(&core.motion, robot, state->position, state->velocity);
    spent[STAGE_MOTION] = stretch_end();
    observer_step(&core.observer, &config->observer, robot->joint_count, &core.motion, state->torque, 1u);
    spent[STAGE_OBSERVER] = stretch_end();
    acceleration_step(&core.acceleration, &config->acceleration, &config->observer, &core.observer, robot, &core.motion,
                      state->velocity, state->acceleration, task->limits.mass_max_kg);
    regressor_step(&core.regressor, &config->regressor, &config->observer, robot, &core.motion, &core.observer,
                   &core.acceleration, state->velocity);
    index_step(&core.index, &config->subspace, &task->index, robot, &core.motion, &core.observer, &core.acceleration,
               &core.regressor);
    spent[STAGE_INDEX] = stretch_end();
    explained_step(&core.explained, &task->limits, &config->subspace, task->detector.debounce_ticks, robot,
                   &core.observer, &core.acceleration, &task->index, &core.index);
    spent[STAGE_EXPLAINED] = stretch_end();
    bank_step(&core.bank, &config->bank, robot->joint_count, core.observer.gap, core.index.unexplained,
              core.index.sudden, core.explained.token);
    spent[STAGE_BANK] = stretch_end();
    detector_step(&core.detector, &task->detector, robot->joint_count, &core.bank);
    spent[STAGE_DETECTOR] = stretch_end();

    for (uint32_t stage = 0; stage < STAGE_TOTAL; ++stage) {
        spent[STAGE_TOTAL] += spent[stage];
        tally_add(&tally[stage], spent[stage]);
    }
    tally_add(&tally[STAGE_TOTAL], spent[STAGE_TOTAL]);
}

static void count_task(const char *name, uint32_t states, const guard_config_t *config, const task_config_t *task,
                       uint32_t columns) {
    tally_t tally[STAGE_COUNT] = {{0}};
    uint32_t deficient = 0;
    random_t random = {SEED};
    bench_state_t state = {0};
    motion_init(&core.motion);
    observer_init(&core.observer);
    acceleration_init(&core.acceleration);
    regressor_init(&core.regressor);
    index_init(&core.index);
    explained_init(&core.explained);
    bank_init(&core.bank);
    detector_init(&core.detector);
    observer_step(&core.observer, &config->observer, config->robot.joint_count, &core.motion, state.torque, 0u);
    for (uint32_t i = 0; i < states; ++i) {
        (void)states_next(&state, config, &random, i);
        step(&state, config, task, tally);
        deficient += (core.index.rank < columns) ? 1u : 0u;
    }
    for (uint32_t stage = 0; stage < STAGE_COUNT; ++stage) {
        report_tally(name, STAGE_NAMES[stage], &tally[stage]);
    }
    report_deficient(name, deficient);
}

typedef struct {
    const char *name[2]; /* with the bank, with a single channel */
    index_kind_t kind;
    uint32_t components;
    uint32_t columns;
} case_t;

static void count_index(const case_t *one) {
    static guard_config_t config;
    static const uint32_t channels[2] = {3u, 1u};
    config = board_config;
    config.regressor.used = (one->kind == INDEX_REGRESSOR) ? 1u : 0u;
    for (uint32_t g = 0; g < OBSERVER_MAX_GAP; ++g) { /* any stable filter costs the same */
        config.regressor.low_pass.own[g] = NUM(0.9);
        config.regressor.low_pass.in[g] = NUM(2);
    }
    task_config_t *const task = &config.task[TASK_CONTACT];
    task->index.kind = (uint32_t)one->kind;
    task->index.components = one->components;
    task->index.fast = 0;
    for (uint32_t i = 0; i < 2u; ++i) {
        config.bank.channels = channels[i];
        task->detector.channels = (1u << channels[i]) - 1u;
        count_task(one->name[i], INDEX_STATES, &config, task, one->columns);
    }
}

int main(void) {
    static const case_t cases[] = {{{"d_p", "d_p_one"}, INDEX_PAYLOAD, 0u, 5u},
                                   {{"d_e", "d_e_one"}, INDEX_CONTACT, INDEX_ALL_COMPONENTS, 6u},
                                   {{"d_f", "d_f_one"}, INDEX_CONTACT, 0x7u, 3u}, /* three forces */
                                   {{"d_r", "d_r_one"}, INDEX_REGRESSOR, 0u, REGRESSOR_COLUMNS}};
    const guard_config_t *const config = &board_config;
    stretch_init();
    count_task("none", STATES, config, &config->task[TASK_NONE], 0u);
    count_task("payload", STATES, config, &config->task[TASK_PAYLOAD], 5u);
    count_task("contact", STATES, config, &config->task[TASK_CONTACT], 6u);
    for (uint32_t i = 0; i < (sizeof(cases) / sizeof(cases[0])); ++i) {
        count_index(&cases[i]);
    }
    return 0;
}
