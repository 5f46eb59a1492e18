/* firmware/core/robot.c: any table. */
#include "num_sizes.h"

#include "any_table.h"
#include "robot.c"

/* Instead of zero_behind (proofs.toml): what is behind the joints is zero, and so it is bounded. */
bool stub_behind(const robot_t *robot) {
    bool zero;
    HOLDS((robot->joint_count >= 1u) && (robot->joint_count <= ROBOT_JOINTS), "the joints of an arm");
    for (uint32_t i = 1; i < ROBOT_MAX_JOINTS; ++i) {
        ASSUME(!zero || (i < robot->joint_count) || joint_is_bounded(&robot->joint[i]));
    }
    return zero;
}

void proof_robot(void) {
    robot_t robot;
    HOLDS(!robot_is_valid(&robot) || table_is_bounded(&robot), "a valid table is bounded");
    REACHED;
}

/* Each number of joints as a constant: the loop over the bytes is long. */
void proof_robot_behind(void) {
    robot_t robot;
    for (uint32_t joints = 1; joints < ROBOT_MAX_JOINTS; ++joints) {
        uint32_t behind;
        robot.joint_count = joints;
        const bool zero = zero_behind(&robot);
        ASSUME((behind >= joints) && (behind < ROBOT_MAX_JOINTS));
        HOLDS(!zero || (robot.joint[behind].offset.x == 0), "a joint behind the arm is zero");
    }
    REACHED;
}
