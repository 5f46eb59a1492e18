/* observer: the external joint torque from the generalised momentum (eq. 21), without joint accelerations.
 *
 *     r+ = a r + (1 - a) [ tau + C^T qd - g - (p_k - p_{k-1}) / T ],   a = exp(-K T)
 *
 * This is the exact discretisation of eq. 21, with the p(0) that the paper omits: the first sample only sets p(0), and
 * r starts at zero. C^T qd - g is the mean of both ends of the interval. tau is the sample if the sample is the mean
 * over the last cycle (TORQUE_INTERVAL), else the mean of the samples at both ends. A step may bridge up to
 * OBSERVER_MAX_GAP cycles. It uses the constants of that distance, as if everything had changed linearly in between.
 *
 * The bracket is y, the one-tick residual before any filter. The step also writes (1 - a) y to `update`. With this
 * factor y keeps its resolution and its range in fixed point. Every filter of y (bank.h) divides by the factor.
 *
 * r and y in Nm, positive where the robot pushes on the world (r = -J^T F_on_robot). Cost: 9 products per joint.
 */
#ifndef TAUPERP_OBSERVER_H
#define TAUPERP_OBSERVER_H

#include "motion.h"

#define OBSERVER_MAX_GAP 4u /* cycles that one step may bridge */

/* Meaning of a torque reading: the mean since the last Sync, or the sample at it. */
typedef enum { TORQUE_INTERVAL = 1, TORQUE_INSTANT = 2 } torque_sample_t;

/* Constants of the discretised observer for a step that bridges 1 to OBSERVER_MAX_GAP cycles. K is the gain in 1/s. */
typedef struct {
    num_t decay[OBSERVER_MAX_GAP];         /* a = exp(-K g T), g = 1, 2, ... */
    num_t gain[OBSERVER_MAX_GAP];          /* 1 - a */
    num_t momentum_gain[OBSERVER_MAX_GAP]; /* (1 - a) / (g T), 1/s */
    uint32_t torque_sample;                /* torque_sample_t */
} observer_config_t;

typedef struct {
    num_t residual[ROBOT_MAX_JOINTS]; /* r; zero from joint_count on */
    num_t momentum[ROBOT_MAX_JOINTS]; /* of the last sample */
    num_t drift[ROBOT_MAX_JOINTS];    /* C^T qd - g of the last sample */
    num_t torque[ROBOT_MAX_JOINTS];
    num_t update[ROBOT_MAX_JOINTS]; /* (1 - a) y of the last step, the increment of a r; zero after a start */
    num_t decay;                    /* a of the last step; zero after a start */
    num_t gain;                     /* 1 - a of the last step; one after a start */
    uint32_t gap;                   /* cycles that the last step bridged; zero after a start */
    uint32_t token;                 /* token.h */
    uint32_t saturations;
    bool started;
} observer_t;

void observer_init(observer_t *self);

/* gap: cycles since the last sample, 1 to OBSERVER_MAX_GAP. Any other value restarts the observer at this sample. */
void observer_step(observer_t *self, const observer_config_t *config, uint32_t joints, const motion_t *motion,
                   const num_t torque[], uint32_t gap);

#endif
