/* regressor: the torque that a payload of any mass and shape asks of the joints, column by column, for d_r.
 *
 * A rigid body at the end-effector, with mass m, first moment m c about the end-effector point in the last link's frame
 * and an isotropic inertia I, asks for
 *     F = m (a - g) + alpha x mc + w x (w x mc)        M = mc x (a - g) + I alpha           torque = J^T [F; M]
 * with the point's acceleration a and the link's w and alpha. That is linear in (m, mc, I), so a task that explains
 * these five columns explains any such payload without knowing it. No commanded acceleration is believed: a and alpha
 * are difference quotients of J qd. J, w and the axes are means over the step, as the observer's terms are.
 *
 * Differences of a measured velocity are noisy. So columns and y go through the same second-order low-pass before the
 * projection. It keeps them in step: parameters that are constant in the last link's frame stay explained.
 *
 * Columns in Nm for 3 kg, 0.3 kg m and 0.03 kg m^2: the units of `column`. 42 filters of two states. Cost: about 500
 * products; none where no task asks for it.
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
    uint32_t used; /* 1: a task asks for it, 0: none does */
    channel_config_t low_pass;
} regressor_config_t;

typedef struct {
    num_t column[REGRESSOR_COLUMNS][ROBOT_MAX_JOINTS]; /* filtered: m, mc along x, y, z of the last link, I */
    num_t torque[ROBOT_MAX_JOINTS];                    /* y, filtered as they are, Nm */
    num_t slope[REGRESSOR_COLUMNS + 1u][ROBOT_MAX_JOINTS];
    num_t jacobian[MOTION_TWIST_ROWS][ROBOT_MAX_JOINTS]; /* of the last sample, as the rest */
    vec3_t tool_x, tool_y, tool_z;
    vec3_t velocity, rate; /* of the end-effector point, m/s, and of the last link, rad/s */
    uint32_t token;        /* token.h */
    uint32_t saturations;
} regressor_t;

void regressor_init(regressor_t *self);

/* After acceleration_step of the same snapshot. `velocity`: joint velocities, rad/s. */
void regressor_step(regressor_t *self, const regressor_config_t *config, const observer_config_t *gains,
                    const robot_t *robot, const motion_t *motion, const observer_t *observer,
                    const acceleration_t *acceleration, const num_t velocity[]);

#endif
