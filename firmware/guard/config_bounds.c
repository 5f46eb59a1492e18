#include "config_bounds.h"

/* --- timing ------------------------------------------------------------------------------------------------------- */

static bool lies_within(uint32_t value, uint32_t least, uint32_t most) {
    return (value >= least) && (value <= most);
}

static bool timing_is_valid(const guard_config_t *config) {
    const uint32_t period = config->period_us;
    const bool format = (config->format == (uint32_t)FORMAT_CLASSIC) || (config->format == (uint32_t)FORMAT_FD);
    if (!format || !lies_within(period, CONFIG_PERIOD_MIN_US, CONFIG_PERIOD_MAX_US)) {
        return false;
    }
    const uint32_t input_cycles = CONFIG_INPUT_MAX_CYCLES * period;
    const uint32_t input = (input_cycles < CONFIG_INPUT_MAX_US) ? input_cycles : CONFIG_INPUT_MAX_US;
    const uint32_t tick_cycles = CONFIG_TICK_MAX_CYCLES * period;
    const uint32_t tick = (tick_cycles < CONFIG_TICK_MAX_US) ? tick_cycles : CONFIG_TICK_MAX_US;
    /* A gap longer than the observer can bridge must have ended the permission by then. */
    const bool deadlines = lies_within(config->sync_deadline_us, period, input) &&
                           lies_within(config->joint_deadline_us, period, CONFIG_MAX_GAP * period) &&
                           lies_within(config->task_deadline_us, period, input) &&
                           lies_within(config->tick_deadline_us, period, tick) &&
                           lies_within(config->tick_budget_us, 1u, period);
    const uint32_t dwell_us = (config->task_dwell_cycles < CONFIG_DWELL_MAX_US / CONFIG_PERIOD_MIN_US + 1u)
                                  ? (config->task_dwell_cycles * period)
                                  : UINT32_MAX;
    return deadlines && lies_within(dwell_us, CONFIG_DWELL_MIN_US, CONFIG_DWELL_MAX_US) &&
           lies_within(config->settling_us, period, CONFIG_SLOWEST_SETTLING_US) &&
           lies_within(config->reset_healthy_us, config->settling_us, CONFIG_HEALTHY_MAX_US);
}

/* --- observer ----------------------------------------------------------------------------------------------------- */

/* Microseconds up to CONFIG_PERIOD_MAX_US * CONFIG_MAX_GAP, in s. */
static num_t seconds(uint32_t us) {
    uint32_t saturations = 0;
    const num_t ms =
        num_add(num_from_int((int32_t)(us / 1000u)),
                num_div(num_from_int((int32_t)((us % 1000u) / 2u)), num_from_int(500), &saturations), &saturations);
    return num_div(ms, num_from_int(500), &saturations) / 2;
}

/* a^exponent for a from 0 to 1. */
static num_t power(num_t a, uint32_t exponent) {
    uint32_t saturations = 0;
    num_t square = a;
    num_t result = NUM(1);
    for (uint32_t rest = exponent; rest > 0u; rest >>= 1u) { /* at most 32 times */
        if ((rest & 1u) != 0u) {
            result = num_mul(result, square, &saturations);
        }
        square = num_mul(square, square, &saturations);
    }
    return result;
}

static bool is_near(num_t a, num_t b, num_t tolerance) {
    return num_abs(a - b) <= tolerance;
}

/* What each gap's constants must be, from those of one cycle and the period. */
static bool gap_is_valid(const guard_config_t *config, uint32_t g) {
    const observer_config_t *const observer = &config->observer;
    uint32_t saturations = 0;
    const num_t decay = observer->decay[g];
    const num_t gain = observer->gain[g];
    const bool in_range = (decay > NUM(0)) && (decay < NUM(1)) && (gain > NUM(0)) && (gain < NUM(1)) &&
                          (observer->momentum_gain[g] > NUM(0)) && (observer->momentum_gain[g] <= NUM(500));
    if (!in_range) {
        return false;
    }
    const num_t span = num_mul(observer->momentum_gain[g], seconds((g + 1u) * config->period_us), &saturations);
    return is_near(num_add(decay, gain, &saturations), NUM(1), NUM(1e-5)) &&
           is_near(decay, power(observer->decay[0], g + 1u), NUM(1e-4)) &&
           is_near(span, gain, num_mul(gain, NUM(0.01), &saturations));
}

