#include "schedule.h"

#include <stddef.h>

void schedule_init(schedule_t *self, const guard_config_t *config, bool in_lockstep, uint64_t now_us) {
    const uint32_t period_us = (config != NULL) ? config->period_us : SCHEDULE_REFUSED_PERIOD_US;
    const uint32_t deadline_us = (config != NULL) ? config->tick_deadline_us : SCHEDULE_REFUSED_DEADLINE_US;
    const uint32_t over_us = (deadline_us > period_us) ? ((deadline_us - period_us) / 2u) : 0u;
    const uint32_t half_us = period_us / 2u;
    *self = (schedule_t){.period_us = period_us,
                         .tick_deadline_us = deadline_us,
                         .grace_us = (over_us < half_us) ? over_us : half_us,
                         .in_lockstep = in_lockstep,
                         .due_us = in_lockstep ? (now_us + LOCKSTEP_SILENCE_US) : now_us,
                         .lockstep = {.period_us = period_us}};
}

void schedule_hear(schedule_t *self, const can_frame_t *frame, uint64_t now_us) {
    if (self->in_lockstep) {
        lockstep_hear(&self->lockstep, frame);
        self->due_us = now_us + LOCKSTEP_SILENCE_US;
    }
}

bool schedule_owes_tick(schedule_t *self) {
    return self->in_lockstep && lockstep_owes_tick(&self->lockstep);
}

bool schedule_complete(schedule_t *self, bool complete) {
    const bool now = complete && !self->was_complete;
    self->was_complete = complete;
    return now && (!self->in_lockstep || lockstep_complete(&self->lockstep));
}

bool schedule_is_due(schedule_t *self, uint64_t now_us) {
    if (now_us < self->due_us) {
        return false;
    }
    if (!self->in_lockstep) {
        return true;
    }
    self->due_us = now_us + LOCKSTEP_SILENCE_US;
    return lockstep_silence(&self->lockstep);
}

uint64_t schedule_time(const schedule_t *self, uint64_t now_us) {
    return self->in_lockstep ? self->lockstep.now_us : now_us;
}

void schedule_ticked(schedule_t *self, uint64_t began_us, bool fresh) {
    if (!self->in_lockstep) {
        self->due_us = began_us + self->period_us + (fresh ? self->grace_us : 0u);
    }
}
