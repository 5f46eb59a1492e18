#include "crc32.h"
#include "guard_parts.h"

/* --- parts -------------------------------------------------------------------------------------------------------- */

/* Check value of CRC-32/ISO-HDLC from the CRC catalogue. */
static bool crc32_answers(void) {
    static const uint8_t digits[9] = {'1', '2', '3', '4', '5', '6', '7', '8', '9'};
    return crc32_finish(crc32_fold(CRC32_START, digits, sizeof(digits))) == 0xCBF43926u;
}

/* A protected frame passes. The same frame with one flipped bit does not. */
static bool e2e_answers(void) {
    const uint8_t *const ids = protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND].data_ids;
    const uint8_t max_delta = 1;
    uint8_t frame[8] = {0, 0, 1, 2, 3, 4, 5, 6};
    e2e_transmitter_t transmitter = {0};
    e2e_receiver_t receiver = {0};
    e2e_protect(&transmitter, frame, sizeof(frame), ids);
    const bool first = e2e_check(&receiver, frame, sizeof(frame), ids, max_delta) == E2E_INITIAL;
    e2e_protect(&transmitter, frame, sizeof(frame), ids);
    frame[5] ^= 0x10u;
    const bool refused = e2e_check(&receiver, frame, sizeof(frame), ids, max_delta) == E2E_WRONG_CRC;
    frame[5] ^= 0x10u;
    return first && refused && (e2e_check(&receiver, frame, sizeof(frame), ids, max_delta) == E2E_OK);
}

static bool is_near(num_t a, num_t b, num_t tolerance) {
    uint32_t held = 0; /* a difference at the end of the range is not near */
    return num_abs(num_subtract(a, b, &held)) < tolerance;
}

/* A = [e1 + e2, e2 - e1] / 4 and tau = (1, 2, 3). Both directions are explained and only e3 remains. With a tolerance
 * above both singular values (0.3536) nothing is explained. */
static bool projection_answers(projection_t *projection) {
    static const num_t column[2][ROBOT_MAX_JOINTS] = {{NUM(0.25), NUM(0.25)}, {NUM(-0.25), NUM(0.25)}};
    const num_t near = NUM(1e-4);
    const num_t tau[ROBOT_MAX_JOINTS] = {NUM(1), NUM(2), NUM(3)};
    num_t rest[ROBOT_MAX_JOINTS] = {NUM(0)};
    projection_init(projection);
    projection_hard(projection, 3u, 2u, column, NUM(0.01), tau, rest);
    const bool explained = (projection->rank == 2u) && is_near(rest[0], NUM(0), near) &&
                           is_near(rest[1], NUM(0), near) && is_near(rest[2], NUM(3), near);
    projection_hard(projection, 3u, 2u, column, NUM(0.5), tau, rest);
    const bool kept = (projection->rank == 0u) && is_near(rest[0], NUM(1), near) && is_near(rest[1], NUM(2), near) &&
                      is_near(rest[2], NUM(3), near) && is_near(projection->smallest, NUM(0.353553), near);
    projection_init(projection);
    return explained && kept;
}

/* One column of 0.3, s = 0.1. Of a torque of 10 along it 0.1^2 / (0.1^2 + 0.3^2) remains; across it, all. */
static bool soft_projection_answers(projection_t *projection) {
    static const num_t column[1][ROBOT_MAX_JOINTS] = {{NUM(0), NUM(0.3)}};
    const num_t near = NUM(1e-4);
    const num_t tau[ROBOT_MAX_JOINTS] = {NUM(5), NUM(10)};
    num_t rest[ROBOT_MAX_JOINTS] = {NUM(0)};
    projection_init(projection);
    projection_soft(projection, 2u, 1u, column, NUM(0.1), tau, rest, 0u, rest);
    const bool right = is_near(rest[0], NUM(5), near) && is_near(rest[1], NUM(1), near) &&
                       is_near(projection->smallest, NUM(0.3), near);
    projection_init(projection);
    return right;
}

/* A pendulum about a horizontal axis: first moment 1 kg m along x, inertia 0.5 kg m^2, gravity 8 m/s^2, tip at 1 m. At
 * 0.5 rad and 2 rad/s: g = 8 cos 0.5, p = 1 Nm s, and the tip's Jacobian is (-sin, 0, cos). */
static bool motion_answers(motion_t *motion) {
    static const robot_t pendulum = {
        .joint_count = 1u,
        .base = {{NUM(1), NUM(0), NUM(0)}, {NUM(0), NUM(0), NUM(-1)}, {NUM(0), NUM(1), NUM(0)}},
        .gravity = {NUM(0), NUM(0), NUM(-8)},
        .tip = {NUM(1), NUM(0), NUM(0)},
        .joint = {{.cos_twist = NUM(1), .moment_x = NUM(1), .inertia_zz = NUM(0.5)}}};
    const num_t near = NUM(1e-4);
    const num_t q[ROBOT_MAX_JOINTS] = {NUM(0.5)};
    const num_t qd[ROBOT_MAX_JOINTS] = {NUM(2)};
    motion_init(motion);
    motion_step(motion, &pendulum, q, qd);
    const bool right = is_near(motion->gravity[0], NUM(7.0206605), near) &&
                       is_near(motion->momentum[0], NUM(1), near) && is_near(motion->coriolis[0], NUM(0), near) &&
                       is_near(motion->jacobian[0][0], NUM(-0.4794255), near) &&
                       is_near(motion->jacobian[2][0], NUM(0.8775826), near);
    motion_init(motion);
    return right;
}

/* --- the chain ---------------------------------------------------------------------------------------------------- */

/* Steps until every push has risen, without the debounce. A step bridges CONFIG_MAX_GAP cycles. */
#define RISE_STEPS 64u

