/* stages: the instructions of each stage of the core, for each task, over random states. */
#include "config.h"
#include "report.h"
#include "states.h"

#define STATES 10000u
#define SEED   20240229u

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

typedef struct {
    motion_t motion;
    observer_t observer;
    acceleration_t acceleration;
    regressor_t regressor;
    index_t index;
    explained_t explained;
    bank_t bank;
    detector_t detector;
} core_t;

static core_t core;

static void step(const bench_state_t *state, const task_config_t *task, tally_t tally[]) {
    const guard_config_t *const config = &board_config;
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

static void count_task(const char *name, const task_config_t *task, uint32_t columns) {
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
    observer_step(&core.observer, &board_config.observer, board_config.robot.joint_count, &core.motion, state.torque,
                  0u);
    for (uint32_t i = 0; i < STATES; ++i) {
        (void)states_next(&state, &board_config, &random, i);
        step(&state, task, tally);
        deficient += (core.index.rank < columns) ? 1u : 0u;
    }
    for (uint32_t stage = 0; stage < STAGE_COUNT; ++stage) {
        report_tally(name, STAGE_NAMES[stage], &tally[stage]);
    }
    report_deficient(name, deficient);
}

int main(void) {
    stretch_init();
    count_task("none", &board_config.task[TASK_NONE], 0u);
    count_task("payload", &board_config.task[TASK_PAYLOAD], 5u);
    count_task("contact", &board_config.task[TASK_CONTACT], 6u);
    return 0;
}
