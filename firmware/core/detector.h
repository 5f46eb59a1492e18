/* detector: finds the joint and the channel whose index is above its threshold, by how much, and for how long.
 *
 * A joint is above while any channel of the task is above its threshold at that joint. A trip needs `debounce_ticks`
 * consecutive ticks above at the same joint. The count continues across a change of task. The reported joint is the one
 * whose count is full. Of several full counts, or of none, it is the joint with the largest ratio of index to
 * threshold. An index that is not a number is above every threshold.
 *
 * Nm. Cost: about 4 products per joint and channel.
 */
#ifndef TAUPERP_DETECTOR_H
#define TAUPERP_DETECTOR_H

#include "bank.h"

/* The detector's settings in a task's row. */
typedef struct {
    uint32_t debounce_ticks;                                 /* at least 1 */
    uint32_t channels;                                       /* bit per channel that the task uses, at least one */
    num_t threshold_nm[BANK_MAX_CHANNELS][ROBOT_MAX_JOINTS]; /* positive */
} detector_config_t;

typedef struct {
    uint32_t above[ROBOT_MAX_JOINTS];     /* consecutive ticks above the threshold, held at UINT32_MAX */
    bool tripped;                         /* by the last step */
    bool any_above;                       /* by the last step, without debounce */
    uint32_t joint;                       /* the reported joint: 0 to n-1 */
    num_t value_nm[ROBOT_MAX_JOINTS];     /* per joint, of the channel nearest to its threshold; signed */
    num_t threshold_nm[ROBOT_MAX_JOINTS]; /* threshold in force in that channel */
    uint8_t channel[ROBOT_MAX_JOINTS];    /* number of that channel, from 0 */
    uint32_t token;                       /* token.h */
} detector_t;

void detector_init(detector_t *self);
void detector_step(detector_t *self, const detector_config_t *task, uint32_t joints, const bank_t *bank);

#endif
