/* acceleration: decides whether the payload task may explain the commanded acceleration.
 *
 * A payload of mass m pulls with m a across gravity, where a is the commanded acceleration of the end-effector. The
 * guard must not trust a without a check, because the column of a explains every force along it. The column is
 * therefore in use only while both conditions hold:
 *   - a matters: mass_max |a| is at least `force_floor_n`. Only the part of a across gravity counts.
 *   - a agrees with the motion: |a commanded - a measured| is at most `error_max`. Both pass the observer's low-pass.
 *     The measured one is the difference quotient of the tip's velocity J qd.
 * If a condition fails, the torque of a real payload stays unexplained: the guard then detects more, not less.
 *
 * The index of the soft projector must not jump, so `trust` scales its column. `trust` rises from 0 to 1 while mass_max
 * |a| goes from the floor to twice the floor. It falls to 0 over the last quarter of error_max.
 *
 * Accelerations in m/s^2, base frame. Cost: about 40 products.
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
    vec3_t sideways;  /* u_a, or zero: an input of index_step */
    num_t across;     /* part of the command across gravity, m/s^2, while the column is in use; else zero */
    num_t trust;      /* 0 to 1: factor of the column for the soft projector; continuous in both conditions */
    num_t size;       /* |a commanded| while it agrees with the motion, m/s^2; else zero */
    uint32_t token;   /* token.h */
    uint32_t saturations;
} acceleration_t;

void acceleration_init(acceleration_t *self);

/* Call after observer_step of the same snapshot. `velocity`: joint velocities, rad/s. */
void acceleration_step(acceleration_t *self, const acceleration_config_t *config, const observer_config_t *gains,
                       const observer_t *observer, const robot_t *robot, const motion_t *motion, const num_t velocity[],
                       vec3_t commanded, num_t mass_max_kg);

#endif
