/* robot: one arm as a constant table. `tauperp robot` generates it; it is never edited.
 *
 * An arm is a serial chain of 1 to ROBOT_MAX_JOINTS revolute joints. The link frames are chosen so that the pass over
 * the table (motion.h) multiplies by no known zero or one:
 *   - The z axis of frame i is the axis of joint i. Its origin o_i lies on that axis, if possible where the axis
 *     intersects the previous one. `offset` is then zero, or along the previous axis.
 *   - Frame i is frame i-1 moved by `offset`, turned about x by `twist`, then about z by q_i + `zero`.
 *   - A right angle between two axes is a twist of +90 degrees, never -90.
 *   - `base` is the fixed part of frame 0 (offset and twist of joint 0 are zero), so a tilted base costs nothing per
 *     tick.
 * A body that is symmetric about a joint's axis moves the same whether or not it turns with the joint. Every link can
 * therefore pass its mass, its first moment along z and its inertia about y to its parent: the minimal inertial
 * parameters of Gautier and Khalil (1990). Seven numbers per link remain. They are exact for momentum, C^T qd and
 * gravity torque, but they do not describe a physical link: never read a mass or a centre of mass from them.
 *
 * Units: m, rad, kg m, kg m^2, rad/s, Nm, m/s^2. Every field has 32 bits, little-endian in a configuration block.
 */
#ifndef TAUPERP_ROBOT_H
#define TAUPERP_ROBOT_H

#include "num.h"

#define ROBOT_MAX_JOINTS  8u
#define ROBOT_NAME_LENGTH 16u

/* Joints that this image supports. An image for one robot has exactly the joints of that robot, and its guard refuses a
 * table with more. Results and layouts do not depend on it; loops over the joints become shorter. */
#ifndef ROBOT_JOINTS
#define ROBOT_JOINTS ROBOT_MAX_JOINTS
#endif

typedef struct {
    num_t x, y, z;
} vec3_t;

typedef struct {
    vec3_t offset;   /* origin of this frame in the parent frame */
    num_t cos_twist; /* of the angle about the parent's x axis that maps the parent's z axis onto this joint's axis */
    num_t sin_twist;
    num_t zero_rad; /* added to the joint's reading */
    num_t moment_x; /* first moment of mass about the frame's origin, in this frame; the parent has the z component */
    num_t moment_y;
    num_t inertia_xx; /* inertia about the frame's origin, in this frame; the parent has yy */
    num_t inertia_xy;
    num_t inertia_xz;
    num_t inertia_yz;
    num_t inertia_zz;
    num_t position_min_rad; /* readings outside are invalid, not clamped */
    num_t position_max_rad;
    num_t velocity_max_rad_s;
    num_t torque_max_nm;
} robot_joint_t;

typedef struct {
    char name[ROBOT_NAME_LENGTH]; /* NUL-padded, not necessarily NUL-terminated */
    uint32_t joint_count;
    num_t base[3][3]; /* rotation: columns are frame 0's axes at q_0 + zero = 0, in the base frame */
    vec3_t gravity;   /* acceleration of gravity in the base frame, m/s^2; (0, 0, -9.81) upright */
    vec3_t tip;       /* end-effector point in the last link's frame */
    robot_joint_t joint[ROBOT_MAX_JOINTS]; /* entries from joint_count on are zero */
} robot_t;

/* True if motion_step can use the table: 1 to ROBOT_JOINTS joints, twists and base of unit length, ordered ranges,
 * lengths, moments and inertias below 64, reach below 60 m, and zero from joint_count on. It does not repeat the
 * generator's comparison with Pinocchio. Cost: one pass over the table. */
bool robot_is_valid(const robot_t *robot);

#endif
