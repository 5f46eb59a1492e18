/* index: the collision index in force, chosen by the task (the paper's flowchart, Fig. 4).
 *
 *     none     r                                    the residual itself
 *     payload  d_p   A = [Jw^T, Jv^T u_g, Jv^T a]     what no payload at the end-effector explains (eqs. 7, 14)
 *     contact  d_e   A = J^T                          what no wrench at the end-effector explains (eq. 20)
 *
 * a is the part of the end-effector's desired acceleration across gravity, in m/s^2: a column that is as long as it
 * matters, so that the rank tolerance drops it when the acceleration is about zero or parallel to gravity. Columns of
 * moment are multiplied by the configured lever, so that A is in Nm per N throughout (Nm per m/s^2 for a).
 * BASIS_FILTERED sends the columns through the observer's own low-pass, which removes most of the lag between r and
 * an instantaneous basis.
 *
 * A change of task may come with any tick. What the old task explained of r at that tick fades with the observer's
 * own decay, since r is linear in the torque and remembers it so: the index of the new task is taken of r without that
 * fading part. It neither steps when the task changes, nor hides a torque that goes on acting.
 *
 * Index and residual in Nm, acceleration in m/s^2 in the base frame.
 */
#ifndef TAUPERP_INDEX_H
#define TAUPERP_INDEX_H

#include "observer.h"
#include "subspace.h"

typedef struct {
    num_t value[ROBOT_MAX_JOINTS];                        /* the index in force */
    num_t fading[ROBOT_MAX_JOINTS];                       /* what earlier tasks explained, decaying */
    num_t column[SUBSPACE_MAX_COLUMNS][ROBOT_MAX_JOINTS]; /* the basis as it was projected on */
    num_t weight; /* of the filtered basis: 0 at a change of task, then towards 1 */
    subspace_t subspace;
    uint32_t kind; /* index_kind_t of the last step, INDEX_OFF before it */
    uint32_t saturations;
} index_t;

void index_init(index_t *self);
void index_step(index_t *self, const subspace_config_t *config, index_kind_t kind, const robot_t *robot,
                const motion_t *motion, const observer_t *observer, vec3_t acceleration);

#endif
