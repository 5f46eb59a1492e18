/* locate: finds the touched link and the force after a trip.
 *
 * The change of r since before the contact, D in size, is compared with what a force on each link can cause. A link's
 * candidate is a force in its middle and a moment over its half length rho, so the point of contact need not be known.
 *
 *     A = [J^T, rho W^T]
 *     change = A w + noise
 *     cost = chi^2 / 2 + sum of ln(R_cc / s), minus the logarithm of the evidence
 *     chi^2 = change . e / sigma^2
 *     e = (I + A A^T / s^2)^-1 change
 *
 * R and e come from soft.h. A link near the tip can explain more than a link near the base; the sum is the penalty for
 * that. sigma is LOCATE_NOISE_NM or LOCATE_SHARE of D, the larger one. The force is that of A^T e / s^2.
 *
 * Each step evaluates one link, over LOCATE_PASSES passes. The answer is the link with the lowest cost if the next one
 * is more than LOCATE_LEAD worse and it explains the change. Otherwise it is 0: not known.
 *
 * Cost of a step during the search: one decomposition of six columns, a projection, a quotient per joint, a logarithm
 * per column.
 */
#ifndef TAUPERP_LOCATE_H
#define TAUPERP_LOCATE_H

#include "lever.h"
#include "soft.h"

#define LOCATE_PASSES   3u
#define LOCATE_SOFT     SOFT_MIN /* s, Nm per N */
#define LOCATE_NOISE_NM 0.15
#define LOCATE_SHARE    0.01
#define LOCATE_SCALE    16.0 /* costs are kept over this, so that they fit */
#define LOCATE_LEAD     (1.0 / LOCATE_SCALE)
#define LOCATE_WORST    (60.0 / LOCATE_SCALE) /* above this cost no link explains the change */

typedef struct {
    num_t before[ROBOT_MAX_JOINTS]; /* r before the contact, a slow mean */
    num_t cost[ROBOT_MAX_JOINTS];   /* over LOCATE_SCALE, mean over the passes so far */
    num_t force[ROBOT_MAX_JOINTS][3];
    num_t largest[ROBOT_MAX_JOINTS]; /* D at which `force` was found */
    uint32_t steps;                  /* left; 0: done, or never begun */
    uint32_t link;                   /* that was touched, 1 to n; 0: not known, or not yet */
    vec3_t force_n;                  /* on the robot, base frame */
    soft_t soft;
} locate_t;

void locate_init(locate_t *self);

/* A trip: the search begins. */
void locate_begin(locate_t *self, uint32_t joints);

/* Once a tick. `calm`: nothing touches the arm, so that r has its value without a contact. During the search it
 * uses the link that motion_step has kept, and sets the next one. Returns true in the tick that ends the search. */
bool locate_step(locate_t *self, const lever_config_t *shape, uint32_t joints, motion_t *motion, const num_t residual[],
                 bool calm);

#endif
