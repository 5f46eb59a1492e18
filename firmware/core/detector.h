/* detector: which joint's index is above its threshold, by how much, and for how long.
 *
 * A trip needs `debounce_ticks` consecutive ticks above the threshold of one and the same joint. The count goes on
 * when the task changes. Of several joints the one that is furthest above its threshold, as a ratio, is reported.
 * An index that is not a number counts as above every threshold.
 */
#ifndef TAUPERP_DETECTOR_H
#define TAUPERP_DETECTOR_H

#include "config.h"

typedef struct {
    uint32_t above[ROBOT_MAX_JOINTS]; /* consecutive ticks above the threshold, held at UINT32_MAX */
    bool tripped;                     /* by the last step */
    bool any_above;                   /* by the last step, whatever the debounce */
    uint32_t joint;                   /* the joint nearest to, or furthest above, its threshold: 0 to n-1 */
    num_t value_nm;                   /* its index, signed */
    num_t threshold_nm;
} detector_t;

void detector_init(detector_t *self);
void detector_step(detector_t *self, const task_config_t *task, uint32_t joints, const num_t value[]);

#endif
