/* lever: the joint torques of forces and moments on a link of the arm.
 *
 * A link is described by the middle of its shape, in its own frame (robot.h), and by its half length. motion_step keeps
 * the frame of one link per tick (motion.h: `watched`), so these functions apply to one link at a time.
 *
 * Sign: the torque that balances the force, J^T F. Cost: lever_torque about 60 products.
 */
#ifndef TAUPERP_LEVER_H
#define TAUPERP_LEVER_H

#include "motion.h"

typedef struct {
    num_t middle[ROBOT_MAX_JOINTS][3]; /* m, in the link's frame */
    num_t half_m[ROBOT_MAX_JOINTS];    /* from the middle to the link's ends and surface */
} lever_config_t;

/* Index of the watched link. In range for any state. */
uint32_t lever_link(const motion_t *motion);

/* From the end-effector point to the middle of the watched link, base frame, m. */
vec3_t lever_arm(const motion_t *motion, const lever_config_t *shape, uint32_t *saturations);

/* torque <- that of a force `force` in the middle of the watched link and of a moment `moment`, base frame. Zero beyond
 * the link. ROBOT_JOINTS entries. */
void lever_torque(const motion_t *motion, vec3_t arm, vec3_t force, vec3_t moment, num_t torque[],
                  uint32_t *saturations);

#endif
