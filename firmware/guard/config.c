#include "config.h"

#include <stddef.h>

#include "crc32.h"
#include "protocol.h"

/* First byte that the CRC covers. */
#define COVERED offsetof(guard_config_t, numeric)

static bool crc_matches(const guard_config_t *config) {
    const uint8_t *const bytes = (const uint8_t *)config;
    const uint32_t length = (uint32_t)(sizeof(*config) - COVERED);
    return crc32_finish(crc32_fold(CRC32_START, bytes + COVERED, length)) == config->crc;
}

static guard_status_t check_identity(const guard_config_t *config) {
    if (config->magic != CONFIG_MAGIC) {
        return GUARD_BAD_MAGIC;
    }
    if (config->schema != CONFIG_SCHEMA) {
        return GUARD_BAD_SCHEMA;
    }
    if (config->size != (uint32_t)sizeof(*config)) {
        return GUARD_BAD_SIZE;
    }
    if (!crc_matches(config)) {
        return GUARD_BAD_CRC;
    }
    if (config->numeric != NUM_NUMERIC) {
        return GUARD_BAD_NUMERIC;
    }
    return (config->wire == PROTOCOL_WIRE_CRC) ? GUARD_OK : GUARD_BAD_WIRE;
}

static bool timing_holds(const guard_config_t *config) {
    const uint32_t period = config->period_us;
    const bool format = (config->format == (uint32_t)FORMAT_CLASSIC) || (config->format == (uint32_t)FORMAT_FD);
    const bool deadlines = (config->sync_deadline_us >= period) && (config->joint_deadline_us >= period) &&
                           (config->task_deadline_us >= period) && (config->tick_deadline_us >= period);
    /* A gap longer than the observer can bridge must have ended the permission by then. */
    const bool bridged = config->joint_deadline_us / CONFIG_MAX_GAP <= period;
    return (period > 0u) && format && deadlines && bridged && (config->tick_budget_us > 0u) &&
           (config->reset_healthy_us > 0u);
}

static bool observer_holds(const observer_config_t *observer) {
    bool holds =
        (observer->torque_sample == (uint32_t)TORQUE_INTERVAL) || (observer->torque_sample == (uint32_t)TORQUE_INSTANT);
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) {
        uint32_t saturations = 0;
        const num_t sum = num_add(observer->decay[g], observer->gain[g], &saturations);
        holds = holds && (observer->decay[g] > NUM(0)) && (observer->gain[g] > NUM(0)) && (sum > NUM(0.99999)) &&
                (sum < NUM(1.00001)) && (observer->momentum_gain[g] > NUM(0)) && num_finite(observer->momentum_gain[g]);
    }
    return holds;
}

static bool subspace_holds(const subspace_config_t *subspace) {
    const bool basis =
        (subspace->basis == (uint32_t)BASIS_INSTANTANEOUS) || (subspace->basis == (uint32_t)BASIS_FILTERED);
    return basis && (subspace->tolerance > NUM(0)) && num_finite(subspace->tolerance) && (subspace->lever_m > NUM(0)) &&
           num_finite(subspace->lever_m);
}

static bool stop_holds(const guard_config_t *config) {
    return (config->stop_collision <= 2u) && (config->stop_input <= 2u) && (config->stop_fault <= 2u);
}

static guard_status_t check_task(const task_config_t *task, uint32_t joints) {
    bool holds = (task->index <= (uint32_t)INDEX_CONTACT) && (task->debounce_ticks > 0u);
    for (uint32_t i = 0; i < joints; ++i) {
        holds = holds && (task->threshold_nm[i] > NUM(0)) && num_finite(task->threshold_nm[i]);
    }
    if (!holds) {
        return GUARD_BAD_TASK;
    }
    if ((task->index == (uint32_t)INDEX_CONTACT) && (joints < CONFIG_CONTACT_MIN_JOINTS)) {
        return GUARD_CONTACT_NEEDS_7_JOINTS;
    }
    if ((task->index == (uint32_t)INDEX_PAYLOAD) && (joints < CONFIG_PAYLOAD_MIN_JOINTS)) {
        return GUARD_PAYLOAD_NEEDS_6_JOINTS;
    }
    return GUARD_OK;
}

static guard_status_t check_tasks(const guard_config_t *config) {
    bool any = false;
    if (config->task[TASK_INVALID].index != (uint32_t)INDEX_OFF) {
        return GUARD_BAD_TASK;
    }
    for (uint32_t t = TASK_NONE; t < (uint32_t)TASK_COUNT; ++t) {
        if (config->task[t].index != (uint32_t)INDEX_OFF) {
            const guard_status_t status = check_task(&config->task[t], config->robot.joint_count);
            if (status != GUARD_OK) {
                return status;
            }
            any = true;
        }
    }
    return any ? GUARD_OK : GUARD_BAD_TASK;
}

guard_status_t config_check(const guard_config_t *config) {
    guard_status_t status = check_identity(config);
    if (status == GUARD_OK) {
        if (!robot_holds(&config->robot)) {
            status = GUARD_BAD_ROBOT;
        } else if (!timing_holds(config)) {
            status = GUARD_BAD_TIMING;
        } else if (!observer_holds(&config->observer)) {
            status = GUARD_BAD_OBSERVER;
        } else if (!subspace_holds(&config->subspace)) {
            status = GUARD_BAD_SUBSPACE;
        } else if (!stop_holds(config)) {
            status = GUARD_BAD_STOP;
        } else if (!sensor_holds(&config->sensor)) {
            status = GUARD_BAD_SENSOR;
        } else {
            status = check_tasks(config);
        }
    }
    return status;
}

void config_watch_start(config_watch_t *self) {
    *self = (config_watch_t){.offset = COVERED, .crc = CRC32_START};
}

bool config_watch_step(config_watch_t *self, const guard_config_t *config) {
    if ((self->offset < COVERED) || (self->offset >= sizeof(*config))) {
        return false;
    }
    const uint32_t left = (uint32_t)sizeof(*config) - self->offset;
    const uint32_t length = (left < CONFIG_WATCH_BYTES) ? left : CONFIG_WATCH_BYTES;
    self->crc = crc32_fold(self->crc, (const uint8_t *)config + self->offset, length);
    self->offset += length;
    bool intact = (config->magic == CONFIG_MAGIC) && (config->schema == CONFIG_SCHEMA) &&
                  (config->size == (uint32_t)sizeof(*config));
    if (self->offset == sizeof(*config)) {
        intact = intact && (crc32_finish(self->crc) == config->crc);
        config_watch_start(self);
    }
    return intact;
}
