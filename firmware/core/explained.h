/* explained: how large is what the task explains, and is it more than the task can be?
 *
 * A projection by itself permits anything inside its span: with a payload task and nothing in the gripper, 300 N up or
 * down at the tip leave no index. So the coefficients w of the explained part are estimated and held against limits:
 *     payload   weight     -slack to mass_max (g + a_g) + slack, along gravity, in N
 *               sideways   up to mass_max |a| + slack, along the commanded acceleration, in N
 *               moment     up to mass_max (g + |a|) arm_max + moment_slack, in Nm
 *     regressor the same of mass and first moment, at rest
 *     contact   |F| up to force_max, |M| up to moment_max
 * and in every task |r| of each joint up to residual_max.
 *
 * w minimises |A w - e|^2 + s^2 |w|^2, e being index.h's explained part through the observer's low-pass. Each tick does
 * one sweep of coordinate descent (Gauss-Seidel on the normal equations), which converges over some ten ticks while the
 * arm turns little. s, the softness in Nm per N, keeps noise out of the directions that hardly move a joint; there w is
 * estimated too small, by s^2 / (sigma^2 + s^2), and the limit on |r| is what is left.
 *
 * Forces in N, moments in Nm. Cost: about 170 products and 6 divisions for six columns.
 */
#ifndef TAUPERP_EXPLAINED_H
#define TAUPERP_EXPLAINED_H

#include "acceleration.h"
#include "index.h"

#define EXPLAINED_FORCE_LIMIT                                                                                          \
    400.0 /* N; largest limit on a coefficient, whatever a block states; moments over the lever */

typedef enum { EXPLAINED_NOTHING = 0, EXPLAINED_FORCE = 1, EXPLAINED_MOMENT = 2, EXPLAINED_RESIDUAL = 3 } excess_t;

/* The part of a task's row that bounds what it explains. */
typedef struct {
    num_t mass_max_kg;     /* payload */
    num_t arm_max_m;       /* payload: distance of its centre of mass from the tip */
    num_t force_max_n;     /* contact */
    num_t moment_max_nm;   /* contact */
    num_t force_slack_n;   /* payload: for model error and noise */
    num_t moment_slack_nm; /* payload */
    num_t residual_max_nm[ROBOT_MAX_JOINTS];
} explained_config_t;

typedef struct {
    num_t coefficient[SUBSPACE_MAX_COLUMNS]; /* w in the order of the columns; moments over the lever, in N */
    num_t torque[ROBOT_MAX_JOINTS];          /* e, filtered, Nm */
    excess_t excess;                         /* of the last step, whatever the debounce */
    num_t value;                             /* what exceeds its limit, in N or Nm */
    num_t limit;
    uint32_t joint;             /* EXPLAINED_RESIDUAL: 0 to n-1 */
    uint32_t above;             /* consecutive ticks beyond a limit */
    bool tripped;               /* by the last step */
    const index_config_t *task; /* of the last step: another task has other coefficients */
    uint32_t token;             /* token.h */
    uint32_t saturations;
} explained_t;

void explained_init(explained_t *self);
void explained_step(explained_t *self, const explained_config_t *limits, const subspace_config_t *config,
                    uint32_t debounce_ticks, const robot_t *robot, const observer_t *observer,
                    const acceleration_t *acceleration, const index_config_t *task, const index_t *index);

#endif