/* The arm at rest in the middle of its ranges. */
static void rest(const robot_t *robot, snapshot_t *snapshot) {
    for (uint32_t i = 0; i < robot->joint_count; ++i) {
        const robot_joint_t *const joint = &robot->joint[i];
        snapshot->position[i] = (joint->position_min_rad / 2) + (joint->position_max_rad / 2);
    }
}

/* A row that explains nothing, with the thresholds of the first configured task. */
static task_config_t chain_task(const guard_config_t *config) {
    uint32_t chosen = TASK_NONE;
    while ((chosen < (uint32_t)TASK_COUNT - 1u) && (config->task[chosen].index.kind == (uint32_t)INDEX_OFF)) {
        ++chosen;
    }
    task_config_t task = config->task[chosen];
    task.index = (index_config_t){.kind = (uint32_t)INDEX_RESIDUAL};
    return task;
}

static num_t push_on(const robot_t *robot, uint32_t joint) {
    return robot->joint[joint].torque_max_nm;
}

/* r of a constant push after `step` steps is push (1 - decay^step), on the pushed joint only. */
static bool residual_is_right(const guard_t *self, num_t remaining) {
    bool right = true;
    for (uint32_t i = 0; i < self->joints; ++i) {
        uint32_t held = 0;
        const num_t push = push_on(&self->config->robot, i);
        const num_t expected = num_mul(push, NUM(1) - remaining, &held);
        right = right && is_near(self->observer.residual[i], expected, (push / 128) + NUM(0.01));
    }
    return right;
}

/* 1: not yet, 2: every joint's push has reached the detector, 0: an error. */
static self_test_t chain_step(guard_t *self, uint32_t step) {
    const guard_config_t *const config = self->config;
    const task_config_t task = chain_task(config);
    snapshot_t snapshot = {0};
    rest(&config->robot, &snapshot);
    if (step == 0u) {
        stages_init(self);
        self->self_test_remaining = NUM(1);
        motion_step(&self->motion, &config->robot, snapshot.position, snapshot.velocity);
    }
    for (uint32_t i = 0; i < self->joints; ++i) { /* gravity of the last step: the pose is the same */
        uint32_t held = 0;                        /* of an arm that weighs more than the numbers hold */
        const num_t push = (step == 0u) ? NUM(0) : push_on(&config->robot, i);
        snapshot.torque[i] = num_add(self->motion.gravity[i], push, &held);
    }
    stages_step(self, &task, &snapshot, (step == 0u) ? 0u : CONFIG_MAX_GAP, (vec3_t){NUM(0), NUM(0), NUM(0)});
    if (step == 0u) {
        return SELF_TEST_RUNNING;
    }
    uint32_t held = 0;
    const observer_config_t *const gains = &config->observer;
    const num_t decay = gains->decay[CONFIG_MAX_GAP - 1u];
    self->self_test_remaining = num_mul(decay, self->self_test_remaining, &held);
    if (step == 1u) { /* the first sample of the first interval was at rest, and counts in the mean */
        const num_t share = (gains->torque_sample == (uint32_t)TORQUE_INTERVAL) ? NUM(0.375) : NUM(0.5);
        self->self_test_remaining =
            num_add(self->self_test_remaining, num_mul(gains->gain[CONFIG_MAX_GAP - 1u], share, &held), &held);
    }
    if (!residual_is_right(self, self->self_test_remaining)) {
        return SELF_TEST_FAILED;
    }
    bool all = self->detector.tripped;
    for (uint32_t i = 0; i < self->joints; ++i) {
        all = all && (self->detector.above[i] >= task.detector.debounce_ticks) && (self->detector.value_nm[i] > NUM(0));
    }
    if (all) {
        return SELF_TEST_PASSED;
    }
    return (step < (RISE_STEPS + task.detector.debounce_ticks)) ? SELF_TEST_RUNNING : SELF_TEST_FAILED;
}

/* One column of 0.5 m and a torque of 1 Nm along it: a force just below 2 N. A limit of 1 N does not permit it. */
static bool limits_answer(guard_t *self) {
    const index_config_t task = {.kind = (uint32_t)INDEX_CONTACT, .components = 1u};
    subspace_config_t config = self->config->subspace;
    explained_config_t limits = {.force_max_n = NUM(1), .moment_max_nm = NUM(1)};
    for (uint32_t i = 0; i < self->joints; ++i) {
        limits.residual_max_nm[i] = NUM(500);
    }
    config.order = (uint32_t)ORDER_FILTER_FIRST;
    stages_init(self);
    self->index.columns = 1u;
    self->index.column[0][0] = NUM(0.5);
    self->index.explained[0] = NUM(1);
    explained_step(&self->explained, &limits, &config, 1u, &self->config->robot, &self->observer, &self->acceleration,
                   &task, &self->index);
    const bool excess = self->explained.tripped && (self->explained.excess == EXPLAINED_FORCE) &&
                        is_near(self->explained.coefficient[0], NUM(1.85), NUM(0.2));
    limits.force_max_n = NUM(3);
    explained_step(&self->explained, &limits, &config, 1u, &self->config->robot, &self->observer, &self->acceleration,
                   &task, &self->index);
    return excess && !self->explained.tripped;
}

self_test_t self_test_step(guard_t *self) {
    const uint32_t step = self->self_test_step;
    ++self->self_test_step;
    if (step == 0u) {
        const bool answers = crc32_answers() && e2e_answers() && projection_answers(&self->index.projection) &&
                             soft_projection_answers(&self->index.projection) && motion_answers(&self->motion) &&
                             limits_answer(self);
        return answers ? SELF_TEST_RUNNING : SELF_TEST_FAILED;
    }
    return chain_step(self, step - 1u);
}
