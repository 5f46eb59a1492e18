/* index: the part of the torque that the active task does not explain (Fig. 4 of the paper,
 * doi 10.1007/s12541-019-00130-z).
 *
 * A task is a row of data. It names the columns A of torque that the task can cause:
 *     residual  none                                  d = r: everything is unexplained
 *     payload   A = [Jw^T, Jv^T u_g, Jv^T u_a]        d_p: what no payload at the end-effector explains (eqs. 7, 14)
 *     regressor A = the torque of unit payloads       d_r: the same, without a commanded acceleration (regressor.h)
 *     contact   the wrench components that this contact can transmit, at a point: d_f. With all six components in the
 *               base frame at the end-effector point this is d_e (eq. 20). A point contact has three forces, no moment.
 * u_g and u_a are unit vectors: along gravity, and along the part of the commanded acceleration across gravity. Every
 * coefficient is therefore a force in N (or a moment over the configured lever), which explained.h limits. The column
 * of u_a is in use only while the acceleration matters and agrees with the motion (acceleration.h).
 *
 * A contact may also name the components that change fast. The other components must then change slowly: the remainder
 * `sudden` is d with the fast components alone, and a channel with a high-pass (bank.h) watches it.
 *
 * Two orders:
 *     ORDER_PROJECT_FIRST  projects y, the one-tick residual, with the basis of the same tick. bank.h filters the
 *                          unexplained part. What the task explains enters no filter: a task change needs no care.
 *     ORDER_FILTER_FIRST   projects r, as the paper does. r lags the basis by the observer's time constant.
 *
 * Two projectors: PROJECTOR_HARD (subspace.h) explains a direction above the tolerance completely. PROJECTOR_SOFT
 * (soft.h) explains a direction the more, the larger its singular value is; its s is the tolerance.
 *
 * d_r projects the filtered y of regressor.h with columns that passed the same filter. It always uses PROJECTOR_SOFT
 * and ORDER_PROJECT_FIRST.
 *
 * Index and residual in Nm. With ORDER_PROJECT_FIRST, `unexplained`, `explained` and `sudden` are parts of `update` of
 * observer.h.
 */
#ifndef TAUPERP_INDEX_H
#define TAUPERP_INDEX_H

#include "acceleration.h"
#include "observer.h"
#include "projection.h"
#include "regressor.h"

typedef enum {
    INDEX_OFF = 0,      /* not configured: a command of this task is invalid */
    INDEX_RESIDUAL = 1, /* no columns: everything is unexplained */
    INDEX_PAYLOAD = 2,
    INDEX_CONTACT = 3,
    INDEX_REGRESSOR = 4,
    INDEX_KIND_COUNT = 5
} index_kind_t;

typedef enum { ORDER_FILTER_FIRST = 1, ORDER_PROJECT_FIRST = 2 } index_order_t;
typedef enum { PROJECTOR_HARD = 1, PROJECTOR_SOFT = 2 } index_projector_t;

/* Frame of a contact's components. */
typedef enum {
    FRAME_TIP = 0,  /* base axes, at the end-effector point */
    FRAME_BASE = 1, /* `axis` in the base frame, at `point` */
    FRAME_TOOL = 2  /* `axis` in the last link's frame, at `point` */
} index_frame_t;

#define INDEX_COMPONENTS     6u
#define INDEX_ALL_COMPONENTS 0x3Fu
#define INDEX_FORCE_COLUMN   3u /* payload: column of the weight. The moments come before it, u_a after it. */

/* Projection settings, the same for every task. */
typedef struct {
    uint32_t order;     /* index_order_t */
    uint32_t projector; /* index_projector_t */
    num_t tolerance;    /* Nm per N. Hard: a direction of force that moves no joint by more is unexplained. Soft: s. */
    num_t lever_m;      /* divides moments, so that the tolerance has one unit */
    num_t softness;     /* Nm per N: s of the estimate in explained.h, at least the tolerance */
} subspace_config_t;

/* The columns of a task's row. */
typedef struct {
    uint32_t kind;       /* index_kind_t */
    uint32_t components; /* INDEX_CONTACT: bits 0-2 force along the axes, 3-5 moment about them; else zero */
    uint32_t fast;       /* components that may change fast; 0: the task does not use `sudden` */
    uint32_t frame;      /* index_frame_t */
    num_t axis[3][3];    /* unit vectors, one per row; zero for FRAME_TIP */
    num_t point[3];      /* from the end-effector point, in the last link's frame, m; zero for FRAME_TIP */
} index_config_t;

typedef struct {
    num_t unexplained[ROBOT_MAX_JOINTS]; /* d, part of r or of `update` of observer.h, according to the order */
    num_t explained[ROBOT_MAX_JOINTS];   /* the explained part of the same torque */
    num_t sudden[ROBOT_MAX_JOINTS];      /* d with the fast components alone; zero without fast components */
    num_t column[SUBSPACE_MAX_COLUMNS][ROBOT_MAX_JOINTS]; /* A of this tick */
    uint32_t columns;
    num_t smallest; /* singular value of A, or a lower bound (subspace.h); 0 without columns */
    uint32_t rank;  /* number of explained directions; soft: columns, minus one near a singularity */
    bool converged;
    projection_t projection;
    uint32_t kind;  /* index_kind_t of the last step, INDEX_OFF before the first */
    uint32_t token; /* token.h */
    uint32_t saturations;
} index_t;

void index_init(index_t *self);

/* The components of a contact in the order of its columns: the fast ones first. Returns their number. */
uint32_t index_order(const index_config_t *task, uint32_t component[INDEX_COMPONENTS]);

void index_step(index_t *self, const subspace_config_t *config, const index_config_t *task, const robot_t *robot,
                const motion_t *motion, const observer_t *observer, const acceleration_t *acceleration,
                const regressor_t *regressor);

/* The unexplained part of any torque, with the columns of the last step. ROBOT_JOINTS entries each. */
void index_reject(index_t *self, const num_t torque[], num_t unexplained[]);

#endif
