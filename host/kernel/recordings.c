/* Recorded motion on the bus: as it is, and with pushes added. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "push.h"
#include "session.h"

#define WARM_UP_S 1.0 /* start of a recording that is ignored */

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
        if (!session_permitted(session) && isnan(result->stop_s)) {
            session_note_stop(session, result->onset_s + since_s, force_n, result);
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
        if (was_permitted && !session_permitted(&sessions[0])) {
            session_count_stop(&sessions[0], &base);
        }
        was_permitted = session_permitted(&sessions[0]);
        base.free_s += was_permitted ? period_s : 0.0;
        base.simulated_s = now_s;
    }
    free(sessions);
    mj_deleteData(data);
    return done;
}
