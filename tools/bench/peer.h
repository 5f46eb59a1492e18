/* peer: the alternatives to our core, in place of its two expensive functions: motion_step by CasADi's generated C or
 * by Pinocchio, index_step by Eigen's singular value decomposition or its pivoted QR.
 *
 * The observer, the detector and, in a whole tick, the guard around them are ours. The peers only project: they do not
 * estimate the explained part, so no limit applies to it. Float only.
 */
#ifndef TAUPERP_BENCH_PEER_H
#define TAUPERP_BENCH_PEER_H

#ifndef __cplusplus
#include "index.h"
#endif

enum { PEER_JOINTS = 7, PEER_STRIDE = 8, PEER_ROWS = 6, PEER_COLUMNS = 6 };

#ifdef __cplusplus
extern "C" {
#else
void peer_casadi_motion_step(motion_t *self, const robot_t *robot, const float q[], const float qd[]);
void peer_pinocchio_motion_step(motion_t *self, const robot_t *robot, const float q[], const float qd[]);
void peer_svd_index_step(index_t *self, const subspace_config_t *config, const index_config_t *row,
                         const robot_t *robot, const motion_t *motion, const observer_t *observer,
                         const acceleration_t *acceleration, const regressor_t *regressor);
void peer_qr_index_step(index_t *self, const subspace_config_t *config, const index_config_t *row, const robot_t *robot,
                        const motion_t *motion, const observer_t *observer, const acceleration_t *acceleration,
                        const regressor_t *regressor);
#endif

/* A task: the desired acceleration in m/s^2 and the unit vector of gravity, or no acceleration for a task of contact.
 * The functions project residual to rejected, both PEER_JOINTS, and return the rank. */
typedef struct {
    const float *jacobian; /* PEER_ROWS rows of PEER_STRIDE */
    const float *acceleration;
    const float *down;
    float lever;
    float tolerance;
} peer_task_t;

unsigned peer_svd_project(const peer_task_t *task, const float residual[], float rejected[], float singular[]);
unsigned peer_qr_project(const peer_task_t *task, const float residual[], float rejected[]);

/* Terms of the arm, each PEER_JOINTS; the Jacobian as PEER_ROWS rows of PEER_STRIDE. */
void peer_pinocchio_terms(const float q[], const float qd[], float momentum[], float coriolis[], float gravity[],
                          float jacobian[]);

#ifdef __cplusplus
}
#endif

#endif
