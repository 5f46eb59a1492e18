/* acceleration: may the payload task explain what the commanded acceleration asks for?
 *
 * A payload of mass m pulls with m a across gravity. The controller says which acceleration a of the end-effector it
 * commands, and a guard must not believe it without looking: the column of a explains every force along it. So the
 * column is there only while both hold:
 *   - it can matter: mass_max |a| is at least `force_floor_n`, a being the part across gravity;
 *   - it agrees with the motion: |a commanded - a measured| is at most `error_max`, both through the observer's
 * low-pass. The measured one is the difference quotient of the tip's velocity J qd. Where one of them fails, the torque
 * that a real payload would cause stays unexplained: the guard sees more, not less. `trust` is for the soft projector,
 * whose index must not jump: it rises from 0 to 1 while mass_max |a| goes from the floor to twice the floor, and falls
 * to 0 over the last quarter of error_max.
 *
 * m/s^2 in the base frame. Cost: about 40 products.
 */
#ifndef TAUPERP_ACCELERATION_H
#define TAUPERP_ACCELERATION_H

#include "observer.h"

typedef struct {
    num_t force_floor_n; /* positive */
    num_t error_max;     /* m/s^2, positive */
} acceleration_config_t;

typedef struct {
    vec3_t velocity;  /* of the tip at the last step, m/s */
    vec3_t measured;  /* filtered */
    vec3_t commanded; /* filtered */
    vec3_t sideways;  /* u_a, or zero: what index_step takes */
    num_t across;     /* size of the commanded part across gravity, m/s^2, while the column is there; else zero */
    num_t trust;      /* 0 to 1: how much of the column a soft projector takes, continuous in both conditions */
    num_t size;       /* of the commanded acceleration while it agrees with the motion, m/s^2; else zero */
    uint32_t token;   /* token.h */
    uint32_t saturations;
} acceleration_t;

void acceleration_init(acceleration_t *self);

/* After observer_step of the same snapshot. `velocity`: joint velocities, rad/s. */
void acceleration_step(acceleration_t *self, const acceleration_config_t *config, const observer_config_t *gains,
                       const observer_t *observer, const robot_t *robot, const motion_t *motion, const num_t velocity[],
                       vec3_t commanded, num_t mass_max_kg);

#endif
