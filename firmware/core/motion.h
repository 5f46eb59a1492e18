/* motion: all terms of the dynamics that the guard needs at one instant, in one O(n) pass.
 *
 * Outputs, joint_count entries each: momentum p = M(q) qd in Nm s, coriolis C(q,qd)^T qd and gravity g(q) in Nm. Also
 * the Jacobian of the end-effector point in the base frame: rows 0-2 linear (m), rows 3-5 angular (1). The pass does
 * not form the mass matrix. Forward it computes link velocities, backward the composite momenta of all links beyond a
 * joint:
 *     p_i = z . L_i       (C^T qd)_i = L_i . (w_i x z) + P_i . (v_i x z)       g_i = -(z x s_i) . gravity
 * L, P and s are the angular momentum, linear momentum and first moment beyond joint i, about its origin, in its frame.
 *
 * Inputs: q in rad, qd in rad/s. The caller keeps |qd| below velocity_max_rad_s of the table. Results are finite for
 * finite inputs, and not finite for NaN or infinity. The pass terminates in both cases. Cost: one sine and cosine and
 * about 120 products per joint; 0.5 KiB of stack.
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
    vec3_t tip;                                          /* the end-effector point in the base frame */
    uint32_t watched;                                    /* input: the link whose frame the next step keeps, 0 to n-1 */
    vec3_t link_x, link_y, link_z;                       /* its frame: as tool_x, tool_y, tool_z */
    vec3_t link_origin;                                  /* in the base frame */
    vec3_t tool_x, tool_y,
        tool_z; /* base axes in the last link's frame: a vector v of it is (x . v, y . v, z . v) in the base frame */
    uint32_t token;       /* token.h */
    uint32_t saturations; /* of all steps since motion_init */
} motion_t;

void motion_init(motion_t *self);
void motion_step(motion_t *self, const robot_t *robot, const num_t q[], const num_t qd[]);

#endif