static bool observer_is_valid(const guard_config_t *config) {
    const observer_config_t *const observer = &config->observer;
    bool valid =
        (observer->torque_sample == (uint32_t)TORQUE_INTERVAL) || (observer->torque_sample == (uint32_t)TORQUE_INSTANT);
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) {
        valid = valid && gap_is_valid(config, g);
    }
    /* Five time constants fit into the settling time, which bounds the gain from below: exp(-5) is 0.0067. */
    return valid && (power(observer->decay[0], config->settling_us / config->period_us) <= NUM(0.0075));
}

/* --- channels ----------------------------------------------------------------------------------------------------- */

/* A unit step of torque through one channel. */
typedef struct {
    uint32_t rise; /* cycles until the output is half of the step; UINT32_MAX: never within one second */
    num_t peak;    /* the largest output */
    num_t end;     /* after one second */
} response_t;

/* A bank with one channel and one joint, by the code that the guard runs. */
static response_t step_response(const guard_config_t *config, const channel_config_t *channel, bool project_first) {
    bank_config_t one = {.channels = 1u};
    bank_t bank;
    one.channel[0] = *channel;
    one.channel[0].of = (uint32_t)CHANNEL_UNEXPLAINED;
    bank_init(&bank);
    response_t response = {.rise = UINT32_MAX};
    num_t filtered = NUM(0);
    uint32_t saturations = 0;
    const uint32_t cycles = 1000000u / config->period_us; /* at most 4000 */
    for (uint32_t i = 0; i < cycles; ++i) {
        filtered =
            num_add(num_mul(config->observer.decay[0], filtered, &saturations), config->observer.gain[0], &saturations);
        const num_t input = project_first ? config->observer.gain[0] : filtered;
        bank_step(&bank, &one, 1u, 1u, &input, &input, 0u);
        const num_t output = bank.channel[0].output[0];
        if ((response.rise == UINT32_MAX) && (output >= NUM(0.5))) {
            response.rise = i + 1u;
        }
        response.peak = num_max(response.peak, output);
        response.end = output;
    }
    return response;
}

static bool constants_are_bounded(const channel_config_t *channel) {
    bool bounded = true;
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) {
        bounded = bounded && (num_abs(channel->own[g]) <= NUM(1)) && (num_abs(channel->cross[g]) <= NUM(1)) &&
                  (num_abs(channel->back[g]) <= NUM(1)) && (num_abs(channel->stay[g]) <= NUM(1)) &&
                  (num_abs(channel->in[g]) <= NUM(16)) && (num_abs(channel->in_back[g]) <= NUM(16)) &&
                  (channel->high_pass[g] >= NUM(0)) && (channel->high_pass[g] < NUM(1));
    }
    return bounded;
}

/* A channel neither amplifies a step much nor forgets it at once; without a high-pass it ends at the step's size. */
static bool channel_is_valid(const guard_config_t *config, const channel_config_t *constants, bool project_first) {
    if (!constants_are_bounded(constants)) {
        return false;
    }
    const response_t response = step_response(config, constants, project_first);
    const bool is_static = constants->high_pass[0] == NUM(0);
    /* A channel of `sudden` without a high-pass would take an intended moment that stays for a collision. */
    const bool of =
        (constants->of == (uint32_t)CHANNEL_UNEXPLAINED) || ((constants->of == (uint32_t)CHANNEL_SUDDEN) && !is_static);
    return of && (response.rise != UINT32_MAX) && (response.peak <= NUM(1.3)) &&
           (!is_static || is_near(response.end, NUM(1), NUM(0.03)));
}

static bool orders_by_projection(const guard_config_t *config) {
    return config->subspace.order == (uint32_t)ORDER_PROJECT_FIRST;
}

/* Used or all zero; a plain low-pass, in front of a soft projection. */
static bool regressor_is_valid(const guard_config_t *config) {
    const regressor_config_t *const regressor = &config->regressor;
    bool asked = false;
    for (uint32_t t = TASK_NONE; t < (uint32_t)TASK_COUNT; ++t) {
        asked = asked || (config->task[t].index.kind == (uint32_t)INDEX_REGRESSOR);
    }
    if (regressor->used == 0u) {
        return !asked;
    }
    const channel_config_t *const filter = &regressor->low_pass;
    return (regressor->used == 1u) && asked && orders_by_projection(config) &&
           (config->subspace.projector == (uint32_t)PROJECTOR_SOFT) && (filter->high_pass[0] == NUM(0)) &&
           (filter->of == (uint32_t)CHANNEL_UNEXPLAINED) && channel_is_valid(config, filter, true);
}

