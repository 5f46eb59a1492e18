/* index: what the task in force does not explain (the paper's flowchart, Fig. 4, doi 10.1007/s12541-019-00130-z).
 *
 * A task is a row of data. It names the columns A of torque that it can cause:
 *     residual  none                                  d = r: everything is unexplained
 *     payload   A = [Jw^T, Jv^T u_g, Jv^T u_a]        d_p: what no payload at the end-effector explains (eqs. 7, 14)
 *     regressor A = the torque of unit payloads           d_r: the same without a commanded acceleration (regressor.h)
 *     contact   the wrench components that this contact can transmit, at a point: d_f. With all six in the base frame
 *               at the end-effector point this is d_e (eq. 20). A contact at a point has three forces and no moment.
 * u_g and u_a are unit vectors: along gravity, and along the part of the commanded acceleration across gravity. So
 * every coefficient is a force in N (or a moment over the configured lever), which explained.h can hold against a
 * limit. The column of u_a is there only while the acceleration can matter and agrees with the motion (acceleration.h).
 *
 * A contact may also say which of its components change fast. What the other components explain must change slowly: the
 * remainder `sudden` takes out the fast components alone, and a high-passed channel (bank.h) looks at it.
 *
 * Two orders:
 *     ORDER_PROJECT_FIRST  projects y, the residual of one tick, with the basis of the same tick; bank.h filters what
 * is left. What the task explains never enters a filter, so a change of task needs no special case. ORDER_FILTER_FIRST
 * projects r, as the paper does. r lags the basis by the observer's time constant.
 *
 * Two projectors: PROJECTOR_HARD (subspace.h) explains a direction above the tolerance completely, PROJECTOR_SOFT
 * (soft.h) explains it the more the larger its singular value is, with the tolerance as s.
 *
 * d_r projects the filtered y of regressor.h with columns filtered alike, softly and with ORDER_PROJECT_FIRST only.
 *
 * Index and residual in Nm. With ORDER_PROJECT_FIRST `unexplained`, `explained` and `sudden` are parts of observer.h's
 * `update`.
 */
#ifndef TAUPERP_INDEX_H
#define TAUPERP_INDEX_H

#include "acceleration.h"
#include "observer.h"
#include "regressor.h"
#include "soft.h"
#include "subspace.h"

typedef enum {
    INDEX_OFF = 0,      /* the task is not configured: asking for it is an invalid task */
    INDEX_RESIDUAL = 1, /* nothing is explained */
    INDEX_PAYLOAD = 2,
    INDEX_CONTACT = 3,
    INDEX_REGRESSOR = 4
} index_kind_t;

typedef enum { ORDER_FILTER_FIRST = 1, ORDER_PROJECT_FIRST = 2 } index_order_t;
typedef enum { PROJECTOR_HARD = 1, PROJECTOR_SOFT = 2 } index_projector_t;

/* Where a contact's components are. */
typedef enum {
    FRAME_TIP = 0,  /* base axes, at the end-effector point */
    FRAME_BASE = 1, /* `axis` in the base frame, at `point` */
    FRAME_TOOL = 2  /* `axis` in the last link's frame, at `point` */
} index_frame_t;

#define INDEX_COMPONENTS     6u
#define INDEX_ALL_COMPONENTS 0x3Fu
#define INDEX_FORCE_COLUMN   3u /* of the payload's columns: weight; the moments are before it, u_a behind it */

/* How torque is projected, for every task. */
typedef struct {
    uint32_t order;     /* index_order_t */
    uint32_t projector; /* index_projector_t */
    num_t tolerance;    /* Nm per N. Hard: directions of force that move no joint by more are unexplained. Soft: s */
    num_t lever_m;      /* a moment counts as a force on this lever, so that the tolerance has one unit */
    num_t softness;     /* Nm per N: of explained.h's estimate, at least the tolerance */
} subspace_config_t;

/* The part of a task's row that says what it explains. */
typedef struct {
    uint32_t kind;       /* index_kind_t */
    uint32_t components; /* INDEX_CONTACT: bits 0-2 force along the axes, 3-5 moment about them; else zero */
    uint32_t fast;       /* those of them that may change fast, at least one; 0: the task does not look at `sudden` */
    uint32_t frame;      /* index_frame_t */
    num_t axis[3][3];    /* the axes: unit vectors, one a row; FRAME_TIP: zero */
    num_t point[3];      /* from the end-effector point, in the last link's frame, m; FRAME_TIP: zero */
} index_config_t;

typedef struct {
    num_t unexplained[ROBOT_MAX_JOINTS];                  /* d, of r or of observer.h's `update` as the order says */
    num_t explained[ROBOT_MAX_JOINTS];                    /* the rest of it */
    num_t sudden[ROBOT_MAX_JOINTS];                       /* d with the fast components alone; zero without any */
    num_t column[SUBSPACE_MAX_COLUMNS][ROBOT_MAX_JOINTS]; /* A of this tick */
    uint32_t columns;
    num_t smallest; /* singular value of A, or a bound below it (subspace.h); 0 without columns */
    uint32_t rank;  /* directions that are explained; soft: columns, less one near a singularity */
    bool converged;
    subspace_t subspace;
    soft_t soft;
    uint32_t kind;  /* index_kind_t of the last step, INDEX_OFF before it */
    uint32_t token; /* token.h */
    uint32_t saturations;
} index_t;

void index_init(index_t *self);

/* The components of a contact in the order of its columns: the fast ones first. Returns how many there are. */
uint32_t index_order(const index_config_t *task, uint32_t component[INDEX_COMPONENTS]);

void index_step(index_t *self, const subspace_config_t *config, const index_config_t *task, const robot_t *robot,
                const motion_t *motion, const observer_t *observer, const acceleration_t *acceleration,
                const regressor_t *regressor);

#endif
