/* sensor: removes the offset and the friction from a joint's torque reading. `tauperp calibrate` finds both.
 *
 * The friction is the Coulomb friction between the sensor and the link: `friction_nm` times the sign of the velocity.
 * Below SENSOR_FULL_FRICTION_RAD_S it is proportional to the velocity, so that noise at rest does not switch it. Units:
 * Nm, rad/s. Bounds: |offset| and friction up to SENSOR_MAX_NM, |torque| up to 330, |velocity| up to 25. Within these
 * bounds nothing overflows in Q9.22. Cost: about 12 instructions per joint.
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

/* True if the settings are finite and within their bounds. */
bool sensor_config_is_valid(const sensor_config_t *config);

/* Computes the link's torque from the measured one. `torque` and `corrected` may be the same array. */
void sensor_correct(const sensor_config_t *config, uint32_t joints, const num_t *velocity, const num_t *torque,
                    num_t *corrected);

#endif
