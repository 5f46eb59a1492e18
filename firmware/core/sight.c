#include "sight.h"

#include "token.h"

enum { AXES = 3 };

void sight_init(sight_t *self, uint32_t joints) {
    *self = (sight_t){.blind = (1u << joints) - 1u};
}

/* `per_newton`: the index of a force of 1 N. True if force_n brings it to a threshold of a channel without a high-pass.
 */
static bool is_seen(const sight_config_t *config, uint32_t joints, const bank_config_t *bank,
                    const detector_config_t *task, const num_t per_newton[]) {
    bool seen = false;
    for (uint32_t c = 0; (c < bank->channels) && (c < BANK_MAX_CHANNELS); ++c) {
        const channel_config_t *const channel = &bank->channel[c];
        const bool counts = ((task->channels & (1u << c)) != 0u) && (channel->high_pass[0] == NUM(0)) &&
                            (channel->of == (uint32_t)CHANNEL_UNEXPLAINED);
        for (uint32_t i = 0; counts && (i < joints); ++i) {
            seen = seen || (num_wide(num_abs(per_newton[i]), config->force_n) >= num_widen(task->threshold_nm[c][i]));
        }
    }
    return seen;
}

void sight_step(sight_t *self, const sight_config_t *config, const lever_config_t *shape, uint32_t joints,
                motion_t *motion, index_t *index, const bank_config_t *bank, const detector_config_t *task,
                uint32_t token) {
    num_t torque[ROBOT_MAX_JOINTS];
    num_t index_of[ROBOT_MAX_JOINTS];
    const vec3_t none = {NUM(0), NUM(0), NUM(0)};
    const vec3_t unit = {.x = (self->axis == 0u) ? NUM(1) : NUM(0),
                         .y = (self->axis == 1u) ? NUM(1) : NUM(0),
                         .z = (self->axis == 2u) ? NUM(1) : NUM(0)};
    const vec3_t arm = lever_arm(motion, shape, &self->saturations);
    lever_torque(motion, arm, unit, none, torque, &self->saturations);
    index_reject(index, torque, index_of);
    self->seen = self->seen || is_seen(config, joints, bank, task, index_of);
    ++self->axis;
    if (self->axis >= (uint32_t)AXES) {
        const uint32_t bit = 1u << lever_link(motion);
        self->blind = self->seen ? (self->blind & ~bit) : (self->blind | bit);
        self->seen = false;
        self->axis = 0;
        motion->watched = ((motion->watched + 1u) < joints) ? (motion->watched + 1u) : 0u;
    }
    self->token = token_next(token, TOKEN_SIGHT, 0u);
}
