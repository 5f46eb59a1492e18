#include "detector.h"

void detector_init(detector_t *self) {
    *self = (detector_t){0};
}

void detector_step(detector_t *self, const task_config_t *task, uint32_t joints, const num_t value[]) {
    bool tripped = false;
    bool any_above = false;
    uint32_t worst = 0;
    num_t worst_size = num_abs(value[0]);
    num_t worst_threshold = task->threshold_nm[0];
    for (uint32_t i = 0; i < joints; ++i) {
        const num_t size = num_abs(value[i]);
        const num_t threshold = task->threshold_nm[i];
        uint32_t above = 0;
        bool worse = num_wide(size, worst_threshold) > num_wide(worst_size, threshold); /* as ratios, no division */
        if (!(size <= threshold)) {                                                     /* so that NaN is above */
            above = self->above[i] + ((self->above[i] < UINT32_MAX) ? 1u : 0u);
            tripped = tripped || (above >= task->debounce_ticks);
            any_above = true;
            worse = worse || !num_finite(size);
        }
        self->above[i] = above;
        if (worse) {
            worst = i;
            worst_size = size;
            worst_threshold = threshold;
        }
    }
    self->tripped = tripped;
    self->any_above = any_above;
    self->joint = worst;
    self->value_nm = value[worst];
    self->threshold_nm = worst_threshold;
}