static bool bank_is_valid(const guard_config_t *config) {
    bool valid = lies_within(config->bank.channels, 1u, BANK_MAX_CHANNELS);
    for (uint32_t c = 0; valid && (c < config->bank.channels); ++c) {
        valid = channel_is_valid(config, &config->bank.channel[c], orders_by_projection(config));
    }
    return valid;
}

uint32_t config_reaction_us(const guard_config_t *config) {
    uint32_t slowest = 0;
    for (uint32_t t = TASK_NONE; t < (uint32_t)TASK_COUNT; ++t) {
        const task_config_t *const task = &config->task[t];
        uint32_t rise = UINT32_MAX;
        for (uint32_t c = 0; c < config->bank.channels; ++c) {
            const bool unexplained = config->bank.channel[c].of == (uint32_t)CHANNEL_UNEXPLAINED;
            if (unexplained && ((task->detector.channels & (1u << c)) != 0u)) {
                const uint32_t own = step_response(config, &config->bank.channel[c], orders_by_projection(config)).rise;
                rise = (own < rise) ? own : rise;
            }
        }
        if (task->index.kind != (uint32_t)INDEX_OFF) {
            if (rise == UINT32_MAX) {
                return UINT32_MAX;
            }
            const bool prefiltered = task->index.kind == (uint32_t)INDEX_REGRESSOR;
            const uint32_t before = prefiltered ? step_response(config, &config->regressor.low_pass, true).rise : 0u;
            const uint32_t cycles = rise + before + task->detector.debounce_ticks;
            slowest = (cycles > slowest) ? cycles : slowest;
        }
    }
    return ((1u + slowest) * config->period_us) + config->joint_deadline_us + config->tick_deadline_us;
}

/* --- projection, stops, tasks ------------------------------------------------------------------------------------- */

/* Positive, a number, and at most `most`. */
static bool is_up_to(num_t value, num_t most) {
    return (value > NUM(0)) && (value <= most);
}

/* The same, or zero. */
static bool is_zero_up_to(num_t value, num_t most) {
    return (value >= NUM(0)) && (value <= most);
}

static bool subspace_is_valid(const subspace_config_t *subspace) {
    const bool order =
        (subspace->order == (uint32_t)ORDER_FILTER_FIRST) || (subspace->order == (uint32_t)ORDER_PROJECT_FIRST);
    const bool projector =
        (subspace->projector == (uint32_t)PROJECTOR_HARD) ||
        ((subspace->projector == (uint32_t)PROJECTOR_SOFT) && (subspace->tolerance >= NUM(SOFT_MIN)));
    return order && projector && is_up_to(subspace->tolerance, NUM(0.1)) && is_up_to(subspace->lever_m, NUM(1)) &&
           is_up_to(subspace->softness, NUM(0.2)) && (subspace->softness >= subspace->tolerance);
}

/* Holding under power is for a collision only: there the arm is known to work. */
static bool stop_is_valid(const guard_config_t *config) {
    return (config->stop_collision <= 2u) && (config->stop_input <= 1u) && (config->stop_fault <= 1u);
}

