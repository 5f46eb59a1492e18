#include "parts.h"

#include <stddef.h>

#include "guard.h"

#define STATE(name, member) {name, (uint32_t)offsetof(guard_t, member), sizeof(((guard_t *)0)->member), false}
#define TABLE(name, member)                                                                                            \
    {name, (uint32_t)offsetof(guard_config_t, member), sizeof(((guard_config_t *)0)->member), true}

/* All of guard_t except the pointer to the block: a fault in it would only crash this process. */
static const part_t part[] = {
    STATE("joints", joints),
    STATE("state", state),
    STATE("state_inverted", state_inverted),
    STATE("inputs.receiver", inputs.receiver),
    STATE("inputs.errors", inputs.errors),
    STATE("inputs.repeats", inputs.repeats),
    STATE("inputs.repeated", inputs.repeated),
    STATE("inputs.snapshot", inputs.snapshot),
    STATE("inputs.sync", inputs.sync),
    STATE("inputs.joints", inputs.joints),
    STATE("inputs.task", inputs.task),
    STATE("inputs.completed_us", inputs.completed_us),
    STATE("inputs.window_start_us", inputs.window_start_us),
    STATE("inputs.window_cycles", inputs.window_cycles),
    STATE("inputs.window_started", inputs.window_started),
    STATE("inputs.clocks_agree", inputs.clocks_agree),
    STATE("inputs.task_cycle", inputs.task_cycle),
    STATE("inputs.acceleration", inputs.acceleration),
    STATE("inputs.task_number", inputs.task_number),
    STATE("inputs.task_number_inverted", inputs.task_number_inverted),
    STATE("inputs.fault_joint", inputs.fault_joint),
    STATE("inputs.fault", inputs.fault),
    STATE("inputs.request", inputs.request),
    STATE("inputs.edge", inputs.edge),
    STATE("inputs.requested_trip", inputs.requested_trip),
    STATE("motion", motion),
    STATE("observer", observer),
    STATE("acceleration", acceleration),
    STATE("regressor", regressor),
    STATE("index", index),
    STATE("explained", explained),
    STATE("bank", bank),
    STATE("detector", detector),
    STATE("sight", sight),
    STATE("contact", contact),
    STATE("plausibility", plausibility),
    STATE("rise", rise),
    STATE("evaluated", evaluated),
    STATE("stage_token", stage_token),
    STATE("settled_cycles", settled_cycles),
    STATE("task", task),
    STATE("task_inverted", task_inverted),
    STATE("task_cycles", task_cycles),
    STATE("trip", trip),
    STATE("last_tick_us", last_tick_us),
    STATE("healthy_since_us", healthy_since_us),
    STATE("standing_ticks", standing_ticks),
    STATE("self_test", self_test_step),
    STATE("self_test_remaining", self_test_remaining),
    STATE("healthy", healthy),
    STATE("ticked", ticked),
    STATE("over_budget", over_budget),
    STATE("tested", tested),
    STATE("second", second),
    STATE("calm", calm),
    STATE("acknowledged", acknowledged),
    STATE("start_cause", start_cause),
    STATE("restarts", restarts),
    STATE("variant", variant),
    STATE("saturations", saturations),
    STATE("company", company),
    STATE("agree", agree),
    STATE("watch", watch),
    STATE("counters", counters),
    STATE("report", report),
    {"block.header", 0u, (uint32_t)offsetof(guard_config_t, observer), true},
    TABLE("block.observer", observer),
    TABLE("block.bank", bank),
    TABLE("block.subspace", subspace),
    TABLE("block.acceleration", acceleration),
    TABLE("block.regressor", regressor),
    TABLE("block.sensor", sensor),
    TABLE("block.task", task),
    TABLE("block.robot", robot),
};

static void move(void *guard, const void *block) {
    guard_t *const self = guard;
    const uintptr_t row = (uintptr_t)self->explained.task;
    if (row != 0u) {
        self->explained.task = (const index_config_t *)(row - (uintptr_t)self->config + (uintptr_t)block);
    }
    self->config = block;
}

static void take_counts(void *guard, const void *other) {
    guard_t *const self = guard;
    const guard_t *const from = other;
    self->counters = from->counters;
    self->report.worst_tick_time_us = from->report.worst_tick_time_us;
    self->report.margin_us = from->report.margin_us;
}

#ifdef TAUPERP_SECOND
const layout_t *second_layout(void) {
#else
const layout_t *first_layout(void) {
#endif
    static const layout_t layout = {part, sizeof(part) / sizeof(part[0]), sizeof(guard_t), move, take_counts};
    return &layout;
}
