/* bank: up to four linear filters, called channels, on the part of the torque that the task does not explain.
 *
 * Model error and sensor offsets are slow; velocity noise is fast. No single low-pass rejects both. Each channel
 * therefore has its own band, with a threshold for each joint. A band-pass is safe here because the projection has
 * already removed what the task explains.
 *
 * A channel is a low-pass of first or second order, followed by an optional high-pass of first order. Both are
 * discretised exactly for a step of 1 to OBSERVER_MAX_GAP cycles:
 *     level+ = own level + cross slope + in u          slope+ = back level + stay slope + in_back u
 *     slow+  = slow + high_pass (level+ - slow)        output = level+ - slow+        (slow = 0 without a high-pass)
 * For a second-order low-pass of w rad/s and damping z, with level' = w slope and slope' = w (u - level - 2 z slope):
 * [own cross; back stay] = F = exp(w g T [0 1; -1 -2z]), in = 1 - own, in_back = -back. The input u is `update` of
 * observer.h, which is (1 - a) y. `in` and `in_back` are therefore divided by (1 - a). Both states have the magnitude
 * of the output. No coefficient is as small as (w T)^2, so fixed point keeps its resolution.
 *
 * A channel with the input `sudden` detects changes that are faster than the task allows. It needs a high-pass.
 *
 * Nm. Cost: 7 products per joint and channel.
 */
#ifndef TAUPERP_BANK_H
#define TAUPERP_BANK_H

#include "observer.h"

#define BANK_MAX_CHANNELS 4u

/* Input of a channel: `unexplained` or `sudden` of index.h. */
typedef enum { CHANNEL_UNEXPLAINED = 0, CHANNEL_SUDDEN = 1 } channel_of_t;

typedef struct {
    num_t own[OBSERVER_MAX_GAP];
    num_t cross[OBSERVER_MAX_GAP];
    num_t back[OBSERVER_MAX_GAP];
    num_t stay[OBSERVER_MAX_GAP];
    num_t in[OBSERVER_MAX_GAP];
    num_t in_back[OBSERVER_MAX_GAP];
    num_t high_pass[OBSERVER_MAX_GAP]; /* 0: none */
    uint32_t of;                       /* channel_of_t */
} channel_config_t;

typedef struct {
    uint32_t channels; /* 1 to BANK_MAX_CHANNELS */
    channel_config_t channel[BANK_MAX_CHANNELS];
} bank_config_t;

typedef struct {
    num_t level[ROBOT_MAX_JOINTS];
    num_t slope[ROBOT_MAX_JOINTS];
    num_t slow[ROBOT_MAX_JOINTS];
    num_t output[ROBOT_MAX_JOINTS];
} channel_t;

typedef struct {
    channel_t channel[BANK_MAX_CHANNELS];
    uint32_t token; /* token.h */
    uint32_t saturations;
} bank_t;

void bank_init(bank_t *self);

/* gap: cycles that this step bridges. For 0, or more than OBSERVER_MAX_GAP, the observer has restarted: all channels
 * restart at zero. `token`: that of the previous stage. */
void bank_step(bank_t *self, const bank_config_t *config, uint32_t joints, uint32_t gap, const num_t unexplained[],
               const num_t sudden[], uint32_t token);

#endif
