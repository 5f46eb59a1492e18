#include "sensor.h"

bool sensor_config_is_valid(const sensor_config_t *config) {
    bool holds = true;
    for (uint32_t i = 0; i < (uint32_t)ROBOT_MAX_JOINTS; ++i) {
        const num_t offset = config->offset_nm[i];
        const num_t friction = config->friction_nm[i];
        /* Uncovered in fixed: 2 branches, 2 conditions. Every pattern of Q9.22 is a number. */
        holds = holds && num_finite(offset) && num_finite(friction);
        holds = holds && (num_abs(offset) <= NUM(SENSOR_MAX_NM));
        holds = holds && (friction >= NUM(0)) && (friction <= NUM(SENSOR_MAX_NM));
    }
    return holds;
}

void sensor_correct(const sensor_config_t *config, uint32_t joints, const num_t *velocity, const num_t *torque,
                    num_t *corrected) {
    uint32_t ignored = 0; /* the bounds exclude saturation, unless the block was corrupted after its check */
    for (uint32_t i = 0; i < joints; ++i) {
        const num_t speed = num_mul(velocity[i], NUM(1.0 / SENSOR_FULL_FRICTION_RAD_S), &ignored);
        const num_t direction = num_max(NUM(-1), num_min(NUM(1), speed));
        const num_t friction = num_mul(config->friction_nm[i], direction, &ignored);
        corrected[i] = num_subtract(num_subtract(torque[i], config->offset_nm[i], &ignored), friction, &ignored);
    }
}
