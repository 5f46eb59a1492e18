/* detector: which joint's index is above its threshold, in which channel, by how much, and for how long.
 *
 * A joint counts as above while any of the task's channels is above its threshold there. A trip needs `debounce_ticks`
 * consecutive ticks above at one and the same joint. The count goes on when the task changes. The reported joint is the
 * one whose count is full; of several, and without one, the joint and channel furthest above or nearest to its
 * threshold, as a ratio. An index that is not a number counts as above every threshold.
 */
#ifndef TAUPERP_DETECTOR_H
#define TAUPERP_DETECTOR_H

#include "bank.h"

/* The part of a task's row that says from where on it is a collision. */
typedef struct {
    uint32_t debounce_ticks;                                 /* at least 1 */
    uint32_t channels;                                       /* bit per channel that the task watches, at least one */
    num_t threshold_nm[BANK_MAX_CHANNELS][ROBOT_MAX_JOINTS]; /* positive */
} detector_config_t;

typedef struct {
    uint32_t above[ROBOT_MAX_JOINTS];     /* consecutive ticks above the threshold, held at UINT32_MAX */
    bool tripped;                         /* by the last step */
    bool any_above;                       /* by the last step, whatever the debounce */
    uint32_t joint;                       /* the reported joint: 0 to n-1 */
    num_t value_nm[ROBOT_MAX_JOINTS];     /* of each joint, in the channel nearest to its threshold: signed */
    num_t threshold_nm[ROBOT_MAX_JOINTS]; /* the threshold in force there */
    uint8_t channel[ROBOT_MAX_JOINTS];    /* and its number */
    uint32_t token;                       /* token.h */
} detector_t;

void detector_init(detector_t *self);
void detector_step(detector_t *self, const detector_config_t *task, uint32_t joints, const bank_t *bank);

#endif
