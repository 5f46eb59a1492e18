/* The core's functions with arbitrary bits, which no frame can carry. Every function must terminate within its bounds
 * and report if it has no result. Float: all exponents, subnormals, infinities and NaN. Q9.22: every int32_t. */
#include "any_bits.h"
#include "bank.h"
#include "config.h"
#include "detector.h"
#include "explained.h"
#include "index.h"
#include "motion.h"
#include "observer.h"
#include "robots.h"
#include "subspace.h"

static bool all_finite(const num_t x[], uint32_t count) {
    bool finite = true;
    for (uint32_t i = 0; i < count; ++i) {
        finite = finite && num_finite(x[i]);
    }
    return finite;
}

static bool all_below(const num_t x[], uint32_t count, num_t limit) {
    bool below = true;
    for (uint32_t i = 0; i < count; ++i) {
        below = below && (num_abs(x[i]) < limit);
    }
    return below;
}

void setUp(void) {}
void tearDown(void) {}

static void assert_within_bounds(const subspace_t *subspace) {
    TEST_ASSERT_TRUE(subspace->path.sweeps <= BIDIAGONAL_MAX_SWEEPS);
    TEST_ASSERT_TRUE(subspace->path.rotations <= BIDIAGONAL_MAX_ROTATIONS);
    TEST_ASSERT_TRUE(subspace->rank <= subspace->directions);
    TEST_ASSERT_TRUE(subspace->converged || (subspace->rank == 0u));
}

static void test_a_projection_terminates_and_reports_whether_it_is_valid(void) {
    static num_t column[SUBSPACE_MAX_COLUMNS][ROBOT_MAX_JOINTS];
    static subspace_t subspace;
    random_start(91);
    subspace_init(&subspace);
    uint32_t converged = 0, refused = 0, within = 0, sweeps = 0, turns = 0;
    for (int i = 0; i < DRAWS(100000); ++i) {
        const uint32_t n = 1u + (random_bits() % ROBOT_MAX_JOINTS), k = random_bits() % (SUBSPACE_MAX_COLUMNS + 1u);
        any_columns(column, SUBSPACE_MAX_COLUMNS, n, k);
        subspace_step(&subspace, n, k, (const num_t(*)[ROBOT_MAX_JOINTS])column, any());
        assert_within_bounds(&subspace);
        num_t tau[ROBOT_MAX_JOINTS] = {NUM(0)}, rejected[ROBOT_MAX_JOINTS];
        any_of(tau, n);
        subspace_reject(&subspace, tau, rejected);
        bool finite = true, small = true;
        for (uint32_t c = 0; c < k; ++c) {
            finite = finite && all_finite(column[c], n);
            small = small && all_below(column[c], n, NUM(64));
        }
        if (!finite) {
            TEST_ASSERT_FALSE(subspace.converged);
            TEST_ASSERT_EQUAL_MEMORY(tau, rejected, sizeof(tau)); /* nothing is explained */
        }
        if (small) { /* a result exists only under this precondition */
            TEST_ASSERT_TRUE(subspace.converged);
            TEST_ASSERT_TRUE(num_finite(subspace.smallest));
            TEST_ASSERT_TRUE(all_finite(rejected, n) || !all_below(tau, n, NUM(500)));
            ++within;
        }
        sweeps = (subspace.path.sweeps > sweeps) ? subspace.path.sweeps : sweeps;
        turns = (subspace.path.rotations > turns) ? subspace.path.rotations : turns;
        converged += subspace.converged ? 1u : 0u;
        refused += subspace.converged ? 0u : 1u;
    }
    printf("%u projections, %u refused, %u within the precondition; at most %u sweeps, %u turns\n", (unsigned)converged,
           (unsigned)refused, (unsigned)within, (unsigned)sweeps, (unsigned)turns);
    TEST_ASSERT_TRUE(within > 0u);
    TEST_ASSERT_TRUE(IF_FIXED(true, refused > 0u));
}

