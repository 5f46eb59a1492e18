/* observer: the external joint torque from the generalised momentum (eq. 21), without any acceleration.
 *
 *     r+ = a r + (1 - a) [ tau + C^T qd - g - (p_k - p_{k-1}) / T ],   a = exp(-K T)
 *
 * is the exact discretisation of eq. 21 with the p(0) that the paper leaves out: the first sample only sets p(0), and
 * r starts at zero. C^T qd - g is the mean of both ends of the interval. tau is the sample where that is the mean over
 * the last cycle (TORQUE_INTERVAL), else the mean of the samples at both ends. A step may bridge up to CONFIG_MAX_GAP
 * cycles, with the constants of that distance, as if everything had changed steadily in between.
 *
 * r in Nm, positive where the robot pushes on the world (r = -J^T F_on_robot). Cost: 7 products a joint.
 */
#ifndef TAUPERP_OBSERVER_H
#define TAUPERP_OBSERVER_H

#include "config.h"
#include "motion.h"

typedef struct {
    num_t residual[ROBOT_MAX_JOINTS]; /* zero behind the last joint */
    num_t momentum[ROBOT_MAX_JOINTS]; /* of the last sample */
    num_t drift[ROBOT_MAX_JOINTS];    /* C^T qd - g of the last sample */
    num_t torque[ROBOT_MAX_JOINTS];
    num_t decay; /* a of the last step: what is left of anything filtered along with r */
    uint32_t saturations;
    bool started;
} observer_t;

void observer_init(observer_t *self);

/* gap: cycles since the last sample, 1 to CONFIG_MAX_GAP; anything else starts the observer again at this sample. */
void observer_step(observer_t *self, const observer_config_t *config, uint32_t joints, const motion_t *motion,
                   const num_t torque[], uint32_t gap);

#endif
