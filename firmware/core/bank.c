#include "bank.h"

#include "token.h"

void bank_init(bank_t *self) {
    *self = (bank_t){0};
}

static void channel_step(channel_t *self, const channel_config_t *config, uint32_t joints, uint32_t g,
                         const num_t input[], uint32_t *saturations) {
    const num_t own = config->own[g];
    const num_t cross = config->cross[g];
    const num_t back = config->back[g];
    const num_t stay = config->stay[g];
    const num_t in = config->in[g];
    const num_t in_back = config->in_back[g];
    const num_t high_pass = config->high_pass[g];
    for (uint32_t i = 0; i < joints; ++i) {
        const num_t level = self->level[i];
        const num_t slope = self->slope[i];
        const num_t u = input[i];
        const num_t next = num_narrow(num_wide(own, level) + num_wide(cross, slope) + num_wide(in, u), saturations);
        self->slope[i] = num_narrow(num_wide(back, level) + num_wide(stay, slope) + num_wide(in_back, u), saturations);
        self->level[i] = next;
        const num_t beyond = num_subtract(next, self->slow[i], saturations);
        const num_t slow = num_narrow(num_widen(self->slow[i]) + num_wide(high_pass, beyond), saturations);
        self->slow[i] = slow;
        self->output[i] = num_subtract(next, slow, saturations);
    }
}

void bank_step(bank_t *self, const bank_config_t *config, uint32_t joints, uint32_t gap, const num_t unexplained[],
               const num_t sudden[], uint32_t token) {
    if ((gap < 1u) || (gap > OBSERVER_MAX_GAP)) {
        const uint32_t saturations = self->saturations;
        bank_init(self);
        self->saturations = saturations;
        self->token = token_next(token, TOKEN_BANK, 0u);
        return;
    }
    for (uint32_t c = 0; (c < config->channels) && (c < BANK_MAX_CHANNELS); ++c) {
        const channel_config_t *const channel = &config->channel[c];
        const num_t *const input = (channel->of == (uint32_t)CHANNEL_SUDDEN) ? sudden : unexplained;
        channel_step(&self->channel[c], channel, joints, gap - 1u, input, &self->saturations);
    }
    self->token = token_next(token, TOKEN_BANK, 0u);
}
