/* second: the interface of the second channel for the first one. No type here depends on the numeric type.
 *
 * second.c and all portable folders are compiled once more for it: with TAUPERP_FIXED=1 (Q9.22), TAUPERP_SECOND=1
 * (Jacobi rotations, projection.h) and the prefix of names.h on every symbol. The two channels share no mutable state.
 */
#ifndef TAUPERP_SECOND_H
#define TAUPERP_SECOND_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "frame.h"
#include "opinion.h"
#include "values.h"

#define SECOND_WORDS 516u

/* One guard's state. Its content is private. */
typedef struct {
    uint64_t storage[SECOND_WORDS];
} tauperp_second_t;

/* The result of an evaluation, for the decision of the same tick. */
typedef struct {
    uint64_t storage[8];
} tauperp_second_finding_t;

/* As the functions of guard.h with these names. `block`: the same installation in Q9.22, aligned to 4 bytes. Returns
 * guard_status_t as a number. */
uint32_t tauperp_second_start(tauperp_second_t *self, const void *block);
void tauperp_second_note_start(tauperp_second_t *self, uint32_t cause, uint32_t restarts, uint32_t variant);
void tauperp_second_receive(tauperp_second_t *self, const can_frame_t *frame, uint64_t now_us);
bool tauperp_second_complete(const tauperp_second_t *self);
void tauperp_second_look(tauperp_second_t *self, uint64_t now_us, tauperp_second_finding_t *finding,
                         opinion_t *opinion);

/* Decides, and writes its copy of the permission to the first channel's StopCommand. True: it permits motion. */
bool tauperp_second_decide(tauperp_second_t *self, uint64_t now_us, const tauperp_second_finding_t *finding,
                           const opinion_t *own, const opinion_t *other);
void tauperp_second_confirm(const tauperp_second_t *self, can_frame_t *stop_command);
void tauperp_second_note_tick_time(tauperp_second_t *self, uint32_t tick_us);
void tauperp_second_trip(tauperp_second_t *self, uint32_t reason);

#endif
