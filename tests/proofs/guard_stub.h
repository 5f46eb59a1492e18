/* guard_stub: the functions of guard.h as stubs that leave anything behind, for harnesses of the code that calls them.
 * The other harnesses show the functions themselves. */
#ifndef TAUPERP_GUARD_STUB_H
#define TAUPERP_GUARD_STUB_H

#include "guard.h"
#include "proof.h"

static uint32_t refusals; /* calls of guard_refuse */

static void there(void *object, size_t size) {
    HOLDS(__CPROVER_w_ok(object, size), "the object is there");
}

guard_status_t guard_init(guard_t *self, const guard_config_t *config) {
    guard_status_t status;
    guard_t any;
    there(self, sizeof(*self));
    HOLDS(__CPROVER_r_ok(config, sizeof(*config)), "the block is there");
    *self = any;
    self->config = (status == GUARD_OK) ? config : 0;
    self->company = GUARD_ALONE;
    return status;
}

void guard_refuse(guard_t *self) {
    there(self, sizeof(*self));
    self->config = 0;
    self->company = GUARD_ALONE;
    ++refusals;
}

void guard_join(guard_t *self, bool second) {
    there(self, sizeof(*self));
    self->company = GUARD_PAIRED;
    self->second = second;
}

bool guard_is_alone(const guard_t *self) {
    return self->company == GUARD_ALONE;
}

void guard_note_start(guard_t *self, guard_start_t cause, uint32_t restarts, guard_variant_t variant) {
    there(self, sizeof(*self));
}

void guard_receive(guard_t *self, const can_frame_t *frame, uint64_t now_us) {
    there(self, sizeof(*self));
    HOLDS(__CPROVER_r_ok(frame, sizeof(*frame)), "the frame is there");
}

bool guard_cycle_complete(const guard_t *self) {
    bool complete;
    HOLDS(__CPROVER_r_ok(self, sizeof(*self)), "the guard is there");
    return complete;
}

void guard_look(guard_t *self, uint64_t now_us, guard_finding_t *finding) {
    guard_finding_t any;
    there(self, sizeof(*self));
    there(finding, sizeof(*finding));
    *finding = any;
}

void guard_tell(const guard_t *self, const guard_finding_t *finding, opinion_t *opinion) {
    opinion_t any;
    HOLDS(__CPROVER_r_ok(self, sizeof(*self)) && __CPROVER_r_ok(finding, sizeof(*finding)), "guard and finding");
    there(opinion, sizeof(*opinion));
    *opinion = any;
}

static void any_verdict(guard_output_t *out) {
    bool permitted, withheld;
    there(out, sizeof(*out));
    out->permitted = permitted;
    out->withheld = withheld;
}

void guard_decide(guard_t *self, uint64_t now_us, const guard_finding_t *finding, const opinion_t *own,
                  const opinion_t *other, guard_output_t *out) {
    there(self, sizeof(*self));
    HOLDS(__CPROVER_r_ok(finding, sizeof(*finding)), "the finding is there");
    HOLDS(__CPROVER_r_ok(own, sizeof(*own)) && __CPROVER_r_ok(other, sizeof(*other)), "both opinions are there");
    any_verdict(out);
}

void guard_say(guard_t *self, guard_output_t *out) {
    there(self, sizeof(*self));
    there(out, sizeof(*out));
}

void guard_tick(guard_t *self, uint64_t now_us, guard_output_t *out) {
    there(self, sizeof(*self));
    any_verdict(out);
}

static bool confirmed_as; /* what the copy of the permission was made of */

void guard_confirm(const guard_output_t *own, can_frame_t *stop_command) {
    there(stop_command, sizeof(*stop_command));
    confirmed_as = own->permitted && !own->withheld;
}

void guard_note_tick_time(guard_t *self, uint32_t tick_us) {
    there(self, sizeof(*self));
}

void guard_trip(guard_t *self, guard_reason_t reason) {
    there(self, sizeof(*self));
}

#endif