static bool limits_are_valid(const guard_config_t *config, const task_config_t *task) {
    const explained_config_t *const limits = &task->limits;
    uint32_t saturations = 0;
    bool valid = true;
    for (uint32_t i = 0; i < config->robot.joint_count; ++i) {
        const num_t torque_max = config->robot.joint[i].torque_max_nm;
        valid = valid && is_up_to(limits->residual_max_nm[i] / (int32_t)CONFIG_RESIDUAL_SHARE, torque_max);
    }
    if ((task->index.kind == (uint32_t)INDEX_PAYLOAD) || (task->index.kind == (uint32_t)INDEX_REGRESSOR)) {
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

static bool sensor_is_valid(const guard_config_t *config) {
    bool valid = sensor_config_is_valid(&config->sensor);
    for (uint32_t i = 0; i < config->robot.joint_count; ++i) {
        const num_t most = config->robot.joint[i].torque_max_nm / (int32_t)CONFIG_SENSOR_SHARE;
        valid = valid && (num_abs(config->sensor.offset_nm[i]) <= most) && (config->sensor.friction_nm[i] <= most);
    }
    return valid;
}

static bool detector_is_valid(const guard_config_t *config, const detector_config_t *detector) {
    const uint32_t debounce_us =
        (detector->debounce_ticks <= 1000u) ? (detector->debounce_ticks * config->period_us) : UINT32_MAX;
    bool valid = (detector->debounce_ticks >= 1u) &&
                 ((debounce_us <= CONFIG_DEBOUNCE_MAX_US) || (detector->debounce_ticks <= 2u)) &&
                 (detector->channels != 0u) && ((detector->channels >> config->bank.channels) == 0u);
    for (uint32_t c = 0; c < config->bank.channels; ++c) {
        for (uint32_t i = 0; i < config->robot.joint_count; ++i) {
            const num_t most = config->robot.joint[i].torque_max_nm / (int32_t)CONFIG_THRESHOLD_SHARE;
            valid = valid && (((detector->channels & (1u << c)) == 0u) || is_up_to(detector->threshold_nm[c][i], most));
        }
    }
    return valid;
}

/* A force that stays must be seen: at least one channel without a high-pass. */
static bool sees_static_force(const guard_config_t *config, const detector_config_t *detector) {
    bool sees = false;
    for (uint32_t c = 0; c < config->bank.channels; ++c) {
        const channel_config_t *const channel = &config->bank.channel[c];
        const bool watched = (detector->channels & (1u << c)) != 0u;
        sees = sees || (watched && (channel->of == (uint32_t)CHANNEL_UNEXPLAINED) && (channel->high_pass[0] == NUM(0)));
    }
    return sees;
}

/* Axes of unit length at right angles, so that a coefficient is a force in N. */
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
        return (index->kind <= (uint32_t)INDEX_REGRESSOR) && (index->components == 0u) && (index->fast == 0u) &&
               (index->frame == (uint32_t)FRAME_TIP) && has_no_axes(index);
    }
    const bool soft = config->subspace.projector == (uint32_t)PROJECTOR_SOFT;
    const bool components = (index->components != 0u) && ((index->components & ~INDEX_ALL_COMPONENTS) == 0u) &&
                            ((index->fast & ~index->components) == 0u) && (soft || (index->fast == 0u));
    return components &&
           ((index->frame == (uint32_t)FRAME_TIP) ? has_no_axes(index)
                                                  : ((index->frame <= (uint32_t)FRAME_TOOL) && axes_are_valid(index)));
}

/* A task with fast components watches a channel of `sudden`, and only such a task does. */
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
    const bool payload =
        (task->index.kind == (uint32_t)INDEX_PAYLOAD) || (task->index.kind == (uint32_t)INDEX_REGRESSOR);
    if (payload && (joints < CONFIG_PAYLOAD_MIN_JOINTS)) {
        return GUARD_PAYLOAD_NEEDS_6_JOINTS;
    }
    if (!limits_are_valid(config, task)) {
        return GUARD_BAD_LIMITS;
    }
    return sees_static_force(config, &task->detector) ? GUARD_OK : GUARD_BAD_BANK;
}

static guard_status_t check_tasks(const guard_config_t *config) {
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

guard_status_t config_bounds_check(const guard_config_t *config) {
    if (!robot_holds(&config->robot)) {
        return GUARD_BAD_ROBOT;
    }
    if (!timing_is_valid(config)) {
        return GUARD_BAD_TIMING;
    }
    if (!observer_is_valid(config)) {
        return GUARD_BAD_OBSERVER;
    }
    if (!subspace_is_valid(&config->subspace)) {
        return GUARD_BAD_SUBSPACE;
    }
    if (!stop_is_valid(config)) {
        return GUARD_BAD_STOP;
    }
    if (!sensor_is_valid(config)) {
        return GUARD_BAD_SENSOR;
    }
    if (!bank_is_valid(config) || !regressor_is_valid(config)) {
        return GUARD_BAD_BANK;
    }
    const guard_status_t status = check_tasks(config);
    if (status != GUARD_OK) {
        return status;
    }
    return (config_reaction_us(config) <= CONFIG_REACTION_MAX_US) ? GUARD_OK : GUARD_TOO_SLOW;
}
