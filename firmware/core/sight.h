/* sight: the links on which the active index detects no force.
 *
 * The index does not contain the part that its task explains. This part depends on the posture. A link counts as seen
 * if a force of `force_n` in its middle, along at least one axis of the base, would bring the index of some joint to
 * its threshold in a channel without a high-pass. Otherwise a constant force of that size on the link is not detected:
 * the link is blind.
 *
 * Each tick evaluates one axis of one link, with the columns of that tick. So every link has a new answer after three
 * ticks per joint. Before its first answer a link counts as blind. For the same time after a task change, the answers
 * are those of the previous task.
 *
 * Cost: one projection and about 80 products.
 */
#ifndef TAUPERP_SIGHT_H
#define TAUPERP_SIGHT_H

#include "detector.h"
#include "index.h"
#include "lever.h"

/* The reaction while the index detects no force on a link that the active task needs. */
typedef enum {
    SIGHT_REPORT = 0,   /* it is reported */
    SIGHT_SLOW = 1,     /* and the permission is for the reduced speed only */
    SIGHT_WITHDRAW = 2, /* and the permission ends */
    SIGHT_REACTIONS = 3
} sight_reaction_t;

typedef struct {
    uint32_t reaction; /* sight_reaction_t */
    num_t force_n;     /* positive, at most 500 */
} sight_config_t;

typedef struct {
    uint32_t blind; /* bit per link, link 1 the lowest */
    uint32_t axis;  /* of the next step: 0 to 2 */
    bool seen;      /* the watched link, along an axis before */
    uint32_t token; /* token.h */
    uint32_t saturations;
} sight_t;

void sight_init(sight_t *self, uint32_t joints);

/* Uses the link that motion_step has kept, and sets the one that the next motion_step keeps. */
void sight_step(sight_t *self, const sight_config_t *config, const lever_config_t *shape, uint32_t joints,
                motion_t *motion, index_t *index, const bank_config_t *bank, const detector_config_t *task,
                uint32_t token);

#endif
