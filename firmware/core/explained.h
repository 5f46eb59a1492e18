/* explained: estimates the coefficients of what the task explains, and compares them with the limits of the task.
 *
 * A projection alone permits every torque inside its span. With a payload task and an empty gripper, 300 N up or down
 * at the tip give no index. This stage therefore estimates the coefficients w of the explained part and checks these
 * limits:
 *     payload   weight     -slack to mass_max (g + a_g) + slack, along gravity, in N
 *               sideways   up to mass_max |a| + slack, along the commanded acceleration, in N
 *               moment     up to mass_max (g + |a|) arm_max + moment_slack, in Nm
 *     regressor the same limits for mass and first moment, at rest
 *     contact   |F| up to force_max, |M| up to moment_max
 * In every task, |r| of each joint is limited to residual_max.
 *
 * w minimises |A w - e|^2 + s^2 |w|^2, where e is the explained part of index.h after the observer's low-pass. Each
 * tick makes one sweep of coordinate descent (Gauss-Seidel on the normal equations). It converges within about ten
 * ticks, in which the arm turns little. s is the softness in Nm per N. It suppresses noise in directions that hardly
 * move a joint. In such a direction the estimate is too small by the factor sigma^2 / (sigma^2 + s^2); only the limit
 * on |r| applies.
 *
 * The columns of the regressor are in Nm. Its s is REGRESSOR_TOLERANCE times the softness.
 *
 * Forces in N, moments in Nm. Cost: about 170 products and 6 divisions for six columns.
 */
#ifndef TAUPERP_EXPLAINED_H
#define TAUPERP_EXPLAINED_H

#include "acceleration.h"
#include "index.h"

#define EXPLAINED_FORCE_LIMIT                                                                                          \
    400.0 /* N; largest limit on a coefficient that a block may state. A moment counts over the lever. */

typedef enum { EXPLAINED_NOTHING = 0, EXPLAINED_FORCE = 1, EXPLAINED_MOMENT = 2, EXPLAINED_RESIDUAL = 3 } excess_t;

/* The limits of a task's row. */
typedef struct {
    num_t mass_max_kg;     /* payload */
    num_t arm_max_m;       /* payload: distance of its centre of mass from the tip */
    num_t force_max_n;     /* contact */
    num_t moment_max_nm;   /* contact */
    num_t force_slack_n;   /* payload: margin for model error and noise */
    num_t moment_slack_nm; /* payload */
    num_t residual_max_nm[ROBOT_MAX_JOINTS];
} explained_config_t;

typedef struct {
    num_t coefficient[SUBSPACE_MAX_COLUMNS]; /* w, in the order of the columns, N; a moment is divided by the lever */
    num_t torque[ROBOT_MAX_JOINTS];          /* e, filtered, Nm */
    excess_t excess;                         /* by the last step, without debounce */
    num_t value;                             /* the value that exceeds its limit, N or Nm */
    num_t limit;
    uint32_t joint;             /* EXPLAINED_RESIDUAL: 0 to n-1 */
    uint32_t above;             /* consecutive ticks beyond a limit */
    bool tripped;               /* by the last step */
    const index_config_t *task; /* row of the last step; the coefficients restart on another row */
    uint32_t token;             /* token.h */
    uint32_t saturations;
} explained_t;

void explained_init(explained_t *self);
void explained_step(explained_t *self, const explained_config_t *limits, const subspace_config_t *config,
                    uint32_t debounce_ticks, const robot_t *robot, const observer_t *observer,
                    const acceleration_t *acceleration, const index_config_t *task, const index_t *index);

#endif
