/* worst: the most instructions of a tick's stages with arbitrary bits, which no frame can carry: motion, observer,
 * index, limits, bank, detector. Prints
 *     worst STAGES PROJECTION       PROJECTION: subspace_step and subspace_reject alone
 */
#define UNITY_H                 /* the fixtures' assertions are not used here */
#define TEST_FAIL_MESSAGE(text) printf("%s\n", (text))
#include "any_bits.h"

#include "bank.h"
#include "config.h"
#include "counter.h"
#include "detector.h"
#include "explained.h"
#include "index.h"
#include "locate.h"
#include "robots.h"
#include "sight.h"

#define TICKS 20000

int main(void);

static motion_t motion;
static observer_t observer;
static acceleration_t measured;
static regressor_t regressor;
static index_t index_state;
static explained_t explained;
static bank_t bank;
static sight_t sight;
static locate_t locate;
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

/* One number in this many is arbitrary; the others are those of the arm. */
static num_t mostly(double limit, uint32_t share) {
    return ((random_bits() % share) == 0u) ? any() : num_of(limit * random_one());
}

static uint32_t stages(uint32_t worst, const observer_config_t *gains, const bank_config_t *channels,
                       const regressor_config_t *rows, const acceleration_config_t *limits, task_config_t *task) {
    const robot_t *const robot = &robot_ku_dex;
    subspace_config_t config = {.order = ORDER_PROJECT_FIRST,
                                .projector = PROJECTOR_HARD,
                                .tolerance = NUM(0.005),
                                .lever_m = NUM(0.1),
                                .softness = NUM(0.05)};
    const uint32_t share = 1u << (random_bits() % 8u);
    num_t q[ROBOT_MAX_JOINTS] = {NUM(0)}, qd[ROBOT_MAX_JOINTS] = {NUM(0)}, tau[ROBOT_MAX_JOINTS] = {NUM(0)};
    const bool special = (random_bits() % 2u) == 0u;
    for (uint32_t i = 0; i < robot->joint_count; ++i) {
        q[i] = (special && ((random_bits() % 2u) == 0u)) ? -robot->joint[i].zero_rad : mostly(3.0, share);
        qd[i] = mostly(2.0, share);
        tau[i] = mostly(100.0, share);
    }
    const vec3_t acceleration = {mostly(8.0, share), mostly(8.0, share), mostly(8.0, share)};
    const index_kind_t kind = (index_kind_t)(INDEX_RESIDUAL + random_bits() % 4u);
    config.projector = (kind == INDEX_REGRESSOR) ? PROJECTOR_SOFT : (PROJECTOR_HARD + random_bits() % 2u);
    const uint32_t gap = random_bits() % (OBSERVER_MAX_GAP + 2u);
    task->index =
        (index_config_t){.kind = (uint32_t)kind, .components = (kind == INDEX_CONTACT) ? INDEX_ALL_COMPONENTS : 0u};
    const bool searches = (random_bits() % 2u) == 0u; /* which replaces the evaluation of the links */
    const sight_config_t look = {.force_n = NUM(500)};
    const lever_config_t shape = {.middle = {{NUM(0.1), NUM(0.1), NUM(0.1)}}, .half_m = {NUM(0.1)}};
    locate_begin(&locate, robot->joint_count, 1u, task->detector.threshold_nm[0]);
    (void)locate_step(&locate, &shape, robot->joint_count, &motion, &observer, &index_state, &explained, false);
    const uint32_t begin = counter_read();
    motion_step(&motion, robot, q, qd);
    observer_step(&observer, gains, robot->joint_count, &motion, tau, gap);
    acceleration_step(&measured, limits, gains, &observer, robot, &motion, qd, acceleration, NUM(5));
    regressor_step(&regressor, rows, gains, robot, &motion, &observer, &measured, qd);
    index_step(&index_state, &config, &task->index, robot, &motion, &observer, &measured, &regressor);
    explained_step(&explained, &task->limits, &config, 1u, robot, &observer, &measured, &task->index, &index_state);
    bank_step(&bank, channels, robot->joint_count, observer.gap, index_state.unexplained, index_state.sudden, 0u);
    detector_step(&detector, &task->detector, robot->joint_count, &bank);
    if (searches) {
        (void)locate_step(&locate, &shape, robot->joint_count, &motion, &observer, &index_state, &explained, false);
    } else {
        sight_step(&sight, &look, &shape, robot->joint_count, &motion, &index_state, channels, &task->detector, 0u);
    }
    return larger(worst, begin);
}

int main(void) {
    observer_config_t gains = {.torque_sample = TORQUE_INTERVAL};
    bank_config_t channels = {.channels = 1u};
    regressor_config_t rows = {.used = 1u};
    for (uint32_t g = 0; g < OBSERVER_MAX_GAP; ++g) {
        gains.decay[g] = NUM(0.95);
        gains.gain[g] = NUM(0.05);
        gains.momentum_gain[g] = NUM(50);
        channels.channel[0].own[g] = NUM(0.95);
        channels.channel[0].in[g] = NUM(1);
        rows.low_pass.own[g] = NUM(0.9);
        rows.low_pass.in[g] = NUM(2);
    }
    task_config_t task = {.detector = {.debounce_ticks = 1u, .channels = 1u},
                          .limits = {.mass_max_kg = NUM(5), .force_max_n = NUM(140), .moment_max_nm = NUM(40)}};
    const acceleration_config_t limits = {.force_floor_n = NUM(1), .error_max = NUM(2)};
    for (uint32_t j = 0; j < ROBOT_MAX_JOINTS; ++j) {
        task.detector.threshold_nm[0][j] = NUM(2);
        task.limits.residual_max_nm[j] = NUM(100);
    }
    uint32_t worst_stages = 0, worst_projection = 0;
    random_start(4711);
    counter_init();
    for (uint32_t i = 0; i < TICKS; ++i) {
        if ((i % 10u) == 0u) {
            motion_init(&motion);
            observer_init(&observer);
            acceleration_init(&measured);
            regressor_init(&regressor);
            index_init(&index_state);
            explained_init(&explained);
            bank_init(&bank);
            detector_init(&detector);
            sight_init(&sight, robot_ku_dex.joint_count);
            locate_init(&locate);
        }
        worst_stages = stages(worst_stages, &gains, &channels, &rows, &limits, &task);
        worst_projection = projection(worst_projection);
    }
    printf("worst %lu %lu\n", (unsigned long)worst_stages, (unsigned long)worst_projection);
    return 0;
}
