/* sensor: what a joint's torque sensor reads besides the torque of the link. Found by `tauperp calibrate`.
 *
 * An offset, and the Coulomb friction of what lies between the sensor and the link: friction times the velocity's sign,
 * proportional to the velocity below SENSOR_FULL_FRICTION_RAD_S so that noise at rest does not switch it.
 * Units: Nm, rad/s. Bounds: |offset| and friction up to SENSOR_MAX_NM, |torque| up to 330, |velocity| up to 25: then
 * nothing overflows in Q9.22. Cost: about 12 instructions a joint.
 */
#ifndef TAUPERP_SENSOR_H
#define TAUPERP_SENSOR_H

#include "robot.h"

#define SENSOR_MAX_NM              64
#define SENSOR_FULL_FRICTION_RAD_S 0.05

typedef struct {
    num_t offset_nm[ROBOT_MAX_JOINTS];
    num_t friction_nm[ROBOT_MAX_JOINTS]; /* not negative */
} sensor_config_t;

/* The settings are finite and within their bounds. */
bool sensor_config_is_valid(const sensor_config_t *config);

/* The link's torque from the measured one. `torque` and `corrected` may be the same array. */
void sensor_correct(const sensor_config_t *config, uint32_t joints, const num_t *velocity, const num_t *torque,
                    num_t *corrected);

#endif
