#include "machine.h"

#include <stddef.h>

#define STATE(name, member)                                                                                            \
    {name, (uint32_t)offsetof(machine_t, guard.member), sizeof(((machine_t *)0)->guard.member), false}
#define TABLE(name, member)                                                                                            \
    {name, (uint32_t)offsetof(machine_t, config.member), sizeof(((machine_t *)0)->config.member), true}

/* All of guard_t except the pointer to the block: a fault in it would only crash this process. */
const part_t machine_part[] = {
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
    STATE("plausibility", plausibility),
    STATE("rise", rise),
    STATE("evaluated", evaluated),
    STATE("stage_token", stage_token),
    STATE("settled_cycles", settled_cycles),
    STATE("task", task),
    STATE("task_cycles", task_cycles),
    STATE("trip", trip),
    STATE("last_tick_us", last_tick_us),
    STATE("healthy_since_us", healthy_since_us),
    STATE("standing_ticks", standing_ticks),
    STATE("self_test", self_test_step),
    STATE("healthy", healthy),
    STATE("ticked", ticked),
    STATE("over_budget", over_budget),
    STATE("calm", calm),
    STATE("acknowledged", acknowledged),
    STATE("start_cause", start_cause),
    STATE("restarts", restarts),
    STATE("variant", variant),
    STATE("watch", watch),
    STATE("counters", counters),
    STATE("report", report),
    {"block.header", (uint32_t)offsetof(machine_t, config), (uint32_t)offsetof(guard_config_t, observer), true},
    TABLE("block.observer", observer),
    TABLE("block.bank", bank),
    TABLE("block.subspace", subspace),
    TABLE("block.acceleration", acceleration),
    TABLE("block.regressor", regressor),
    TABLE("block.sensor", sensor),
    TABLE("block.task", task),
    TABLE("block.robot", robot),
};
const uint32_t machine_parts = sizeof(machine_part) / sizeof(machine_part[0]);

void machine_moved(machine_t *self) {
    self->guard.config = &self->config;
}

bool machine_init(machine_t *self, const guard_config_t *block) {
    self->config = *block;
    if (guard_init(&self->guard, &self->config) != GUARD_OK) {
        return false;
    }
    guard_note_start(&self->guard, GUARD_START_POWER_ON, 0u, GUARD_VARIANT_PRODUCT);
    return true;
}
