#include "arrays.h"
#include <stddef.h>

static void copy(num_t to[], const num_t from[], uint32_t count) {
    for (uint32_t i = 0; i < count; i++) {
        to[i] = from[i];
    }
}

static uint32_t saturations(const tauperp_core_t *core) {
    return core->motion.saturations + core->observer.saturations + core->acceleration.saturations +
           core->regressor.saturations + core->index.saturations + projection_saturations(&core->index.projection) +
           core->bank.saturations;
}

void tauperp_core_init(tauperp_core_t *self) {
    motion_init(&self->motion);
    observer_init(&self->observer);
    acceleration_init(&self->acceleration);
    regressor_init(&self->regressor);
    index_init(&self->index);
    bank_init(&self->bank);
    detector_init(&self->detector);
}

uint32_t tauperp_core_steps(tauperp_core_t *self, const guard_config_t *config, uint32_t rows, const uint8_t task[],
                            const num_t q[], const num_t qd[], const num_t tau[], const num_t acceleration[],
                            num_t residual[], num_t index[], num_t threshold[], uint8_t tripped[]) {
    const robot_t *robot = &config->robot;
    const uint32_t n = robot->joint_count;
    const uint32_t before = saturations(self);
    for (uint32_t row = 0; row < rows; row++) {
        const uint32_t at = row * n;
        const task_config_t *chosen = &config->task[task[row]];
        const num_t *const a = &acceleration[(size_t)row * 3u];
        const vec3_t wanted = {a[0], a[1], a[2]};
        motion_step(&self->motion, robot, &q[at], &qd[at]);
        observer_step(&self->observer, &config->observer, n, &self->motion, &tau[at], 1u);
        acceleration_step(&self->acceleration, &config->acceleration, &config->observer, &self->observer, robot,
                          &self->motion, &qd[at], wanted, chosen->limits.mass_max_kg);
        regressor_step(&self->regressor, &config->regressor, &config->observer, robot, &self->motion, &self->observer,
                       &self->acceleration, &qd[at]);
        index_step(&self->index, &config->subspace, &chosen->index, robot, &self->motion, &self->observer,
                   &self->acceleration, &self->regressor);
        bank_step(&self->bank, &config->bank, n, self->observer.gap, self->index.unexplained, self->index.sudden, 0u);
        detector_step(&self->detector, &chosen->detector, n, &self->bank);
        if (saturations(self) != before) {
            return row;
        }
        copy(&residual[at], self->observer.residual, n);
        copy(&index[at], self->detector.value_nm, n);
        copy(&threshold[at], self->detector.threshold_nm, n);
        tripped[row] = self->detector.tripped ? (uint8_t)(self->detector.joint + 1u) : (uint8_t)0;
    }
    return rows;
}

uint32_t tauperp_terms(const robot_t *robot, uint32_t rows, const num_t q[], const num_t qd[], num_t momentum[],
                       num_t coriolis[], num_t gravity[], num_t jacobian[]) {
    const uint32_t n = robot->joint_count;
    motion_t motion;
    motion_init(&motion);
    for (uint32_t row = 0; row < rows; row++) {
        const uint32_t at = row * n;
        motion_step(&motion, robot, &q[at], &qd[at]);
        if (motion.saturations != 0u) {
            return row;
        }
        copy(&momentum[at], motion.momentum, n);
        copy(&coriolis[at], motion.coriolis, n);
        copy(&gravity[at], motion.gravity, n);
        for (uint32_t k = 0; k < MOTION_TWIST_ROWS; k++) {
            copy(&jacobian[MOTION_TWIST_ROWS * at + k * n], motion.jacobian[k], n);
        }
    }
    return rows;
}
