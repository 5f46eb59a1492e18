/* firmware/core/lever.c and sight.c: any shape that config_check accepts, any Jacobian below 64. index_reject is a
 * stub: proof_index.c. */
#include "num_sizes.h"

#include "any_table.h"
#include "config_bounds.h"
#include "lever.c"
#include "sight.c"
#include "stub_object.h"

void index_reject(index_t *self, const num_t torque[], num_t unexplained[]) {
    stub_torques(torque, unexplained);
}

void proof_sight(void) {
    sight_t sight;
    sight_config_t config;
    lever_config_t shape;
    motion_t motion;
    index_t index;
    bank_config_t bank;
    detector_config_t task;
    uint32_t joints, token;
    ASSUME((joints >= 1u) && (joints <= ROBOT_JOINTS) && (bank.channels <= BANK_MAX_CHANNELS));
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        const num_t *const middle = shape.middle[i];
        ASSUME(is_below(middle[0], NUM(5)) && is_below(middle[1], NUM(5)) && is_below(middle[2], NUM(5)));
    }
    assume_jacobian(motion.jacobian);
    sight_step(&sight, &config, &shape, joints, &motion, &index, &bank, &task, token);
    HOLDS(sight.axis < 3u, "the next axis is one of three");
    HOLDS(sight.token != 0u, "a token is never zero");
    sight_init(&sight, joints);
    HOLDS(sight.blind == ((1u << joints) - 1u), "every link is blind before its first answer");
    REACHED;
}
