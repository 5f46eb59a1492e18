/* regressor: the joint torque that an arbitrary rigid payload causes, column by column, for d_r.
 *
 * The payload is a rigid body at the end-effector. It has mass m, first moment mc about the end-effector point in the
 * last link's frame, and an isotropic inertia I. It causes
 *     F = m (a - g) + alpha x mc + w x (w x mc)        M = mc x (a - g) + I alpha           torque = J^T [F; M]
 * with the point's acceleration a, the link's angular velocity w and its angular acceleration alpha. This is linear in
 * (m, mc, I). A task with these five columns explains every such payload without knowing it. It uses no commanded
 * acceleration: a and alpha are difference quotients of J qd. J, w and the axes are means over the step, like the
 * observer's terms.
 *
 * Differences of a measured velocity are noisy. The columns and y therefore pass the same second-order low-pass before
 * the projection. The same filter on both keeps parameters explained that are constant in the last link's frame.
 *
 * Columns in Nm for 3 kg, 0.3 kg m and 0.03 kg m^2, the units of `column`. 42 filters of two states. Cost: about 500
 * products; none if no task uses it.
 */
#ifndef TAUPERP_REGRESSOR_H
#define TAUPERP_REGRESSOR_H

#include "acceleration.h"
#include "bank.h"

#define REGRESSOR_COLUMNS   5u
#define REGRESSOR_MASS_KG   3.0
#define REGRESSOR_MOMENT    0.3  /* kg m */
#define REGRESSOR_INERTIA   0.03 /* kg m^2 */
#define REGRESSOR_TOLERANCE 10   /* the soft projector's s in Nm, over the tolerance of a force in Nm per N */

typedef struct {
    uint32_t used; /* 1: a task uses it, 0: none does */
    channel_config_t low_pass;
} regressor_config_t;

typedef struct {
    num_t column[REGRESSOR_COLUMNS][ROBOT_MAX_JOINTS]; /* filtered: m, mc along x, y, z of the last link, I */
    num_t torque[ROBOT_MAX_JOINTS];                    /* y after the same filter, Nm */
    num_t slope[REGRESSOR_COLUMNS + 1u][ROBOT_MAX_JOINTS];
    num_t jacobian[MOTION_TWIST_ROWS][ROBOT_MAX_JOINTS]; /* of the last sample, like the following */
    vec3_t tool_x, tool_y, tool_z;
    vec3_t velocity, rate; /* of the end-effector point, m/s, and of the last link, rad/s */
    uint32_t token;        /* token.h */
    uint32_t saturations;
} regressor_t;

void regressor_init(regressor_t *self);

/* Call after acceleration_step of the same snapshot. `velocity`: joint velocities, rad/s. */
void regressor_step(regressor_t *self, const regressor_config_t *config, const observer_config_t *gains,
                    const robot_t *robot, const motion_t *motion, const observer_t *observer,
                    const acceleration_t *acceleration, const num_t velocity[]);

#endif
