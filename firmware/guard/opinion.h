/* opinion: the data that the channels exchange in a tick, and whether two opinions agree.
 *
 * Two guards of different numeric types take the same frames (pair.h). In each tick both look first, then exchange
 * their opinions, then decide. A wish to stop of either stops both; a state that permits more is entered only if both
 * are ready for it. So both are always in the same state, with the same trip number. What must be equal and is not, or
 * a residual or index that differs by more than its bound in more than AGREE_TICKS consecutive ticks, is FAULT
 * (GUARD_REASON_CHANNELS_DISAGREE). Each channel compares for itself.
 *
 * The hard projector has a step where a singular value crosses its tolerance, and rounding decides on which side it is.
 * While the ranks differ, and AGREE_RANK_CYCLES longer for the memory of the filters, the indexes are not compared.
 * Ranks that differ for AGREE_RANK_TICKS are FAULT. The soft projector has no such step.
 *
 * Only Q9.22 cuts off numbers beyond 512, and its filters then remember other numbers. A channel that cuts off wishes
 * to stop. From then on the indexes are not compared for AGREE_RANK_US.
 *
 * docs/decisions/channels.md derives the bounds. No type here depends on the numeric type; torques in 1e-6 Nm.
 * Cost: about 12 instructions a number.
 */
#ifndef TAUPERP_OPINION_H
#define TAUPERP_OPINION_H

#include <stdbool.h>
#include <stdint.h>

#define OPINION_MAX_JOINTS   8u
#define OPINION_MAX_CHANNELS 4u

#define AGREE_RESIDUAL    20000 /* 1e-6 Nm: r of a joint */
#define AGREE_INDEX       50000 /* 1e-6 Nm: d of a joint in any channel of the bank */
#define AGREE_TICKS       2u
#define AGREE_RANK_US     1000000u /* memory of the slowest channel: a high-pass at 1 Hz, to 0.2 % */
#define AGREE_RANK_MAX_US 500000u

typedef enum { WISH_FAULT = 0, WISH_STOP = 1, WISH_GO_ON = 2 } wish_t;

typedef struct {
    uint8_t wish;   /* wish_t: what the channel alone would do */
    uint8_t reason; /* of the wish: guard_reason_t */
    uint8_t joint;
    uint8_t category;
    uint8_t bank;  /* channel of the bank of `value` */
    int32_t value; /* 1e-6 Nm or N */
    int32_t threshold;
    bool healthy;   /* every input is good and nothing is above its limits */
    bool tested;    /* the self-test has passed */
    bool fresh;     /* a snapshot went through the stages in this tick */
    bool saturated; /* a number was cut off at the end of its range in this tick: the permission ends */
    bool hard;      /* the projector */
    uint8_t state;  /* before the decision: guard_state_t */
    uint8_t trip_number;
    uint8_t task; /* in force */
    uint8_t rank;
    uint8_t joints;
    uint8_t channels;
    uint16_t cycle;     /* of the newest Sync */
    uint32_t period_us; /* of a cycle */
    int32_t residual[OPINION_MAX_JOINTS];
    int32_t index[OPINION_MAX_CHANNELS][OPINION_MAX_JOINTS];
} opinion_t;

typedef struct {
    uint32_t apart;   /* consecutive ticks in which a number was beyond its bound */
    uint32_t rank_us; /* how long the ranks have differed */
    uint32_t wait_us; /* the indexes are not compared for so long */
} agree_t;

/* False: the two channels disagree. Once a tick. */
bool agree_step(agree_t *self, const opinion_t *own, const opinion_t *other);

/* The opinion whose wish is worse; of two that are alike, the first one. */
const opinion_t *opinion_worse(const opinion_t *first, const opinion_t *second);

#endif
