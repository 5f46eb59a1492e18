/* index_fixture: an index over an observer whose residual the test sets, on the ku_dex arm at rest. */
#ifndef INDEX_FIXTURE_H
#define INDEX_FIXTURE_H

#include "core_fixture.h"
#include "index.h"
#include "robots.h"
#include "vec3.h"

#define N 7u

static const robot_t *robot;
static subspace_config_t config;
static index_t index_state;
static motion_t motion;
static observer_t observer;
static regressor_t regressor;
static vec3_t acceleration;
static num_t pose[ROBOT_MAX_JOINTS];

static inline void move_to(double turn) {
    const double q[N] = {0.3, 0.8, -0.4, -1.3, 0.6, 0.9, 0.2};
    const num_t still[ROBOT_MAX_JOINTS] = {0};
    for (uint32_t i = 0; i < N; ++i) {
        pose[i] = num_of(q[i] + turn);
    }
    motion_step(&motion, robot, pose, still);
}

static inline void start(void) {
    robot = &robot_ku_dex;
    config = (subspace_config_t){.order = (uint32_t)ORDER_FILTER_FIRST,
                                 .projector = (uint32_t)PROJECTOR_HARD,
                                 .tolerance = NUM(0.005),
                                 .lever_m = NUM(0.1)};
    index_init(&index_state);
    motion_init(&motion);
    observer_init(&observer);
    acceleration = (vec3_t){NUM(0), NUM(0), NUM(0)};
    move_to(0.0);
}

static inline void assert_no_saturation(void) {
    TEST_ASSERT_EQUAL(0, index_state.saturations);
    TEST_ASSERT_EQUAL(0, (index_state.projection.subspace.saturations + index_state.projection.soft.saturations));
}

static inline void step(index_kind_t kind) {
    uint32_t saturations = 0;
    const vec3_t across = vec3_across(acceleration, vec3_unit(robot->gravity, &saturations), &saturations);
    const bool matters = num_wide(NUM(5), vec3_length(across)) >= num_widen(NUM(1)); /* 5 kg against 1 N */
    const acceleration_t measured = {.sideways =
                                         matters ? vec3_unit(across, &saturations) : (vec3_t){NUM(0), NUM(0), NUM(0)}};
    const index_config_t task = {.kind = (uint32_t)kind,
                                 .components = (kind == INDEX_CONTACT) ? INDEX_ALL_COMPONENTS : 0u};
    index_step(&index_state, &config, &task, robot, &motion, &observer, &measured, &regressor);
}

static inline void set_residual(const double r[]) {
    for (uint32_t i = 0; i < N; ++i) {
        observer.residual[i] = num_of(r[i]);
    }
}

/* J^T times force (N) and moment (Nm) at the end-effector. */
static inline void wrench(const double w[6], double tau[N]) {
    for (uint32_t i = 0; i < N; ++i) {
        tau[i] = 0.0;
        for (uint32_t row = 0; row < 6u; ++row) {
            tau[i] += value_of(motion.jacobian[row][i]) * w[row];
        }
    }
}

static inline double size_of(const num_t v[]) {
    double square = 0.0;
    for (uint32_t i = 0; i < N; ++i) {
        square += value_of(v[i]) * value_of(v[i]);
    }
    return sqrt(square);
}

/* The part that no wrench at the end-effector explains, and so no payload: the arm's own motion with a resting hand. */
static inline void unexplained_by_all(double size, double tau[N]) {
    index_t scratch;
    index_init(&scratch);
    for (uint32_t i = 0; i < N; ++i) {
        observer.residual[i] = num_of((i == 3u) ? 10.0 : 1.0);
    }
    const index_config_t task = {.kind = INDEX_CONTACT, .components = INDEX_ALL_COMPONENTS};
    const acceleration_t none = {0};
    index_step(&scratch, &config, &task, robot, &motion, &observer, &none, &regressor);
    const double length = size_of(scratch.unexplained);
    TEST_ASSERT_TRUE(length > 0.1);
    for (uint32_t i = 0; i < N; ++i) {
        tau[i] = value_of(scratch.unexplained[i]) * size / length;
        observer.residual[i] = NUM(0);
    }
}

#endif
