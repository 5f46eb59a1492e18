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
    (void)channel_is_valid(&block, &channel, orders_by_projection(&block));
    REACHED;
}
