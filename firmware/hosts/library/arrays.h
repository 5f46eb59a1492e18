/* arrays: the firmware's mathematics over many instants in one call, for numpy. No wire, no guard, no clock.
 *
 * All arrays are dense and row-major: `rows` times joint_count numbers unless stated. The functions stop before the
 * first row with a result that the numeric type cannot represent, and return the number of completed rows.
 */
#ifndef TAUPERP_ARRAYS_H
#define TAUPERP_ARRAYS_H

#include "detector.h"
#include "guard.h"

/* All stages from the joints' readings to the detector. */
typedef struct {
    motion_t motion;
    observer_t observer;
    acceleration_t acceleration;
    regressor_t regressor;
    index_t index;
    bank_t bank;
    detector_t detector;
} tauperp_core_t;

void tauperp_core_init(tauperp_core_t *self);

/* One cycle per row, one period apart.
 *
 * task           (rows) as on the wire; each must be configured
 * q, qd, tau     rad, rad/s, Nm
 * acceleration   (rows, 3) m/s^2
 * residual, index, threshold   r, the index in the channel nearest to its threshold, and that threshold, Nm
 * tripped        (rows) joint, from 1, whose index was above its threshold for the debounce time; else 0
 */
uint32_t tauperp_core_steps(tauperp_core_t *self, const guard_config_t *config, uint32_t rows, const uint8_t task[],
                            const num_t q[], const num_t qd[], const num_t tau[], const num_t acceleration[],
                            num_t residual[], num_t index[], num_t threshold[], uint8_t tripped[]);

/* Momentum, C^T qd and gravity torque, Nm s and Nm; jacobian (rows, 6, joint_count) of the end-effector point. */
uint32_t tauperp_terms(const robot_t *robot, uint32_t rows, const num_t q[], const num_t qd[], num_t momentum[],
                       num_t coriolis[], num_t gravity[], num_t jacobian[]);

#endif
