#include "config_parts.h"

/* Response of one channel to a unit step of torque. */
typedef struct {
    uint32_t rise; /* cycles until the output is half of the step; UINT32_MAX: never within one second */
    num_t peak;    /* largest output */
    num_t end;     /* after one second */
} response_t;

/* A bank with one channel and one joint. It runs the guard's own code. */
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

/* Smallest peak of a channel of `sudden`, for a unit step. Its high-pass is fast: a long cycle leaves less of a step.
 * Low-pass 120 rad/s with high-pass 8 Hz peaks at 0.52 at 500 Hz, and at 0.42 at 100 Hz. */
#define SUDDEN_PEAK_MIN 0.25

/* A channel neither amplifies a step much nor loses it at once. Without a high-pass it ends at the step's size. */
static bool channel_is_valid(const guard_config_t *config, const channel_config_t *constants, bool project_first) {
    if (!constants_are_bounded(constants)) {
        return false;
    }
    const response_t response = step_response(config, constants, project_first);
    const bool is_static = constants->high_pass[0] == NUM(0);
    /* Without a high-pass, a channel of `sudden` would treat a constant intended moment as a collision. */
    const bool answers =
        ((constants->of == (uint32_t)CHANNEL_UNEXPLAINED) && (response.rise != UINT32_MAX)) ||
        ((constants->of == (uint32_t)CHANNEL_SUDDEN) && !is_static && (response.peak >= NUM(SUDDEN_PEAK_MIN)));
    return answers && (response.peak <= NUM(1.3)) && (!is_static || is_near(response.end, NUM(1), NUM(0.03)));
}

static bool orders_by_projection(const guard_config_t *config) {
    return config->subspace.order == (uint32_t)ORDER_PROJECT_FIRST;
}

/* Used or all zero. If used: a plain low-pass, followed by a soft projection. */
bool regressor_is_valid(const guard_config_t *config) {
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

bool bank_is_valid(const guard_config_t *config) {
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
