/* firmware/core/acceleration.c: any Jacobian below 64, any command. vec3_unit is a stub: proof_vec3 and
 * enumerate_newton.c show it. */
#include "num_sizes.h"

#include "acceleration.c"
#include "any_table.h"
#include "unit_stub.h"

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
    assume_jacobian(motion.jacobian);
    acceleration_step(&acceleration, &config, &gains, &observer, &robot, &motion, velocity, commanded, mass_max_kg);
    HOLDS((acceleration.size >= 0) && (acceleration.across >= 0), "explained.c relies on the sizes");
    acceleration_init(&acceleration);
    REACHED;
}
