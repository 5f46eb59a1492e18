#include "names.h"

#include <stddef.h>

#include "guard.h"

static const char *pick(const char *const *names, size_t count, uint32_t number) {
    return (number < count) ? names[number] : "Unknown";
}

const char *state_name(uint32_t state) {
    return pick(guard_state_name, GUARD_STATE_COUNT, state);
}

const char *reason_name(uint32_t reason) {
    return pick(guard_reason_name, GUARD_REASON_COUNT, reason);
}

const char *task_name(uint32_t task) {
    return pick(guard_task_name, TASK_COUNT, task);
}
