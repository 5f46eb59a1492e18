#include "session.h"

#include "guard_reason.h"

#define RESET_HALF_S 0.02 /* half period of the square wave that requests a reset */

bool session_init(session_t *self, const kernel_setup_t *setup) {
    self->setup = setup;
    self->asking = 0;
    self->cycle = 0;
    frames_init(&self->frames, setup);
    return tracks_init(&self->tracks, setup);
}

bool session_cycle(session_t *self, uint32_t cycle, uint32_t task, const double *acceleration,
                   const reading_t *reading) {
    bool good = true;
    for (uint32_t missed = self->cycle + 1u; (self->cycle != 0u) && (missed < cycle) && good; ++missed) {
        frames_skip(&self->frames);
        good = tracks_tick(&self->tracks, self->setup, &self->frames, (uint64_t)missed * self->setup->period_us);
    }
    self->cycle = cycle;
    frames_cycle(&self->frames, cycle, task, acceleration, reading);
    if (self->tracks.out[0].permitted) {
        self->asking = 0;
    } else {
        const uint32_t half = 1u + (uint32_t)(RESET_HALF_S * 1e6 / self->setup->period_us);
        frames_reset(&self->frames, (self->asking++ / half) % 2u, self->tracks.out[0].trip_number);
    }
    const uint64_t now_us = (uint64_t)cycle * self->setup->period_us;
    return good && tracks_tick(&self->tracks, self->setup, &self->frames, now_us) && self->frames.in_range;
}

bool session_permitted(const session_t *self) {
    return self->tracks.out[0].permitted;
}

void session_count_stop(const session_t *self, kernel_result_t *result) {
    if (reason_is_contact(self->tracks.out[0].reason)) {
        ++result->stops;
    } else {
        ++result->input_stops;
    }
}

void session_note_stop(const session_t *session, double time_s, double force_n, kernel_result_t *result) {
    const guard_output_t *const out = &session->tracks.out[0];
    result->stop_s = time_s;
    result->force_at_stop_n = force_n;
    result->reason = (uint32_t)out->reason;
    result->joint = out->joint;
    result->stop_value_nm = value_of(out->value_nm);
    result->stop_threshold_nm = value_of(out->threshold_nm);
}
