#include "detector.h"

void detector_init(detector_t *self) {
    *self = (detector_t){0};
}

void detector_step(detector_t *self, const task_config_t *task, uint32_t joints, const num_t value[]) {
    self->tripped = false;
    self->any_above = false;
    self->joint = 0;
    for (uint32_t i = 0; i < joints; ++i) {
        const num_t size = num_abs(value[i]);
        const bool above = !(size <= task->threshold_nm[i]); /* so that NaN is above */
        if (!above) {
            self->above[i] = 0;
        } else if (self->above[i] < UINT32_MAX) {
            ++self->above[i];
        }
        self->tripped = self->tripped || (self->above[i] >= task->debounce_ticks);
        self->any_above = self->any_above || above;
        /* Ratios compared without a division: size_i / threshold_i > size_best / threshold_best. */
        const num_wide_t here = num_wide(size, task->threshold_nm[self->joint]);
        const num_wide_t best = num_wide(num_abs(value[self->joint]), task->threshold_nm[i]);
        if ((here > best) || !num_finite(value[i])) {
            self->joint = i;
        }
    }
    self->value_nm = value[self->joint];
    self->threshold_nm = task->threshold_nm[self->joint];
}
