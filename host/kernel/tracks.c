#include "tracks.h"

#include <math.h>
#include <string.h>

static double number(num_t value) {
#ifdef TAUPERP_FIXED
    return (double)value * 0x1p-22;
#else
    return (double)value;
#endif
}

bool tracks_init(tracks_t *self, const kernel_setup_t *setup) {
    memset(self, 0, sizeof *self);
    for (uint32_t i = 0; i < setup->guards; ++i) {
        if (guard_init(&self->guard[i], (const guard_config_t *)setup->config[i]) != GUARD_OK) {
            return false;
        }
        guard_note_start(&self->guard[i], GUARD_START_COMMANDED, 0, GUARD_VARIANT_LOCKSTEP);
    }
    return true;
}

bool tracks_tick(tracks_t *self, const kernel_setup_t *setup, const frames_t *frames, uint64_t now_us) {
    bool good = true;
    for (uint32_t i = 0; i < setup->guards; ++i) {
        for (uint32_t k = 0; k < frames->count; ++k) {
            guard_receive(&self->guard[i], &frames->frame[k], now_us);
        }
        guard_tick(&self->guard[i], now_us, &self->out[i]);
        good = good && (self->out[i].state != GUARD_STATE_FAULT);
    }
    return good;
}

/* Filters one sample with a detector's sections, direct form II transposed. */
static double filtered(const kernel_detector_t *detector, detector_track_t *track, uint32_t joint, double value) {
    for (uint32_t s = 0; s < detector->sections; ++s) {
        const double *const c = detector->section[s];
        double *const z0 = &track->state[s][0][joint];
        double *const z1 = &track->state[s][1][joint];
        const double out = c[0] * value + *z0;
        *z0 = c[1] * value - c[4] * out + *z1;
        *z1 = c[2] * value - c[5] * out;
        value = out;
    }
    return value;
}

/* The filter state after an infinitely long constant `value`, so that no filter starts with a step. */
static void settle(const kernel_detector_t *detector, detector_track_t *track, uint32_t joint, double value) {
    for (uint32_t s = 0; s < detector->sections; ++s) {
        const double *const c = detector->section[s];
        const double out = value * (c[0] + c[1] + c[2]) / (1.0 + c[4] + c[5]);
        track->state[s][1][joint] = c[2] * value - c[5] * out;
        track->state[s][0][joint] = c[1] * value - c[4] * out + track->state[s][1][joint];
        value = out;
    }
    track->above = 0;
}

/* Largest |index| of each channel and joint of the first guard. */
static void note_channels(const tracks_t *self, const kernel_setup_t *setup, kernel_result_t *result) {
    for (uint32_t c = 0; c < setup->channels; ++c) {
        for (uint32_t joint = 0; joint < setup->joints; ++joint) {
            const double value = fabs(number(self->guard[0].bank.channel[c].output[joint]));
            result->channel_max[c][joint] = fmax(result->channel_max[c][joint], value);
        }
    }
}

void tracks_detect(tracks_t *self, const kernel_setup_t *setup, bool watched, double time_s, double since_onset_s,
                   kernel_result_t *result) {
    if (watched && (since_onset_s < 0.0)) {
        note_channels(self, setup, result);
    }
    for (uint32_t k = 0; k < setup->detectors; ++k) {
        const kernel_detector_t *const detector = &setup->detector[k];
        detector_track_t *const track = &self->detector[k];
        const guard_output_t *const out = &self->out[detector->guard];
        const num_t *const source = (detector->source == KERNEL_RESIDUAL) ? out->residual : out->index;
        double ratio = 0.0;
        for (uint32_t joint = 0; !watched && (joint < setup->joints); ++joint) {
            settle(detector, track, joint, number(source[joint]));
        }
        if (!watched) {
            continue;
        }
        for (uint32_t joint = 0; joint < setup->joints; ++joint) {
            const double value = fabs(filtered(detector, track, joint, number(source[joint])));
            const double own = number(out->threshold[joint]);
            const double threshold = (detector->source == KERNEL_OWN) ? own : detector->threshold[joint];
            ratio = (threshold > 0.0) ? fmax(ratio, value / threshold) : ratio;
            if (since_onset_s < 0.0) {
                result->free_max[k][joint] = fmax(result->free_max[k][joint], value);
            }
        }
        track->above = (ratio > 1.0) ? track->above + 1u : 0u;
        const bool trips = track->above >= detector->debounce;
        if (since_onset_s < 0.0) {
            result->before[k] = fmax(result->before[k], ratio);
            if (trips && isnan(result->early_s[k])) {
                result->early_s[k] = time_s;
            }
        } else {
            result->during[k] = fmax(result->during[k], ratio);
            if (trips && isnan(result->delay_s[k])) {
                result->delay_s[k] = since_onset_s;
            }
        }
    }
}

void result_init(kernel_result_t *result, uint64_t run) {
    memset(result, 0, sizeof *result);
    result->number = run;
    result->onset_s = result->release_s = result->stop_s = (double)NAN;
    result->force_at_stop_n = (double)NAN;
    for (int k = 0; k < KERNEL_DETECTORS; ++k) {
        result->delay_s[k] = result->early_s[k] = (double)NAN;
    }
}
