/* index: what the task in force does not explain (the paper's flowchart, Fig. 4, doi 10.1007/s12541-019-00130-z).
 *
 * A task is a row of data. It names the columns A of torque that it can cause:
 *     residual  none                                  d = r: everything is unexplained
 *     payload   A = [Jw^T, Jv^T u_g, Jv^T u_a]        d_p: what no payload at the end-effector explains (eqs. 7, 14)
 *     contact   the chosen rows of J^T                d_e with all six (eq. 20); d_f with the force rows alone
 * u_g and u_a are unit vectors: along gravity, and along the part of the commanded acceleration across gravity. So
 * every coefficient is a force in N (or a moment over the configured lever), which explained.h can hold against a
 * limit. The column of u_a is there only while the acceleration can matter and agrees with the motion (acceleration.h).
 *
 * Two orders:
 *     ORDER_PROJECT_FIRST  projects y, the residual of one tick, with the basis of the same tick; bank.h filters what
 * is left. What the task explains never enters a filter, so a change of task needs no special case. ORDER_FILTER_FIRST
 * projects r, as the paper does. r lags the basis by the observer's time constant.
 *
 * Index and residual in Nm. With ORDER_PROJECT_FIRST `unexplained` and `explained` are observer.h's `update`, split.
 */
#ifndef TAUPERP_INDEX_H
#define TAUPERP_INDEX_H

#include "acceleration.h"
#include "observer.h"
#include "subspace.h"

typedef enum {
    INDEX_OFF = 0,      /* the task is not configured: asking for it is an invalid task */
    INDEX_RESIDUAL = 1, /* nothing is explained */
    INDEX_PAYLOAD = 2,
    INDEX_CONTACT = 3
} index_kind_t;

typedef enum { ORDER_FILTER_FIRST = 1, ORDER_PROJECT_FIRST = 2 } index_order_t;

#define INDEX_COMPONENTS     6u
#define INDEX_ALL_COMPONENTS 0x3Fu
#define INDEX_FORCE_COLUMN   3u /* of the payload's columns: weight; the moments are before it, u_a behind it */

/* How torque is projected, for every task. */
typedef struct {
    uint32_t order;  /* index_order_t */
    num_t tolerance; /* Nm per N: directions of force that move no joint by more count as unexplained */
    num_t lever_m;   /* a moment counts as a force on this lever, so that the tolerance has one unit */
    num_t softness;  /* Nm per N: of explained.h's estimate, at least the tolerance */
} subspace_config_t;

/* The part of a task's row that says what it explains. */
typedef struct {
    uint32_t kind;       /* index_kind_t */
    uint32_t components; /* INDEX_CONTACT: bits 0-2 force x y z, 3-5 moment x y z, base frame; else zero */
} index_config_t;

typedef struct {
    num_t unexplained[ROBOT_MAX_JOINTS];                  /* d, of r or of observer.h's `update` as the order says */
    num_t explained[ROBOT_MAX_JOINTS];                    /* the rest of it */
    num_t column[SUBSPACE_MAX_COLUMNS][ROBOT_MAX_JOINTS]; /* A of this tick */
    uint32_t columns;
    subspace_t subspace;
    uint32_t kind;  /* index_kind_t of the last step, INDEX_OFF before it */
    uint32_t token; /* token.h */
    uint32_t saturations;
} index_t;

void index_init(index_t *self);

void index_step(index_t *self, const subspace_config_t *config, const index_config_t *task, const robot_t *robot,
                const motion_t *motion, const observer_t *observer, const acceleration_t *acceleration);

#endif
