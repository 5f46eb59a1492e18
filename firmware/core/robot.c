#include "robot.h"

static bool zero_behind(const robot_t *robot) {
    const robot_joint_t *const end = &robot->joint[ROBOT_MAX_JOINTS];
    const robot_joint_t *const last = &robot->joint[robot->joint_count];
    bool zero = true;
    for (const uint8_t *byte = (const uint8_t *)last; byte < (const uint8_t *)end; ++byte) {
        zero = zero && (*byte == 0u);
    }
    return zero;
}

static bool is_one(num_wide_t square) {
    uint32_t saturations = 0;
    const num_t error = num_subtract(num_narrow(square, &saturations), NUM(1), &saturations);
    return (error < NUM(1e-5)) && (error > NUM(-1e-5)); /* false for NaN */
}

/* Below 64 in size. No arm with torques of this wire comes near, and sums of products stay in range (num.h). False for
 * NaN. */
static bool moderate(num_t a) {
    return num_abs(a) < NUM(64);
}

static bool vec3_moderate(const vec3_t *v) {
    return moderate(v->x) && moderate(v->y) && moderate(v->z);
}

static num_t span_of(const vec3_t *v) {
    return num_abs(v->x) + num_abs(v->y) + num_abs(v->z); /* no overflow: each component is below 64 */
}

/* No point of the arm is 60 m away, and so no entry of the Jacobian is 60 m or more. */
static bool reach_is_moderate(const robot_t *robot) {
    uint32_t held = 0;
    num_t reach = span_of(&robot->tip);
    for (uint32_t i = 0; i < robot->joint_count; ++i) {
        reach = num_add(reach, span_of(&robot->joint[i].offset), &held);
    }
    return reach < NUM(60);
}

static bool joint_is_valid(const robot_joint_t *joint) {
    return vec3_moderate(&joint->offset) && moderate(joint->zero_rad) && moderate(joint->moment_x) &&
           moderate(joint->moment_y) && moderate(joint->inertia_xx) && moderate(joint->inertia_xy) &&
           moderate(joint->inertia_xz) && moderate(joint->inertia_yz) && moderate(joint->inertia_zz) &&
           moderate(joint->cos_twist) && moderate(joint->sin_twist) &&
           is_one(num_wide(joint->cos_twist, joint->cos_twist) + num_wide(joint->sin_twist, joint->sin_twist)) &&
           (joint->position_min_rad < joint->position_max_rad) && (joint->velocity_max_rad_s > NUM(0)) &&
           (joint->torque_max_nm > NUM(0));
}

bool robot_is_valid(const robot_t *robot) {
    if ((robot->joint_count < 1u) || (robot->joint_count > ROBOT_JOINTS)) {
        return false;
    }
    bool holds = zero_behind(robot) && vec3_moderate(&robot->gravity) && vec3_moderate(&robot->tip);
    for (uint32_t i = 0; i < 3u; ++i) {
        const num_t *const row = robot->base[i];
        holds = holds && moderate(row[0]) && moderate(row[1]) && moderate(row[2]);
        holds = holds && is_one(num_wide(row[0], row[0]) + num_wide(row[1], row[1]) + num_wide(row[2], row[2]));
    }
    for (uint32_t i = 0; i < robot->joint_count; ++i) {
        holds = holds && joint_is_valid(&robot->joint[i]);
    }
    return holds && reach_is_moderate(robot);
}
