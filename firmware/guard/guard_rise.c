#include "guard_parts.h"

#define RISE_LEARNING_US 500000u /* the robot still stops, and may press harder meanwhile */
#define RISE_SNAPSHOTS   3u

void rise_start(rise_t *self, uint64_t now_us) {
    *self = (rise_t){.begun_us = now_us};
}

bool rise_step(rise_t *self, const detector_t *detector, uint32_t joints, uint64_t now_us) {
    const bool learning = (now_us - self->begun_us) < RISE_LEARNING_US;
    bool above = false;
    for (uint32_t i = 0; i < joints; ++i) {
        if (detector->threshold_nm[i] > NUM(0)) {
            uint32_t held = 0;
            const num_t before = self->reference[i];
            const num_t ratio = num_div(num_abs(detector->value_nm[i]), detector->threshold_nm[i], &held);
            const num_t bound = num_add(NUM(1), num_mul(NUM(1.5), before, &held), &held);
            self->reference[i] = learning ? num_max(before, ratio) : num_min(before, ratio);
            if (!learning && (ratio > bound)) {
                above = true;
                self->joint = i;
            }
        }
    }
    self->snapshots = above ? (self->snapshots + ((self->snapshots < RISE_SNAPSHOTS) ? 1u : 0u)) : 0u;
    return self->snapshots >= RISE_SNAPSHOTS;
}
