/* firmware/guard/config_bounds.c: any block. */
#include "num_stub.h"

#include "config_bounds.c"
#include "sensor.c"

static bool answer_robot, answer_bank, answer_regressor;
static guard_status_t answer_tasks;
static uint32_t reaction_us;

bool robot_is_valid(const robot_t *robot) {
    ASSUME(!answer_robot || ((robot->joint_count >= 1u) && (robot->joint_count <= ROBOT_MAX_JOINTS)));
    return answer_robot;
}

bool bank_is_valid(const guard_config_t *config) {
    (void)config;
    return answer_bank;
}

bool regressor_is_valid(const guard_config_t *config) {
    (void)config;
    return answer_regressor;
}

guard_status_t check_tasks(const guard_config_t *config) {
    (void)config;
    return answer_tasks;
}

uint32_t config_reaction_us(const guard_config_t *config) {
    (void)config;
    return reaction_us;
}

/* No accepted block has a longer reaction than the stated time. proof_reaction_fits shows that the time itself
 * is computed without overflow. */
void proof_accepted_block_reacts_in_time(void) {
    guard_config_t block;
    __CPROVER_havoc_object(&answer_robot);
    __CPROVER_havoc_object(&answer_bank);
    __CPROVER_havoc_object(&answer_regressor);
    __CPROVER_havoc_object(&answer_tasks);
    __CPROVER_havoc_object(&reaction_us);
    if (config_bounds_check(&block) == GUARD_OK) {
        HOLDS(reaction_us <= CONFIG_REACTION_MAX_US, "the stated reaction time");
        HOLDS(answer_robot && answer_bank && answer_regressor && (answer_tasks == GUARD_OK), "every part is valid");
        HOLDS((block.period_us >= CONFIG_PERIOD_MIN_US) && (block.period_us <= CONFIG_PERIOD_MAX_US), "period");
        HOLDS(block.sync_deadline_us <= CONFIG_INPUT_MAX_US, "deadline of Sync");
        HOLDS(block.joint_deadline_us <= CONFIG_MAX_GAP * block.period_us, "deadline of the snapshot");
        HOLDS(block.task_deadline_us <= CONFIG_INPUT_MAX_US, "deadline of the task");
        HOLDS(block.tick_deadline_us <= CONFIG_TICK_MAX_US, "deadline of the tick");
        HOLDS((block.subspace.tolerance > 0) && (block.subspace.tolerance <= NUM(0.1)), "index.c relies on it");
        HOLDS((block.subspace.lever_m > 0) && (block.subspace.lever_m <= NUM(1)), "index.c relies on it");
        HOLDS((block.subspace.softness > 0) && (block.subspace.softness <= NUM(0.2)), "explained.c relies on it");
        for (uint32_t g = 0; g < OBSERVER_MAX_GAP; ++g) {
            HOLDS((block.observer.decay[g] > 0) && (block.observer.decay[g] < NUM(1)) && (block.observer.gain[g] > 0) &&
                      (block.observer.gain[g] < NUM(1)) && (block.observer.momentum_gain[g] > 0) &&
                      (block.observer.momentum_gain[g] <= NUM(500)),
                  "observer.c and acceleration.c rely on the constants");
        }
        HOLDS((block.subspace.projector == (uint32_t)PROJECTOR_HARD) || (block.subspace.tolerance >= NUM(SOFT_MIN)),
              "soft.c relies on it");
        HOLDS((block.stop_collision <= 2u) && (block.stop_input <= 1u) && (block.stop_fault <= 1u), "stop categories");
    }
    REACHED;
}
