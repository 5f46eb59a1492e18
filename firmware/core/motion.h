/* motion: everything about the arm that the guard needs at one instant, in one O(n) pass.
 *
 * momentum p = M(q) qd, coriolis C(q,qd)^T qd, gravity g(q), each joint_count entries in Nm s or Nm, and the Jacobian
 * of the end-effector point: rows 0-2 linear, rows 3-5 angular, in the base frame, m and 1. No mass matrix is formed.
 * Forward the link velocities, backward the composite momenta of everything beyond a joint:
 *     p_i = z . L_i       (C^T qd)_i = L_i . (w_i x z) + P_i . (v_i x z)       g_i = -(z x s_i) . gravity
 * with L, P, s the angular momentum, linear momentum and first moment beyond joint i about its origin, in its frame.
 *
 * Inputs q in rad and qd in rad/s. The caller keeps |qd| below the table's velocity_max_rad_s; with finite input the
 * results are finite, with NaN or infinity they are not, and the pass terminates all the same.
 * Cost: one sine and cosine, about 120 products a joint; 0.5 KiB of stack.
 */
#ifndef TAUPERP_MOTION_H
#define TAUPERP_MOTION_H

#include "robot.h"

#define MOTION_TWIST_ROWS 6u

typedef struct {
    num_t momentum[ROBOT_MAX_JOINTS];
    num_t coriolis[ROBOT_MAX_JOINTS];
    num_t gravity[ROBOT_MAX_JOINTS];
    num_t jacobian[MOTION_TWIST_ROWS][ROBOT_MAX_JOINTS]; /* entries from joint_count on are zero */
    vec3_t tool_x, tool_y,
        tool_z;           /* base axes in the last link's frame: v there is (x . v, y . v, z . v) in the base */
    uint32_t token;       /* token.h */
    uint32_t saturations; /* of all steps since motion_init */
} motion_t;

void motion_init(motion_t *self);
void motion_step(motion_t *self, const robot_t *robot, const num_t q[], const num_t qd[]);

#endif
