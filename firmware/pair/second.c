#include "second.h"

#include "guard.h"

/* Compiled for the second channel only: TAUPERP_SECOND. */

typedef struct {
    guard_t guard;
    guard_output_t out; /* of the last decision */
} state_t;

_Static_assert(sizeof(state_t) <= sizeof(tauperp_second_t), "SECOND_WORDS is too small");
_Static_assert(_Alignof(state_t) <= _Alignof(tauperp_second_t), "the storage is not aligned for the state");
_Static_assert(sizeof(guard_finding_t) <= sizeof(tauperp_second_finding_t), "a finding does not fit");

static state_t *state_of(tauperp_second_t *self) {
    return (state_t *)(void *)self;
}

static const state_t *const_state_of(const tauperp_second_t *self) {
    return (const state_t *)(const void *)self;
}

uint32_t tauperp_second_start(tauperp_second_t *self, const void *block) {
    state_t *const state = state_of(self);
    state->out = (guard_output_t){.withheld = true};
    const guard_status_t status = guard_init(&state->guard, (const guard_config_t *)block);
    guard_join(&state->guard, true);
    return (uint32_t)status;
}

void tauperp_second_note_start(tauperp_second_t *self, uint32_t cause, uint32_t restarts, uint32_t variant) {
    guard_note_start(&state_of(self)->guard, (guard_start_t)cause, restarts, (guard_variant_t)variant);
}

void tauperp_second_receive(tauperp_second_t *self, const can_frame_t *frame, uint64_t now_us) {
    guard_receive(&state_of(self)->guard, frame, now_us);
}

bool tauperp_second_complete(const tauperp_second_t *self) {
    return guard_cycle_complete(&const_state_of(self)->guard);
}

void tauperp_second_look(tauperp_second_t *self, uint64_t now_us, tauperp_second_finding_t *finding,
                         opinion_t *opinion) {
    guard_finding_t *const found = (guard_finding_t *)(void *)finding;
    guard_look(&state_of(self)->guard, now_us, found);
    guard_tell(&state_of(self)->guard, found, opinion);
}

bool tauperp_second_decide(tauperp_second_t *self, uint64_t now_us, const tauperp_second_finding_t *finding,
                           const opinion_t *own, const opinion_t *other) {
    state_t *const state = state_of(self);
    state->out = (guard_output_t){.withheld = true};
    guard_decide(&state->guard, now_us, (const guard_finding_t *)(const void *)finding, own, other, &state->out);
    return state->out.permitted && !state->out.withheld;
}

void tauperp_second_confirm(const tauperp_second_t *self, can_frame_t *stop_command) {
    guard_confirm(&const_state_of(self)->out, stop_command);
}

void tauperp_second_note_tick_time(tauperp_second_t *self, uint32_t tick_us) {
    guard_note_tick_time(&state_of(self)->guard, tick_us);
}

void tauperp_second_trip(tauperp_second_t *self, uint32_t reason) {
    guard_trip(&state_of(self)->guard, (guard_reason_t)reason);
}
