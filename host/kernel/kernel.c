#include "kernel.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "plant.h"
#include "push.h"
#include "session.h"

#define PERMIT_LIMIT_S 3.0   /* a guard that has not permitted an arm at rest by then never will */
#define SETTLE_S       0.5   /* time at rest before a motion that does not wait for permission */
#define WATCHED_S      0.3   /* observed time after the end of a push */
#define CLAMPED_S      0.9   /* after the stop, of a push that stays */
#define LOCATED_S      0.064 /* after the stop: LOCATE_US of guard_contact.c */

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
        if (obeys && session_permitted(&bench->session)) {
            return cycle;
        }
    }
    return obeys ? 0u : limit - 1u;
}

/* Where the last collision was, as the guard knows it in the end. */
static void note_contact(const session_t *session, const push_t *push, kernel_result_t *result) {
    const guard_output_t *const out = &session->tracks.out[0];
    result->contact_link = out->contact_link;
    result->contact_class = out->contact_class;
    result->contact_force[0] = value_of(out->contact_force.x);
    result->contact_force[1] = value_of(out->contact_force.y);
    result->contact_force[2] = value_of(out->contact_force.z);
    memcpy(result->true_force, push->towards, sizeof result->true_force);
}

/* A run ends some time after its push, or after the stop if the push stays. */
static bool is_over(const kernel_run_t *run, double since_onset_s, double since_stop_s) {
    const bool stays = (run->push == KERNEL_TOUCH) || (run->push == KERNEL_CLAMP);
    return (since_onset_s > run->push_s + WATCHED_S) && (!stays || (since_stop_s > CLAMPED_S));
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
                result->onset_s = (plant->run->push != KERNEL_CONTACT) ? plant->run->onset_s : at_s;
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

/* The guard's estimate of the force is a mean over the same time. */
static void note_force(const push_t *push, double now_s, double period_s, kernel_result_t *result) {
    const double since_s = now_s - result->stop_s; /* NaN before a stop */
    if ((since_s > 0.0) && (since_s <= LOCATED_S)) {
        result->mean_force_after_stop_n += push->force_n * period_s / LOCATED_S;
    }
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
            session_note_stop(&bench->session, now_s, push.force_n, result);
            return KERNEL_OFF_WIRE;
        }
        note_force(&push, now_s, period_s, result);
        const bool struck = !isnan(result->onset_s);
        const double since_s = struck ? now_s - result->onset_s : -1.0;
        result->simulated_s = now_s;
        tracks_detect(&bench->session.tracks, plant->setup, true, now_s, since_s, result);
        if (!struck) {
            result->free_s = now_s;
        }
        if ((run->obeys != 0u) && !session_permitted(&bench->session) && isnan(result->stop_s)) {
            session_note_stop(&bench->session, now_s, push.force_n, result);
            plant_stop(plant, now_s);
            if (!struck) {
                session_count_stop(&bench->session, result);
                return KERNEL_FALSE_STOP;
            }
        }
        if (struck && is_over(run, since_s, isnan(result->stop_s) ? since_s : (now_s - result->stop_s))) {
            break;
        }
    }
    note_contact(&bench->session, &push, result);
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