/* Motion, observer, index and detector with the same arbitrary bits, in consecutive ticks, as the guard runs them. */
static void test_a_tick_on_any_bits_terminates_and_is_reported(void) {
    static motion_t motion;
    static observer_t observer;
    static acceleration_t measured;
    static regressor_t regressor;
    static index_t index;
    static explained_t explained;
    static bank_t bank;
    static detector_t detector;
    const robot_t *const robot = &robot_ku_dex;
    const uint32_t n = robot->joint_count;
    subspace_config_t subspace = {.order = ORDER_PROJECT_FIRST,
                                  .projector = PROJECTOR_HARD,
                                  .tolerance = NUM(0.005),
                                  .lever_m = NUM(0.1),
                                  .softness = NUM(0.05)};
    task_config_t task = {.detector = {.debounce_ticks = 1u, .channels = 1u},
                          .limits = {.mass_max_kg = NUM(5), .force_max_n = NUM(140), .moment_max_nm = NUM(40)}};
    regressor_config_t rows = {.used = 1u};
    bank_config_t channels = {.channels = 1u};
    const acceleration_config_t limits = {.force_floor_n = NUM(1), .error_max = NUM(2)};
    observer_config_t gains = {.torque_sample = TORQUE_INTERVAL};
    for (uint32_t g = 0; g < OBSERVER_MAX_GAP; ++g) {
        gains.decay[g] = NUM(0.95);
        gains.gain[g] = NUM(0.05);
        gains.momentum_gain[g] = NUM(50);
        channels.channel[0].own[g] = NUM(0.95);
        channels.channel[0].in[g] = NUM(1);
        rows.low_pass.own[g] = NUM(0.9);
        rows.low_pass.in[g] = NUM(2);
    }
    for (uint32_t j = 0; j < ROBOT_MAX_JOINTS; ++j) {
        task.detector.threshold_nm[0][j] = NUM(2);
        task.limits.residual_max_nm[j] = NUM(100);
    }
    random_start(92);
    uint32_t marked = 0;
    for (int i = 0; i < DRAWS(30000); ++i) {
        if ((i % 10) == 0) {
            motion_init(&motion);
            observer_init(&observer);
            acceleration_init(&measured);
            regressor_init(&regressor);
            index_init(&index);
            explained_init(&explained);
            bank_init(&bank);
            detector_init(&detector);
        }
        num_t q[ROBOT_MAX_JOINTS] = {NUM(0)}, qd[ROBOT_MAX_JOINTS] = {NUM(0)}, tau[ROBOT_MAX_JOINTS] = {NUM(0)};
        any_of(q, n);
        any_of(qd, n);
        any_of(tau, n);
        const vec3_t acceleration = {any(), any(), any()};
        const index_kind_t kind = (index_kind_t)(INDEX_RESIDUAL + random_bits() % 4u);
        subspace.projector = (kind == INDEX_REGRESSOR) ? PROJECTOR_SOFT : (PROJECTOR_HARD + random_bits() % 2u);
        motion_step(&motion, robot, q, qd);
        observer_step(&observer, &gains, n, &motion, tau, random_bits() % (OBSERVER_MAX_GAP + 2u));
        task.index =
            (index_config_t){.kind = (uint32_t)kind, .components = (kind == INDEX_CONTACT) ? INDEX_ALL_COMPONENTS : 0u};
        acceleration_step(&measured, &limits, &gains, &observer, robot, &motion, qd, acceleration, NUM(5));
        regressor_step(&regressor, &rows, &gains, robot, &motion, &observer, &measured, qd);
        index_step(&index, &subspace, &task.index, robot, &motion, &observer, &measured, &regressor);
        explained_step(&explained, &task.limits, &subspace, 1u, robot, &observer, &measured, &task.index, &index);
        bank_step(&bank, &channels, n, observer.gap, index.unexplained, index.sudden, 0u);
        assert_within_bounds(&index.projection.subspace);
        detector_step(&detector, &task.detector, n, &bank);
        TEST_ASSERT_TRUE(detector.joint < n);
        for (uint32_t j = 0; j < n; ++j) { /* a value that is not a number is above every threshold */
            TEST_ASSERT_TRUE(num_finite(bank.channel[0].output[j]) || ((detector.above[j] > 0u) && detector.tripped));
        }
        const bool lost =
            !all_finite(observer.residual, n) || !all_finite(bank.channel[0].output, n) || !index.converged;
        const uint32_t saturations = motion.saturations + observer.saturations + measured.saturations +
                                     regressor.saturations + index.saturations + index.projection.subspace.saturations +
                                     index.projection.soft.saturations + explained.saturations + bank.saturations;
        marked += (lost || (saturations > 0u)) ? 1u : 0u;
    }
    printf("%u ticks marked\n", (unsigned)marked);
    TEST_ASSERT_TRUE(marked > 0u);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_projection_terminates_and_reports_whether_it_is_valid);
    RUN_TEST(test_a_tick_on_any_bits_terminates_and_is_reported);
    return UNITY_END();
}
