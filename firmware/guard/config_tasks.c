#include "config_parts.h"

/* An index of the payload, or one that this file does not know: the bounds of the payload apply. */
static bool is_of_payload(const index_config_t *index) {
    return (index->kind != (uint32_t)INDEX_RESIDUAL) && (index->kind != (uint32_t)INDEX_CONTACT);
}

static bool limits_are_valid(const guard_config_t *config, const task_config_t *task) {
    const explained_config_t *const limits = &task->limits;
    uint32_t saturations = 0;
    bool valid = true;
    for (uint32_t i = 0; i < config->robot.joint_count; ++i) {
        const num_t torque_max = config->robot.joint[i].torque_max_nm;
        valid = valid && is_up_to(limits->residual_max_nm[i] / (int32_t)CONFIG_RESIDUAL_SHARE, torque_max);
    }
    if (is_of_payload(&task->index)) {
        valid = valid && is_up_to(limits->mass_max_kg, NUM(CONFIG_MASS_MAX_KG)) &&
                is_zero_up_to(limits->arm_max_m, NUM(CONFIG_ARM_MAX_M)) &&
                is_up_to(limits->force_slack_n, NUM(CONFIG_FORCE_SLACK_MAX_N)) &&
                is_up_to(limits->moment_slack_nm, NUM(CONFIG_MOMENT_SLACK_MAX_NM));
    } else if (task->index.kind == (uint32_t)INDEX_CONTACT) {
        valid = valid && is_up_to(limits->force_max_n, NUM(EXPLAINED_FORCE_LIMIT)) &&
                is_up_to(limits->moment_max_nm,
                         num_mul(NUM(EXPLAINED_FORCE_LIMIT + 1), config->subspace.lever_m, &saturations));
    } else {
        /* nothing is explained */
    }
    return valid && is_up_to(config->acceleration.force_floor_n, NUM(CONFIG_FORCE_FLOOR_MAX_N)) &&
           is_up_to(config->acceleration.error_max, NUM(CONFIG_ERROR_MAX_M_S2));
}
static bool detector_is_valid(const guard_config_t *config, const detector_config_t *detector) {
    const uint32_t debounce_us =
        (detector->debounce_ticks <= 1000u) ? (detector->debounce_ticks * config->period_us) : UINT32_MAX;
    bool valid = (detector->debounce_ticks >= 1u) && (debounce_us <= CONFIG_DEBOUNCE_MAX_US) &&
                 (detector->channels != 0u) && ((detector->channels >> config->bank.channels) == 0u);
    for (uint32_t c = 0; c < config->bank.channels; ++c) {
        for (uint32_t i = 0; i < config->robot.joint_count; ++i) {
            const num_t most = config->robot.joint[i].torque_max_nm / (int32_t)CONFIG_THRESHOLD_SHARE;
            valid = valid && (((detector->channels & (1u << c)) == 0u) || is_up_to(detector->threshold_nm[c][i], most));
        }
    }
    return valid;
}

/* A constant force must be detected: at least one channel has no high-pass. */
static bool sees_static_force(const guard_config_t *config, const detector_config_t *detector) {
    bool sees = false;
    for (uint32_t c = 0; c < config->bank.channels; ++c) {
        const channel_config_t *const channel = &config->bank.channel[c];
        const bool watched = (detector->channels & (1u << c)) != 0u;
        sees = sees || (watched && (channel->of == (uint32_t)CHANNEL_UNEXPLAINED) && (channel->high_pass[0] == NUM(0)));
    }
    return sees;
}

/* Perpendicular axes of unit length, so that a coefficient is a force in N. */
static bool axes_are_valid(const index_config_t *index) {
    bool valid = true;
    for (uint32_t a = 0; a < 3u; ++a) {
        valid = valid && is_zero_up_to(num_abs(index->point[a]), NUM(CONFIG_POINT_MAX_M));
        for (uint32_t b = 0; b < 3u; ++b) {
            valid = valid && is_zero_up_to(num_abs(index->axis[a][b]), NUM(1.0001));
        }
    }
    for (uint32_t a = 0; valid && (a < 3u); ++a) {
        for (uint32_t b = a; b < 3u; ++b) {
            uint32_t saturations = 0;
            const num_t inner = num_narrow(num_wide(index->axis[a][0], index->axis[b][0]) +
                                               num_wide(index->axis[a][1], index->axis[b][1]) +
                                               num_wide(index->axis[a][2], index->axis[b][2]),
                                           &saturations);
            valid = valid && is_near(inner, (a == b) ? NUM(1) : NUM(0), NUM(1e-4));
        }
    }
    return valid;
}

