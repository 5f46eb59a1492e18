#include "kernel.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "plant.h"
#include "push.h"
#include "tracks.h"

#define PERMIT_LIMIT_S 3.0  /* a guard that has not permitted an arm at rest by then never will */
#define SETTLE_S       0.5  /* time at rest before a motion that does not wait for permission */
#define RESET_HALF_S   0.02 /* half period of the square wave that requests a reset */
#define WATCHED_S      0.3  /* observed time after the end of a push */
#define WARM_UP_S      1.0  /* start of a recording that is ignored */

void kernel_describe(uint32_t abi_sizes_versions[8]) {
    const uint32_t values[8] = {KERNEL_ABI,
                                (uint32_t)sizeof(kernel_setup_t),
                                (uint32_t)sizeof(kernel_run_t),
                                (uint32_t)sizeof(kernel_result_t),
                                (uint32_t)sizeof(kernel_recording_t),
                                (uint32_t)sizeof(kernel_injection_t),
                                mjVERSION_HEADER,
                                (uint32_t)mj_version()};
    memcpy(abi_sizes_versions, values, sizeof values);
}

/* The robot's controller and joints on the bus, and all guards and detectors that receive its frames. */
typedef struct {
    const kernel_setup_t *setup;
    frames_t frames;
    tracks_t tracks;
    uint32_t asking; /* cycles for which a reset has been requested */
    uint32_t cycle;  /* the last cycle; 0 before the first */
} session_t;

static bool session_init(session_t *self, const kernel_setup_t *setup) {
    self->setup = setup;
    self->asking = 0;
    self->cycle = 0;
    frames_init(&self->frames, setup);
    return tracks_init(&self->tracks, setup);
}

/* Sends one cycle and ticks the guards. For missing cycles before it, the guards first tick without frames. False if a
 * guard is in FAULT or a reading does not fit. */
