/* firmware/schedule: any state, any frame, any block that config_check accepts. */
#include "proof.h"

#include "e2e.c"
#include "lockstep.c"
#include "messages.c"
#include "protocol.c"
#include "schedule.c"

static const uint64_t last_us = UINT64_MAX - 10000000u; /* of the caller's clock: 584,000 years */

static schedule_t any_schedule(void) {
    schedule_t schedule;
    ASSUME((schedule.period_us >= 250u) && (schedule.period_us <= 50000u) && (schedule.grace_us <= 25000u));
    ASSUME(schedule.lockstep.period_us == schedule.period_us);
    ASSUME(schedule.lockstep.steps <= LOCKSTEP_MAX_STEP);
    return schedule;
}

void proof_schedule_init(void) {
    guard_config_t config;
    schedule_t schedule;
    bool refused, in_lockstep;
    uint64_t now_us;
    ASSUME(now_us < last_us);
    schedule_init(&schedule, refused ? 0 : &config, in_lockstep, now_us);
    HOLDS(schedule.grace_us <= schedule.period_us / 2u, "the tolerance is at most half a period");
    HOLDS(schedule.due_us >= now_us, "the first tick is not in the past");
    REACHED;
}

void proof_schedule_hear(void) {
    schedule_t schedule = any_schedule();
    can_frame_t frame;
    uint64_t now_us;
    schedule_hear(&schedule, &frame, now_us);
    HOLDS(schedule.lockstep.steps <= LOCKSTEP_MAX_STEP, "a frame advances time by a bounded number of cycles");
    REACHED;
}

void proof_schedule_ticks(void) {
    schedule_t schedule = any_schedule();
    bool complete, fresh;
    uint64_t now_us;
    (void)schedule_owes_tick(&schedule);
    (void)schedule_complete(&schedule, complete);
    (void)schedule_is_due(&schedule, now_us);
    (void)schedule_time(&schedule, now_us);
    schedule_ticked(&schedule, now_us, fresh);
    REACHED;
}

/* One cycle never gets two ticks because it is complete. */
void proof_complete_once(void) {
    schedule_t schedule = any_schedule();
    ASSUME(schedule_complete(&schedule, true));
    HOLDS(!schedule_complete(&schedule, true), "a complete cycle gets one tick");
    REACHED;
}
