/* pair: the guard in two channels, or in one, for every board and host.
 *
 * First channel: this build's numeric type (float32), Golub and Kahan's singular values. Second channel: Q9.22, Jacobi
 * rotations (second.h). Both receive the same frames and the same time. In each tick
 *   1. both evaluate their inputs and run their stages;
 *   2. they exchange their opinions (opinion.h), and each compares the other's with its own;
 *   3. both decide: a wish to stop of either stops both, a disagreement is FAULT;
 *   4. the first one writes the frames, and `Permission` in StopCommand; the second one writes the inverted copy and
 *      seals the frame. Neither alone can make a frame that permits.
 * A stop in only one channel therefore stops the robot in the same tick, and latches in both with one trip number.
 *
 * Without a second block there is one channel: every function is the one of guard.h with the same name, and
 * GuardStatus.Channels reports it. An image that is built with TAUPERP_CHANNELS=1 has no second channel at all.
 */
#ifndef TAUPERP_PAIR_H
#define TAUPERP_PAIR_H

#include "guard.h"
#include "second.h"

#ifndef TAUPERP_CHANNELS
#define TAUPERP_CHANNELS 2
#endif

typedef struct {
    guard_t guard; /* the first channel */
#if TAUPERP_CHANNELS == 2
    tauperp_second_t second;
#endif
} pair_t;

/* `first`, `second`: the blocks of one installation in both numeric types. GUARD_BAD_PAIR if they are of different
 * ones. `second` NULL: one channel. */
guard_status_t pair_init(pair_t *self, const guard_config_t *first, const void *second);
void pair_note_start(pair_t *self, guard_start_t cause, uint32_t restarts, guard_variant_t variant);
void pair_receive(pair_t *self, const can_frame_t *frame, uint64_t now_us);
bool pair_cycle_complete(const pair_t *self);
void pair_tick(pair_t *self, uint64_t now_us, guard_output_t *out);
void pair_note_tick_time(pair_t *self, uint32_t tick_us);
void pair_trip(pair_t *self, guard_reason_t reason);

#endif