static bool session_cycle(session_t *self, uint32_t cycle, uint32_t task, const double *acceleration,
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

static bool permitted(const session_t *self) {
    return self->tracks.out[0].permitted;
}

/* True if the guard stopped because of a computed value, not because of a missing, frozen or implausible input. */
static bool by_detection(const session_t *self) {
    const guard_reason_t reason = self->tracks.out[0].reason;
    return (reason == GUARD_REASON_COLLISION) || (reason == GUARD_REASON_EXPLAINED_FORCE) ||
           (reason == GUARD_REASON_EXPLAINED_MOMENT) || (reason == GUARD_REASON_RESIDUAL_LIMIT) ||
           (reason == GUARD_REASON_SUDDEN);
}

static void count_stop(const session_t *self, kernel_result_t *result) {
    if (by_detection(self)) {
        ++result->stops;
    } else {
        ++result->input_stops;
    }
}

static double value_of(num_t value) {
#ifdef TAUPERP_FIXED
    return (double)value * 0x1p-22;
#else
    return (double)value;
#endif
}

static void note_stop(const session_t *session, double time_s, double force_n, kernel_result_t *result) {
    const guard_output_t *const out = &session->tracks.out[0];
    result->stop_s = time_s;
    result->force_at_stop_n = force_n;
    result->reason = (uint32_t)out->reason;
    result->joint = out->joint;
    result->stop_value_nm = value_of(out->value_nm);
    result->stop_threshold_nm = value_of(out->threshold_nm);
}

/* --- simulation --------------------------------------------------------------------------------------------------- */

typedef struct {
    mjData *plant, *nominal, *contact;
    session_t session;
} bench_t;

/* Holds the arm still until the guard permits its first move. Returns the first cycle of the motion; 0 if the guard
 * never permits. */
static uint32_t stand(bench_t *bench, plant_t *plant) {
    const kernel_setup_t *const setup = plant->setup;
    const bool obeys = (plant->run->obeys != 0u);
    const uint32_t limit = (uint32_t)((obeys ? PERMIT_LIMIT_S : SETTLE_S) * 1e6 / setup->period_us);
    const double none[3] = {0.0, 0.0, 0.0};
    for (uint32_t cycle = 1; cycle < limit; ++cycle) {
        reading_t reading;
        plant_read(plant, cycle, &reading);
        kernel_result_t unused = {0};
        if (!session_cycle(&bench->session, cycle, plant->run->task, none, &reading)) {
            return 0;
        }
        tracks_detect(&bench->session.tracks, setup, false, 0.0, -1.0, &unused);
        if (obeys && permitted(&bench->session)) {
            return cycle;
        }
    }
    return obeys ? 0u : limit - 1u;
}

/* One cycle of physics from `time_s` on, with everything that acts on the arm. False if MuJoCo reset the state. */
static bool live(plant_t *plant, push_t *push, double time_s, kernel_result_t *result) {
    double torque[KERNEL_JOINTS];
    const double step_s = plant->setup->period_us * 1e-6 / plant->setup->substeps;
    plant_control(plant, time_s, torque);
    plant_begin_cycle(plant);
    for (uint32_t step = 0; step < plant->setup->substeps; ++step) {
        const double at_s = time_s + step * step_s;
        push_before_step(push, plant, at_s);
        if (!plant_step(plant, at_s, torque)) {
            return false;
        }
        push_after_step(push, plant, at_s);
        if (push->force_n > 0.0) {
            if (isnan(result->onset_s)) {
                result->onset_s = (plant->run->push == KERNEL_PULSE) ? plant->run->onset_s : at_s;
                result->link = push->link;
                result->tip_speed_m_s = mju_norm3(plant->tip_velocity);
            }
            result->release_s = at_s + step_s;
            result->peak_force_n = fmax(result->peak_force_n, push->force_n);
            if (!isnan(result->stop_s)) {
                result->peak_force_after_stop_n = fmax(result->peak_force_after_stop_n, push->force_n);
            }
        }
    }
    return true;
}

static kernel_status_t collide(bench_t *bench, plant_t *plant, kernel_result_t *result) {
    const kernel_run_t *const run = plant->run;
    const uint32_t first = stand(bench, plant);
    if (first == 0u) {
        return KERNEL_NOT_PERMITTED;
    }
    const double period_s = plant->setup->period_us * 1e-6;
    const uint32_t cycles = (uint32_t)(run->duration_s / period_s);
    push_t push;
    push_init(&push, plant);
    for (uint32_t k = 0; k < cycles; ++k) {
        const double time_s = k * period_s;
        if (!live(plant, &push, time_s, result)) {
            return KERNEL_DIVERGED;
        }
        if (push.obstructed) {
            return KERNEL_OBSTRUCTED;
        }
        reading_t reading;
        const double now_s = (k + 1u) * period_s;
        plant_read(plant, first + 1u + k, &reading);
        if (!session_cycle(&bench->session, first + 1u + k, run->task, plant->tip_acceleration, &reading)) {
            note_stop(&bench->session, now_s, push.force_n, result);
            return KERNEL_OFF_WIRE;
        }
        const bool struck = !isnan(result->onset_s);
        const double since_s = struck ? now_s - result->onset_s : -1.0;
        result->simulated_s = now_s;
        tracks_detect(&bench->session.tracks, plant->setup, true, now_s, since_s, result);
        if (!struck) {
            result->free_s = now_s;
        }
        if ((run->obeys != 0u) && !permitted(&bench->session) && isnan(result->stop_s)) {
            note_stop(&bench->session, now_s, push.force_n, result);
            plant_stop(plant, now_s);
            if (!struck) {
                count_stop(&bench->session, result);
                return KERNEL_FALSE_STOP;
            }
        }
        if (struck && (since_s > run->push_s + WATCHED_S)) {
            return KERNEL_DONE;
        }
    }
    return ((run->push != KERNEL_NO_PUSH) && isnan(result->onset_s)) ? KERNEL_NOT_TOUCHED : KERNEL_DONE;
}

static bool bench_start(bench_t *self, const kernel_setup_t *setup) {
    self->plant = mj_makeData((const mjModel *)setup->plant);
    self->nominal = mj_makeData((const mjModel *)setup->nominal);
    self->contact = (setup->contact != NULL) ? mj_makeData((const mjModel *)setup->contact) : NULL;
    return (self->plant != NULL) && (self->nominal != NULL) && ((setup->contact == NULL) || (self->contact != NULL));
}

static void bench_end(bench_t *self) {
    mj_deleteData(self->plant);
    mj_deleteData(self->nominal);
    mj_deleteData(self->contact);
    free(self);
}

uint32_t kernel_simulate(const kernel_setup_t *setup, const kernel_run_t *runs, uint32_t count,
                         kernel_result_t *results, const volatile uint32_t *stop) {
    bench_t *const bench = calloc(1, sizeof *bench);
    uint32_t done = 0;
    if ((bench == NULL) || !bench_start(bench, setup)) {
        if (bench != NULL) {
            bench_end(bench);
        }
        return 0;
    }
    for (; (done < count) && (*stop == 0u); ++done) {
        const kernel_run_t *const run = &runs[done];
        kernel_result_t *const result = &results[done];
        const bool contact = (run->push == KERNEL_CONTACT);
        plant_t plant;
        result_init(result, run->number);
        if (!session_init(&bench->session, setup)) {
            break;
        }
        plant_start(&plant, setup, run, (mjModel *)(contact ? setup->contact : setup->plant),
                    contact ? bench->contact : bench->plant, bench->nominal);
        result->status = (uint32_t)collide(bench, &plant, result);
    }
    bench_end(bench);
    return done;
}

/* --- recordings --------------------------------------------------------------------------------------------------- */

static void row_reading(const kernel_setup_t *setup, const kernel_recording_t *recording, uint32_t row,
                        reading_t *reading) {
    const size_t at = (size_t)row * setup->joints;
    memcpy(reading->position, recording->position + at, setup->joints * sizeof(double));
    memcpy(reading->velocity, recording->velocity + at, setup->joints * sizeof(double));
    memcpy(reading->torque, recording->torque + at, setup->joints * sizeof(double));
}

uint32_t kernel_listen(const kernel_setup_t *setup, const kernel_recording_t *recording, double *residual,
                       double *index, double *explained, uint8_t *verdict, const volatile uint32_t *stop) {
    session_t *const session = calloc(1, sizeof *session);
    const double none[3] = {0.0, 0.0, 0.0};
    uint32_t row = 0;
    if ((session == NULL) || !session_init(session, setup)) {
        free(session);
        return 0;
    }
    for (; (row < recording->rows) && (*stop == 0u); ++row) {
        reading_t reading;
        row_reading(setup, recording, row, &reading);
        if (!session_cycle(session, recording->cycle[row], recording->task, none, &reading)) {
            break;
        }
        const guard_output_t *const out = &session->tracks.out[0];
        const bank_t *const bank = &session->tracks.guard[0].bank;
        for (uint32_t joint = 0; joint < setup->joints; ++joint) {
            residual[(size_t)row * setup->joints + joint] = value_of(out->residual[joint]);
            for (uint32_t c = 0; c < setup->channels; ++c) {
                const size_t at = ((size_t)row * setup->channels + c) * setup->joints + joint;
                index[at] = value_of(bank->channel[c].output[joint]);
            }
        }
        for (uint32_t c = 0; c < KERNEL_COLUMNS; ++c) {
            explained[(size_t)row * KERNEL_COLUMNS + c] = value_of(session->tracks.guard[0].explained.coefficient[c]);
        }
        verdict[row] = (uint8_t)((out->permitted ? 1u : 0u) | (out->fresh ? 2u : 0u));
    }
    free(session);
    return row;
}

/* Torque that the sensors measure for a force on the arm: tau_ext = -J^T F, where F is the force on the robot. */
static void add_push(const kernel_setup_t *setup, mjData *data, const kernel_injection_t *push, double force_n,
                     reading_t *reading) {
    const mjModel *const model = (const mjModel *)setup->nominal;
    const int body = setup->body[push->link];
    double point[3], jacobian[3 * KERNEL_JOINTS];
    memcpy(data->qpos, reading->position, setup->joints * sizeof(double));
    mj_kinematics(model, data);
    mj_comPos(model, data);
    mju_mulMatVec3(point, data->xmat + 9 * body, push->point);
    mju_addTo3(point, data->xpos + 3 * body);
    mj_jac(model, data, jacobian, NULL, point, body);
    for (uint32_t i = 0; i < setup->joints; ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            reading->torque[i] -= force_n * push->direction[axis] * jacobian[axis * model->nv + (int)i];
        }
    }
}

