#include "lever.h"

#include "vec3.h"

uint32_t lever_link(const motion_t *motion) {
    return (motion->watched < ROBOT_MAX_JOINTS) ? motion->watched : 0u;
}

vec3_t lever_arm(const motion_t *motion, const lever_config_t *shape, uint32_t *saturations) {
    const num_t *const p = shape->middle[lever_link(motion)];
    const vec3_t middle = {.x = p[0], .y = p[1], .z = p[2]};
    const vec3_t rotated = {.x = vec3_dot(motion->link_x, middle, saturations),
                            .y = vec3_dot(motion->link_y, middle, saturations),
                            .z = vec3_dot(motion->link_z, middle, saturations)};
    return vec3_subtract(vec3_add(motion->link_origin, rotated, saturations), motion->tip, saturations);
}

void lever_torque(const motion_t *motion, vec3_t arm, vec3_t force, vec3_t moment, num_t torque[],
                  uint32_t *saturations) {
    const vec3_t m = vec3_add(vec3_cross(arm, force, saturations), moment, saturations);
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        torque[i] = NUM(0);
        if (i <= motion->watched) {
            torque[i] =
                num_narrow(num_wide(motion->jacobian[0][i], force.x) + num_wide(motion->jacobian[1][i], force.y) +
                               num_wide(motion->jacobian[2][i], force.z) + num_wide(motion->jacobian[3][i], m.x) +
                               num_wide(motion->jacobian[4][i], m.y) + num_wide(motion->jacobian[5][i], m.z),
                           saturations);
        }
    }
}
