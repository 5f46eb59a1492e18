#include "config_bounds.h"

#include "config_parts.h"

/* --- timing ------------------------------------------------------------------------------------------------------- */

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
    /* A gap longer than the observer can bridge must have ended the permission before. */
    const bool deadlines = lies_within(config->sync_deadline_us, period, input) &&
                           lies_within(config->joint_deadline_us, period, CONFIG_MAX_GAP * period) &&
                           lies_within(config->task_deadline_us, period, input) &&
                           lies_within(config->tick_deadline_us, period, tick) &&
                           lies_within(config->tick_budget_us, 1u, period);
    const uint32_t dwell_us = (config->task_dwell_cycles < ((CONFIG_DWELL_MAX_US / CONFIG_PERIOD_MIN_US) + 1u))
                                  ? (config->task_dwell_cycles * period)
                                  : UINT32_MAX;
    return deadlines && lies_within(dwell_us, CONFIG_DWELL_MIN_US, CONFIG_DWELL_MAX_US) &&
           lies_within(config->settling_us, period, CONFIG_SLOWEST_SETTLING_US) &&
           lies_within(config->reset_healthy_us, config->settling_us, CONFIG_HEALTHY_MAX_US);
}

/* --- observer ----------------------------------------------------------------------------------------------------- */

/* Converts microseconds, up to CONFIG_PERIOD_MAX_US * CONFIG_MAX_GAP, to seconds. */
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

/* Checks the constants of each gap against those of one cycle and the period. */
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
    /* The settling time contains five time constants. This bounds the gain from below: exp(-5) is 0.0067. */
    return valid && (power(observer->decay[0], config->settling_us / config->period_us) <= NUM(0.0075));
}

/* --- projection, stops, sensors ----------------------------------------------------------------------------------- */

static bool subspace_is_valid(const subspace_config_t *subspace) {
    const bool order =
        (subspace->order == (uint32_t)ORDER_FILTER_FIRST) || (subspace->order == (uint32_t)ORDER_PROJECT_FIRST);
    const bool projector =
        (subspace->projector == (uint32_t)PROJECTOR_HARD) ||
        ((subspace->projector == (uint32_t)PROJECTOR_SOFT) && (subspace->tolerance >= NUM(SOFT_MIN)));
    return order && projector && is_up_to(subspace->tolerance, NUM(0.1)) && is_up_to(subspace->lever_m, NUM(1)) &&
           is_up_to(subspace->softness, NUM(0.2)) && (subspace->softness >= subspace->tolerance);
}

/* Only a collision may stop with the power on: the arm is then known to work. */
static bool stop_is_valid(const guard_config_t *config) {
    return (config->stop_collision <= 2u) && (config->stop_input <= 1u) && (config->stop_fault <= 1u);
}

static bool sensor_is_valid(const guard_config_t *config) {
    bool valid = sensor_config_is_valid(&config->sensor);
    for (uint32_t i = 0; i < config->robot.joint_count; ++i) {
        const num_t most = config->robot.joint[i].torque_max_nm / (int32_t)CONFIG_SENSOR_SHARE;
        valid = valid && (num_abs(config->sensor.offset_nm[i]) <= most) && (config->sensor.friction_nm[i] <= most);
    }
    return valid;
}

static bool sight_is_valid(const guard_config_t *config) {
    const uint32_t joints = config->robot.joint_count;
    bool valid = (config->sight.reaction < (uint32_t)SIGHT_REACTIONS) &&
                 is_up_to(config->sight.force_n, NUM(CONFIG_SIGHT_MAX_N));
    for (uint32_t i = 0; i < joints; ++i) {
        valid = valid && is_zero_up_to(config->shape.half_m[i], NUM(CONFIG_SHAPE_MAX_M));
        for (uint32_t a = 0; a < 3u; ++a) {
            valid = valid && is_zero_up_to(num_abs(config->shape.middle[i][a]), NUM(CONFIG_SHAPE_MAX_M));
        }
    }
    for (uint32_t t = 0; t < (uint32_t)TASK_COUNT; ++t) {
        valid = valid && ((config->task[t].needed_links >> joints) == 0u);
    }
    return valid;
}

guard_status_t config_bounds_check(const guard_config_t *config) {
    if (!robot_is_valid(&config->robot)) {
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
    if (!sight_is_valid(config)) {
        return GUARD_BAD_SIGHT;
    }
    const guard_status_t status = check_tasks(config);
    if (status != GUARD_OK) {
        return status;
    }
    return (config_reaction_us(config) <= CONFIG_REACTION_MAX_US) ? GUARD_OK : GUARD_TOO_SLOW;
}