/* Sends the pushed rows to a copy of the guards, in their state before the first of these rows. */
static kernel_status_t injected(session_t *session, mjData *data, const kernel_recording_t *recording,
                                const kernel_injection_t *push, double window_s, kernel_result_t *result) {
    const kernel_setup_t *const setup = session->setup;
    const double none[3] = {0.0, 0.0, 0.0};
    const double period_s = setup->period_us * 1e-6;
    result->onset_s = recording->cycle[push->row] * period_s;
    result->release_s = result->onset_s + push->push_s;
    result->link = push->link + 1u;
    for (uint32_t row = push->row; row < recording->rows; ++row) {
        const double since_s = recording->cycle[row] * period_s - result->onset_s;
        if (since_s > window_s) {
            break;
        }
        reading_t reading;
        row_reading(setup, recording, row, &reading);
        const double force_n = push_half_sine(push->force_n, push->push_s, since_s);
        if (force_n > 0.0) {
            add_push(setup, data, push, force_n, &reading);
        }
        result->peak_force_n = fmax(result->peak_force_n, force_n);
        if (!session_cycle(session, recording->cycle[row], recording->task, none, &reading)) {
            return KERNEL_OFF_WIRE;
        }
        tracks_detect(&session->tracks, setup, true, result->onset_s + since_s, since_s, result);
        if (!permitted(session) && isnan(result->stop_s)) {
            note_stop(session, result->onset_s + since_s, force_n, result);
        }
    }
    return KERNEL_DONE;
}