static bool has_no_axes(const index_config_t *index) {
    bool none = true;
    for (uint32_t a = 0; a < 3u; ++a) {
        none = none && (index->point[a] == NUM(0)) && (index->axis[a][0] == NUM(0)) && (index->axis[a][1] == NUM(0)) &&
               (index->axis[a][2] == NUM(0));
    }
    return none;
}

static bool index_is_valid(const guard_config_t *config, const index_config_t *index) {
    if (index->kind != (uint32_t)INDEX_CONTACT) {
        return (index->kind < (uint32_t)INDEX_KIND_COUNT) && (index->components == 0u) && (index->fast == 0u) &&
               (index->frame == (uint32_t)FRAME_TIP) && has_no_axes(index);
    }
    const bool soft = config->subspace.projector == (uint32_t)PROJECTOR_SOFT;
    const bool components = (index->components != 0u) && ((index->components & ~INDEX_ALL_COMPONENTS) == 0u) &&
                            ((index->fast & ~index->components) == 0u) && (soft || (index->fast == 0u));
    const bool framed = (index->frame <= (uint32_t)FRAME_TOOL) && axes_are_valid(index);
    return components && ((index->frame == (uint32_t)FRAME_TIP) ? has_no_axes(index) : framed);
}

/* A task with fast components uses a channel of `sudden`. No other task does. */
static bool sudden_is_watched(const guard_config_t *config, const task_config_t *task) {
    bool watched = false;
    for (uint32_t c = 0; c < config->bank.channels; ++c) {
        const bool sudden = config->bank.channel[c].of == (uint32_t)CHANNEL_SUDDEN;
        watched = watched || (sudden && ((task->detector.channels & (1u << c)) != 0u));
    }
    return watched == (task->index.fast != 0u);
}

static uint32_t count_bits(uint32_t bits) {
    uint32_t count = 0;
    for (uint32_t i = 0; i < INDEX_COMPONENTS; ++i) {
        count += (bits >> i) & 1u;
    }
    return count;
}

static guard_status_t check_task(const guard_config_t *config, const task_config_t *task) {
    const uint32_t joints = config->robot.joint_count;
    if (!index_is_valid(config, &task->index) || !detector_is_valid(config, &task->detector) ||
        !sudden_is_watched(config, task)) {
        return GUARD_BAD_TASK;
    }
    if ((task->index.kind == (uint32_t)INDEX_CONTACT) && (joints <= count_bits(task->index.components))) {
        return GUARD_CONTACT_NEEDS_JOINTS;
    }
    if (is_of_payload(&task->index) && (joints < CONFIG_PAYLOAD_MIN_JOINTS)) {
        return GUARD_PAYLOAD_NEEDS_6_JOINTS;
    }
    if (!limits_are_valid(config, task)) {
        return GUARD_BAD_LIMITS;
    }
    return sees_static_force(config, &task->detector) ? GUARD_OK : GUARD_BAD_BANK;
}

guard_status_t check_tasks(const guard_config_t *config) {
    bool any = false;
    if (config->task[TASK_INVALID].index.kind != (uint32_t)INDEX_OFF) {
        return GUARD_BAD_TASK;
    }
    for (uint32_t t = TASK_NONE; t < (uint32_t)TASK_COUNT; ++t) {
        if (config->task[t].index.kind != (uint32_t)INDEX_OFF) {
            const guard_status_t status = check_task(config, &config->task[t]);
            if (status != GUARD_OK) {
                return status;
            }
            any = true;
        }
    }
    return any ? GUARD_OK : GUARD_BAD_TASK;
}
