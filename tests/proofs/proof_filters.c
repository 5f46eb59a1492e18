/* firmware/guard/config_filters.c: any block whose timing is valid. A step response is as long as one second; here a
 * step of the loop is any step (the state before it is any state). */
#include "num_stub.h"

#include "config_filters.c"
#include "guard_any.h"

static bank_t any_bank;

void bank_init(bank_t *self) {
    *self = any_bank;
}

void bank_step(bank_t *self, const bank_config_t *config, uint32_t joints, uint32_t gap, const num_t unexplained[],
               const num_t sudden[], uint32_t token) {
    (void)token;
    HOLDS((config->channels == 1u) && (joints == 1u) && (gap == 1u), "the precondition of bank_step");
    HOLDS(__CPROVER_r_ok(unexplained, sizeof(num_t)) && __CPROVER_r_ok(sudden, sizeof(num_t)),
          "the inputs are readable");
    __CPROVER_havoc_object(self);
}

void proof_filters(void) {
    guard_config_t block;
    channel_config_t channel;
    block.period_us = CONFIG_PERIOD_MAX_US; /* 20 steps of the response; every further step is like these */
    if (channel_is_valid(&block, &channel, orders_by_projection(&block))) {
        for (uint32_t g = 0; g < OBSERVER_MAX_GAP; ++g) {
            HOLDS((num_abs(channel.own[g]) <= NUM(1)) && (num_abs(channel.cross[g]) <= NUM(1)) &&
                      (num_abs(channel.back[g]) <= NUM(1)) && (num_abs(channel.stay[g]) <= NUM(1)),
                  "bank.c and regressor.c rely on the constants of the states");
            HOLDS((num_abs(channel.in[g]) <= NUM(16)) && (num_abs(channel.in_back[g]) <= NUM(16)),
                  "bank.c and regressor.c rely on the constants of the input");
        }
    }
    REACHED;
}

/* Instead of step_response and channel_is_valid, which proof_filters shows (proofs.toml). The regressor's low-pass has
 * a rise: regressor_is_valid. */
response_t stub_response(const guard_config_t *config, const channel_config_t *channel, bool project_first) {
    response_t any;
    (void)project_first;
    HOLDS(__CPROVER_r_ok(config, sizeof(*config)), "the block is there");
    HOLDS(__CPROVER_r_ok(channel, sizeof(*channel)), "the channel is there");
    ASSUME((any.rise >= 1u) && ((any.rise <= (1000000u / config->period_us)) || (any.rise == UINT32_MAX)));
    ASSUME((channel != &config->regressor.low_pass) || (any.rise != UINT32_MAX));
    return any;
}

static uint32_t channels_seen;

bool stub_channel(const guard_config_t *config, const channel_config_t *channel, bool project_first) {
    bool valid;
    (void)project_first;
    HOLDS(__CPROVER_r_ok(config, sizeof(*config)), "the block is there");
    HOLDS(__CPROVER_r_ok(channel, sizeof(*channel)), "the channel is there");
    ++channels_seen;
    return valid;
}

void proof_filters_loops(void) {
    guard_config_t block;
    channels_seen = 0;
    if (bank_is_valid(&block)) {
        HOLDS((block.bank.channels >= 1u) && (block.bank.channels <= BANK_MAX_CHANNELS), "a known number of channels");
        HOLDS(channels_seen == block.bank.channels, "every channel was checked");
    }
    channels_seen = 0;
    if (regressor_is_valid(&block)) {
        HOLDS(block.regressor.used == channels_seen, "a filter in use was checked");
        HOLDS((block.task[TASK_PAYLOAD].index.kind != (uint32_t)INDEX_REGRESSOR) || (block.regressor.used == 1u),
              "a task of the regressor has its filter");
    }
    REACHED;
}

/* A block that config_bounds_check has accepted up to here: timing, bank, regressor and tasks. */
void proof_reaction(void) {
    guard_config_t block;
    assume_block(&block);
    for (uint32_t t = 0; t < (uint32_t)TASK_COUNT; ++t) { /* detector_is_valid */
        const uint32_t ticks = block.task[t].detector.debounce_ticks;
        ASSUME((block.task[t].index.kind == (uint32_t)INDEX_OFF) ||
               ((ticks >= 1u) && (ticks <= (CONFIG_DEBOUNCE_MAX_US / block.period_us))));
    }
    const uint32_t reaction_us = config_reaction_us(&block);
    HOLDS(reaction_us >= (block.joint_deadline_us + block.tick_deadline_us + block.period_us),
          "the deadlines and one cycle are in it");
    HOLDS((reaction_us == UINT32_MAX) || (reaction_us <= 3000000u), "two steps, the debounce and the deadlines");
    REACHED;
}