uint32_t kernel_inject(const kernel_setup_t *setup, const kernel_recording_t *recording,
                       const kernel_injection_t *injections, uint32_t count, double window_s, kernel_result_t *results,
                       const volatile uint32_t *stop) {
    session_t *const sessions = calloc(2, sizeof *sessions);
    mjData *const data = mj_makeData((const mjModel *)setup->nominal);
    const double none[3] = {0.0, 0.0, 0.0};
    const double period_s = setup->period_us * 1e-6;
    kernel_result_t base;
    result_init(&base, 0);
    uint32_t done = 0;
    bool ready = (sessions != NULL) && (data != NULL) && session_init(&sessions[0], setup);
    bool was_permitted = false;
    for (uint32_t row = 0; ready && (row < recording->rows) && (done < count); ++row) {
        for (; (done < count) && (injections[done].row == row) && (*stop == 0u); ++done) {
            kernel_result_t *const result = &results[done];
            *result = base;
            result->number = injections[done].number;
            if (!was_permitted) {
                result->status = KERNEL_NOT_PERMITTED;
                continue;
            }
            sessions[1] = sessions[0];
            result->status = (uint32_t)injected(&sessions[1], data, recording, &injections[done], window_s, result);
        }
        if (*stop != 0u) {
            break;
        }
        reading_t reading;
        row_reading(setup, recording, row, &reading);
        if (!session_cycle(&sessions[0], recording->cycle[row], recording->task, none, &reading)) {
            break;
        }
        const double now_s = recording->cycle[row] * period_s;
        tracks_detect(&sessions[0].tracks, setup, now_s > WARM_UP_S, now_s, -1.0, &base);
        if (was_permitted && !permitted(&sessions[0])) {
            count_stop(&sessions[0], &base);
        }
        was_permitted = permitted(&sessions[0]);
        base.free_s += was_permitted ? period_s : 0.0;
        base.simulated_s = now_s;
    }
    free(sessions);
    mj_deleteData(data);
    return done;
}
