/* guard_any: any configuration block that config_check accepts, and any state of a guard that its own functions can
 * produce, as far as a harness relies on either. proof_guard_invariant in proof_guard.c shows that a tick preserves it.
 */
#ifndef TAUPERP_GUARD_ANY_H
#define TAUPERP_GUARD_ANY_H

#include "config_bounds.h"
#include "guard_parts.h"
#include "proof.h"

static inline void assume_block(const guard_config_t *config) {
    ASSUME((config->robot.joint_count >= 1u) && (config->robot.joint_count <= ROBOT_MAX_JOINTS));
    ASSUME((config->format == (uint32_t)FORMAT_CLASSIC) || (config->format == (uint32_t)FORMAT_FD));
    ASSUME((config->period_us >= CONFIG_PERIOD_MIN_US) && (config->period_us <= CONFIG_PERIOD_MAX_US));
    ASSUME((config->sync_deadline_us >= config->period_us) && (config->sync_deadline_us <= CONFIG_INPUT_MAX_US));
    ASSUME((config->joint_deadline_us >= config->period_us) && (config->joint_deadline_us <= CONFIG_INPUT_MAX_US));
    ASSUME((config->task_deadline_us >= config->period_us) && (config->task_deadline_us <= CONFIG_INPUT_MAX_US));
    ASSUME((config->tick_deadline_us >= config->period_us) && (config->tick_deadline_us <= CONFIG_TICK_MAX_US));
    ASSUME(config->settling_us <= CONFIG_SLOWEST_SETTLING_US);
    ASSUME(config->reset_healthy_us <= CONFIG_HEALTHY_MAX_US);
    ASSUME((config->stop_collision <= 2u) && (config->stop_input <= 1u) && (config->stop_fault <= 1u));
    ASSUME((config->bank.channels >= 1u) && (config->bank.channels <= BANK_MAX_CHANNELS));
}

/* The conditions that supervise checks at the beginning of the tick, and those that the stages guarantee. */
static inline bool guard_is_sound(const guard_t *self) {
    bool sound = (self->joints == self->config->robot.joint_count) && (self->state == ~self->state_inverted) &&
                 (self->state >= (uint32_t)GUARD_STATE_SELF_TEST) && (self->state <= (uint32_t)GUARD_STATE_FAULT) &&
                 (self->detector.joint < ROBOT_MAX_JOINTS) && (self->rise.joint < ROBOT_MAX_JOINTS) &&
                 (self->plausibility.joint < ROBOT_MAX_JOINTS) && (self->explained.joint < ROBOT_MAX_JOINTS) &&
                 (self->explained.excess >= EXPLAINED_NOTHING) && (self->explained.excess <= EXPLAINED_RESIDUAL) &&
                 (self->index.columns <= SUBSPACE_MAX_COLUMNS) && (self->task < (uint32_t)TASK_COUNT) &&
                 (self->inputs.task_number < (uint8_t)TASK_COUNT) && (self->task == ~self->task_inverted) &&
                 (self->inputs.task_number == ~self->inputs.task_number_inverted) && (self->rise.snapshots <= 3u) &&
                 (self->inputs.window_cycles <= 127u) &&
                 (self->inputs.snapshot.expected == ((1u << self->joints) - 1u));
    sound = sound && (!self->explained.tripped || (self->explained.excess != EXPLAINED_NOTHING)) &&
            (self->inputs.fault != (uint32_t)GUARD_REASON_NONE) &&
            (self->plausibility.fault != (uint32_t)GUARD_REASON_NONE);
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        sound = sound && (self->detector.channel[i] < BANK_MAX_CHANNELS);
    }
    return sound;
}

static guard_config_t any_block;

static inline void any_guard(guard_t *self) {
    __CPROVER_havoc_object(&any_block);
    assume_block(&any_block);
    __CPROVER_havoc_object(self);
    self->config = &any_block;
    ASSUME(guard_is_sound(self));
}

#endif
