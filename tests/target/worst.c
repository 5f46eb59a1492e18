/* worst: the most instructions that the stages of a tick take on any bits at all, such as no frame can carry: motion,
 * observer, index with a change of task and so two projections' way back, detector. Prints
 *     worst STAGES PROJECTION       PROJECTION: subspace_step and subspace_reject alone */
#define UNITY_H                 /* the fixtures' assertions are not used here */
#define TEST_FAIL_MESSAGE(text) printf("%s\n", (text))
#include "any_bits.h"

#include "counter.h"
#include "detector.h"
#include "index.h"
#include "robots.h"

#define TICKS 20000

int main(void);

static motion_t motion;
static observer_t observer;
static index_t index_state;
static detector_t detector;

static uint32_t larger(uint32_t a, uint32_t begin) {
    const uint32_t b = counter_instructions(begin, counter_read());
    return (b > a) ? b : a;
}

static uint32_t projection(uint32_t worst) {
    static num_t column[SUBSPACE_MAX_COLUMNS][ROBOT_MAX_JOINTS];
    static subspace_t subspace;
    num_t tau[ROBOT_MAX_JOINTS];
    any_columns(column, SUBSPACE_MAX_COLUMNS, ROBOT_MAX_JOINTS, SUBSPACE_MAX_COLUMNS);
    any_of(tau, ROBOT_MAX_JOINTS);
    const num_t tolerance = any();
    const uint32_t begin = counter_read();
    subspace_step(&subspace, ROBOT_MAX_JOINTS, SUBSPACE_MAX_COLUMNS, (const num_t(*)[ROBOT_MAX_JOINTS])column,
                  tolerance);
    subspace_reject(&subspace, tau, tau);
    return larger(worst, begin);
}

/* One number in so many is any bits, the others are of the arm. */
static num_t mostly(double limit, uint32_t share) {
    return ((random_bits() % share) == 0u) ? any() : num_of(limit * random_one());
}

static uint32_t stages(uint32_t worst, const observer_config_t *gains, const task_config_t *task) {
    const robot_t *const robot = &robot_ku_dex;
    const subspace_config_t config = {.basis = BASIS_FILTERED, .tolerance = NUM(0.005), .lever_m = NUM(0.1)};
    const uint32_t share = 1u << (random_bits() % 8u);
    num_t q[ROBOT_MAX_JOINTS] = {NUM(0)}, qd[ROBOT_MAX_JOINTS] = {NUM(0)}, tau[ROBOT_MAX_JOINTS] = {NUM(0)};
    const bool special = (random_bits() % 2u) == 0u;
    for (uint32_t i = 0; i < robot->joint_count; ++i) {
        q[i] = (special && ((random_bits() % 2u) == 0u)) ? -robot->joint[i].zero_rad : mostly(3.0, share);
        qd[i] = mostly(2.0, share);
        tau[i] = mostly(100.0, share);
    }
    const vec3_t acceleration = {mostly(8.0, share), mostly(8.0, share), mostly(8.0, share)};
    const index_kind_t kind = (index_kind_t)(INDEX_RESIDUAL + random_bits() % 3u);
    const uint32_t gap = random_bits() % (CONFIG_MAX_GAP + 2u);
    const uint32_t begin = counter_read();
    motion_step(&motion, robot, q, qd);
    observer_step(&observer, gains, robot->joint_count, &motion, tau, gap);
    index_step(&index_state, &config, kind, robot, &motion, &observer, acceleration);
    detector_step(&detector, task, robot->joint_count, index_state.value);
    return larger(worst, begin);
}

int main(void) {
    observer_config_t gains = {.torque_sample = TORQUE_INTERVAL};
    for (uint32_t g = 0; g < CONFIG_MAX_GAP; ++g) {
        gains.decay[g] = NUM(0.95);
        gains.gain[g] = NUM(0.05);
        gains.momentum_gain[g] = NUM(50);
    }
    task_config_t task = {.index = INDEX_PAYLOAD, .debounce_ticks = 1u};
    for (uint32_t j = 0; j < ROBOT_MAX_JOINTS; ++j) {
        task.threshold_nm[j] = NUM(2);
    }
    uint32_t worst_stages = 0, worst_projection = 0;
    random_start(4711);
    counter_init();
    for (uint32_t i = 0; i < TICKS; ++i) {
        if ((i % 10u) == 0u) {
            motion_init(&motion);
            observer_init(&observer);
            index_init(&index_state);
            detector_init(&detector);
        }
        worst_stages = stages(worst_stages, &gains, &task);
        worst_projection = projection(worst_projection);
    }
    printf("worst %lu %lu\n", (unsigned long)worst_stages, (unsigned long)worst_projection);
    return 0;
}
