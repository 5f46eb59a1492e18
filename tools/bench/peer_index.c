/* index_step with a peer's projection, and the fields that the guard reads afterwards. */
#include <string.h>

#include "peer.h"
#include "token.h"

static const float *torque_of(const subspace_config_t *config, const observer_t *observer) {
    return (config->order == (uint32_t)ORDER_PROJECT_FIRST) ? observer->update : observer->residual;
}

static void finish(index_t *self, const index_config_t *row, const regressor_t *regressor, unsigned rank) {
    self->token = token_next(regressor->token, TOKEN_INDEX, 0u);
    self->columns = 0; /* no limits on the explained part */

    self->kind = row->kind;
    self->rank = rank;
    self->converged = true;
}

static peer_task_t task_of(const subspace_config_t *config, index_kind_t kind, const motion_t *motion,
                           const vec3_t *sideways) {
    static const float down[3] = {0.0F, 0.0F, -1.0F}; /* an upright arm, so the direction is constant */
    return (peer_task_t){.jacobian = &motion->jacobian[0][0],
                         .acceleration = (kind == INDEX_PAYLOAD) ? &sideways->x : 0,
                         .down = down,
                         .lever = config->lever_m,
                         .tolerance = config->tolerance};
}

void peer_svd_index_step(index_t *self, const subspace_config_t *config, const index_config_t *row,
                         const robot_t *robot, const motion_t *motion, const observer_t *observer,
                         const acceleration_t *acceleration, const regressor_t *regressor) {
    const index_kind_t kind = (index_kind_t)row->kind;
    const float *const torque = torque_of(config, observer);
    (void)robot;
    if ((kind != INDEX_PAYLOAD) && (kind != INDEX_CONTACT)) {
        memcpy(self->unexplained, torque, sizeof(self->unexplained));
        finish(self, row, regressor, 0);
        return;
    }
    float singular[PEER_COLUMNS];
    const peer_task_t task = task_of(config, kind, motion, &acceleration->sideways);
    const unsigned rank = peer_svd_project(&task, torque, self->unexplained, singular);
    finish(self, row, regressor, rank);
}

void peer_qr_index_step(index_t *self, const subspace_config_t *config, const index_config_t *row, const robot_t *robot,
                        const motion_t *motion, const observer_t *observer, const acceleration_t *acceleration,
                        const regressor_t *regressor) {
    const index_kind_t kind = (index_kind_t)row->kind;
    const float *const torque = torque_of(config, observer);
    (void)robot;
    if ((kind != INDEX_PAYLOAD) && (kind != INDEX_CONTACT)) {
        memcpy(self->unexplained, torque, sizeof(self->unexplained));
        finish(self, row, regressor, 0);
        return;
    }
    const peer_task_t task = task_of(config, kind, motion, &acceleration->sideways);
    finish(self, row, regressor, peer_qr_project(&task, torque, self->unexplained));
}

void peer_pinocchio_motion_step(motion_t *self, const robot_t *robot, const float q[], const float qd[]) {
    (void)robot;
    peer_pinocchio_terms(q, qd, self->momentum, self->coriolis, self->gravity, &self->jacobian[0][0]);
}

#ifdef __arm__
#include <stddef.h>

#include "semihosting.h"

/* Eigen's code for large matrices is linked, but fixed-size matrices must not use it: an image that allocates ends. */
void *malloc(size_t bytes);
void free(void *block);

void *malloc(size_t bytes) {
    (void)bytes;
    semihosting_exit(1);
}

void free(void *block) {
    if (block != NULL) {
        semihosting_exit(1);
    }
}
#endif
