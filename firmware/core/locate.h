/* locate: finds the touched link and the force after a trip.
 *
 * The change of y, the one-tick residual, since before the contact is compared with what a force on each link can
 * cause. It is a mean over a time after the trip: at the trip the force has only begun, and noise hides the small
 * torques that distinguish a link from its neighbours. What the task explained before the contact (a payload) is
 * subtracted: its coefficients stay, its columns follow the motion. Each joint has a weight: the largest threshold over
 * its own. A link's candidate is a force in its middle and a moment over its half length rho, so the point of contact
 * need not be known.
 *
 *     A = W [J^T, rho W^T]     change = W mean        D: the largest entry of `change`
 *     change = A w + noise
 *     cost = chi^2 / 2 + sum of ln(R_cc / s), minus the logarithm of the evidence
 *     chi^2 = change . e / sigma^2
 *     e = (I + A A^T / s^2)^-1 change
 *
 * R and e come from soft.h. A link near the tip can explain more than a link near the base; the sum is the penalty for
 * that. sigma is the largest threshold over LOCATE_NOISES, or LOCATE_SHARE of D if that is more. The force is that of
 * A^T e / s^2, a mean over the same time.
 *
 * After the mean each step evaluates one link. The answer is the link with the lowest cost if the next one is more than
 * LOCATE_LEAD worse and it explains the change. Otherwise it is 0: not known.
 *
 * Cost of a step: before a trip a product per column; in the mean that for each joint; in the search one decomposition
 * of six columns, a projection, a quotient per joint, a logarithm per column.
 */
#ifndef TAUPERP_LOCATE_H
#define TAUPERP_LOCATE_H

#include "explained.h"
#include "lever.h"
#include "soft.h"

#define LOCATE_SOFT     SOFT_MIN /* s, Nm per N */
#define LOCATE_NOISES   4        /* standard deviations of the change in a threshold */
#define LOCATE_NOISE_NM 0.05     /* the least sigma */
#define LOCATE_HEAVIEST 16       /* the largest weight */
#define LOCATE_SLOW     8        /* updates in the time constant of a slow mean; one value learns in each tick */
#define LOCATE_SHARE    0.01
#define LOCATE_SCALE    16.0 /* costs are kept over this, so that they fit */
#define LOCATE_LEAD     (2.0 / LOCATE_SCALE)
#define LOCATE_WORST    (60.0 / LOCATE_SCALE) /* above this cost no link explains the change */

typedef struct {
    num_t before[ROBOT_MAX_JOINTS];   /* r before the contact, beyond the part of `load`; a slow mean */
    num_t load[SUBSPACE_MAX_COLUMNS]; /* coefficients of the task's columns before the contact, a slow mean */
    num_t change[ROBOT_MAX_JOINTS];   /* mean since the trip */
    num_t weight[ROBOT_MAX_JOINTS];   /* 1 to LOCATE_HEAVIEST */
    uint32_t next;                    /* joint and coefficient that learn next */
    num_t sigma;
    num_t part;         /* of one tick in the mean */
    num_t best;         /* lowest cost so far, over LOCATE_SCALE */
    num_t second;       /* the next one */
    uint32_t best_link; /* with the lowest cost, 1 to n */
    uint32_t steps;     /* left; 0: done, or never begun */
    uint32_t link;      /* that was touched, 1 to n; 0: not known, or not yet */
    vec3_t force_n;     /* on the robot, base frame; of the link with the lowest cost */
    soft_t soft;
} locate_t;

void locate_init(locate_t *self);

/* A trip: the mean begins. ticks: its length, at least 1. threshold: of each joint, Nm. */
void locate_begin(locate_t *self, uint32_t joints, uint32_t ticks, const num_t threshold[]);

/* Once a tick. `calm`: nothing touches the arm, so that y has its value without a contact. During the search it
 * uses the link that motion_step has kept, and sets the next one. Returns true in the tick that ends the search. */
bool locate_step(locate_t *self, const lever_config_t *shape, uint32_t joints, motion_t *motion,
                 const observer_t *observer, const index_t *index, const explained_t *explained, bool calm);

#endif
