/* any_table: any table of an arm that robot_is_valid accepts, and any Jacobian, as far as a harness relies on either.
 * proof_robot.c shows the first. The second is what motion_step leaves (proof_motion.c): it limits each entry. */
#ifndef TAUPERP_ANY_TABLE_H
#define TAUPERP_ANY_TABLE_H

#include "proof.h"
#include "robot.h"

static inline bool is_below(num_t a, num_t limit) {
    return (a > -limit) && (a < limit);
}

static inline bool vec3_is_below(vec3_t v, num_t limit) {
    return is_below(v.x, limit) && is_below(v.y, limit) && is_below(v.z, limit);
}

static inline bool joint_is_bounded(const robot_joint_t *joint) {
    const num_t most = NUM(64);
    return vec3_is_below(joint->offset, most) && is_below(joint->cos_twist, most) && is_below(joint->sin_twist, most) &&
           is_below(joint->zero_rad, most) && is_below(joint->moment_x, most) && is_below(joint->moment_y, most) &&
           is_below(joint->inertia_xx, most) && is_below(joint->inertia_xy, most) &&
           is_below(joint->inertia_xz, most) && is_below(joint->inertia_yz, most) && is_below(joint->inertia_zz, most);
}

static inline bool table_is_bounded(const robot_t *robot) {
    bool bounded = (robot->joint_count >= 1u) && (robot->joint_count <= ROBOT_JOINTS) &&
                   vec3_is_below(robot->gravity, NUM(64)) && vec3_is_below(robot->tip, NUM(64));
    for (uint32_t i = 0; i < 3u; ++i) {
        for (uint32_t j = 0; j < 3u; ++j) {
            bounded = bounded && is_below(robot->base[i][j], NUM(64));
        }
    }
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        bounded = bounded && joint_is_bounded(&robot->joint[i]);
    }
    return bounded;
}

static inline void assume_jacobian(const num_t jacobian[][ROBOT_MAX_JOINTS]) {
    for (uint32_t row = 0; row < 6u; ++row) {
        for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
            ASSUME(is_below(jacobian[row][i], NUM(64)));
        }
    }
}

#endif
