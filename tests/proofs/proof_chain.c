/* firmware/core, fixed point, part two: a stage whose sums of products stay in range only because an arm is a physical
 * system. Bounds, pointers, shifts and loops are proved here; the sums are not. */
#include "num_stub.h"

#include "acceleration.c"

void proof_acceleration(void) {
    acceleration_t acceleration;
    acceleration_config_t config;
    observer_config_t gains;
    observer_t observer;
    robot_t robot;
    motion_t motion;
    num_t velocity[ROBOT_MAX_JOINTS], mass_max_kg;
    vec3_t commanded;
    ASSUME((robot.joint_count >= 1u) && (robot.joint_count <= ROBOT_MAX_JOINTS));
    acceleration_step(&acceleration, &config, &gains, &observer, &robot, &motion, velocity, commanded, mass_max_kg);
    acceleration_init(&acceleration);
    REACHED;
}
