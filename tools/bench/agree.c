/* agree: compares the peers' results with ours over the states of stages.c. It prints the largest difference relative
 * to the largest entry (or to 1, if that is smaller), in parts per million:
 *
 *     agree PEER QUANTITY STATES PPM
 *
 * Quantities of the motion are compared at all states. An index, from the same residual, is compared where each
 * singular value is above CLEAR times the tolerance or below 1 / ABSENT of it. In between, methods may legitimately
 * differ about the rank, and a QR drops a direction that is only nearly the singular one.
 */
#include "config.h"
#include "peer.h"
#include "report.h"
#include "states.h"
#include "vec3.h"

#define STATES 10000u
#define SEED   20240229u
#define CLEAR  2.0F
#define ABSENT 1000.0F

extern const guard_config_t board_config;

typedef struct {
    float worst; /* relative */
    uint32_t states;
} agreement_t;

typedef void motion_function_t(motion_t *, const robot_t *, const float[], const float[]);
typedef void index_function_t(index_t *, const subspace_config_t *, const index_config_t *, const robot_t *,
                              const motion_t *, const observer_t *, const acceleration_t *, const regressor_t *);

enum { SVD, QR, PROJECTIONS };
static const char *const PROJECTION_NAMES[PROJECTIONS] = {"eigen_svd", "eigen_qr"};
static index_function_t *const PROJECTION[PROJECTIONS] = {peer_svd_index_step, peer_qr_index_step};

static void compare(agreement_t *self, const float ours[], const float theirs[], const float size_of[],
                    uint32_t count) {
    float size = 1.0F;
    float off = 0.0F;
    for (uint32_t i = 0; i < count; ++i) {
        size = num_max(size, num_abs(size_of[i]));
        const float difference = num_abs(ours[i] - theirs[i]);
        off = (difference <= off) ? off : difference; /* so that NaN is reported */
    }
    const float relative = off / size;
    self->worst = (relative <= self->worst) ? self->worst : relative;
    ++self->states;
}

static void report(const char *peer, const char *quantity, const agreement_t *agreement) {
    const float ppm = agreement->worst * 1e6F;
    report_agreement(peer, quantity, agreement->states, (ppm < 1e9F) ? (uint32_t)(ppm + 0.5F) : UINT32_MAX);
}

static void agree_on_motion(const char *peer, motion_function_t *function) {
    enum { MOMENTUM, CORIOLIS, GRAVITY, JACOBIAN, QUANTITIES };
    static const char *const names[QUANTITIES] = {"momentum", "coriolis", "gravity", "jacobian"};
    static motion_t ours, theirs;
    const uint32_t n = board_config.robot.joint_count;
    agreement_t agreement[QUANTITIES] = {{0}};
    random_t random = {SEED};
    bench_state_t state = {0};
    motion_init(&ours);
    motion_init(&theirs);
    for (uint32_t i = 0; i < STATES; ++i) {
        states_next(&state, &board_config, &random, i);
        motion_step(&ours, &board_config.robot, state.position, state.velocity);
        function(&theirs, &board_config.robot, state.position, state.velocity);
        compare(&agreement[MOMENTUM], ours.momentum, theirs.momentum, ours.momentum, n);
        compare(&agreement[CORIOLIS], ours.coriolis, theirs.coriolis, ours.coriolis, n);
        compare(&agreement[GRAVITY], ours.gravity, theirs.gravity, ours.gravity, n);
        for (uint32_t row = 0; row < MOTION_TWIST_ROWS; ++row) {
            compare(&agreement[JACOBIAN], ours.jacobian[row], theirs.jacobian[row], ours.jacobian[row], n);
        }
    }
    agreement[JACOBIAN].states /= MOTION_TWIST_ROWS;
    for (uint32_t i = 0; i < QUANTITIES; ++i) {
        report(peer, names[i], &agreement[i]);
    }
}

static bool is_clear(const motion_t *motion, index_kind_t kind, const acceleration_t *acceleration, const float tau[]) {
    static const float down[3] = {0.0F, 0.0F, -1.0F};
    const float tolerance = board_config.subspace.tolerance;
    float singular[PEER_COLUMNS];
    float rejected[ROBOT_MAX_JOINTS];
    const peer_task_t task = {.jacobian = &motion->jacobian[0][0],
                              .acceleration = (kind == INDEX_PAYLOAD) ? &acceleration->sideways.x : 0,
                              .down = down,
                              .lever = board_config.subspace.lever_m,
                              .tolerance = tolerance};
    (void)peer_svd_project(&task, tau, rejected, singular);
    const uint32_t columns = (kind == INDEX_PAYLOAD) ? 5u : 6u;
    for (uint32_t i = 0; i < columns; ++i) {
        if ((singular[i] > (tolerance / ABSENT)) && (singular[i] < (tolerance * CLEAR))) {
            return false;
        }
    }
    return true;
}

static acceleration_t sideways_of(const bench_state_t *state) {
    static const vec3_t down = {0.0F, 0.0F, -1.0F};
    uint32_t saturations = 0;
    const vec3_t across = vec3_across(state->acceleration, down, &saturations);
    return (acceleration_t){.sideways = vec3_unit(across, &saturations)};
}

static void agree_on_index(const char *quantity, index_kind_t kind) {
    static motion_t motion;
    static observer_t observer;
    static index_t ours, theirs;
    static const regressor_t regressor; /* neither index uses it */
    const uint32_t n = board_config.robot.joint_count;
    const index_config_t row = {.kind = (uint32_t)kind,
                                .components = (kind == INDEX_CONTACT) ? INDEX_ALL_COMPONENTS : 0u};
    subspace_config_t config = board_config.subspace;
    config.order = (uint32_t)ORDER_FILTER_FIRST; /* of r and hard, as the peers do */
    config.projector = (uint32_t)PROJECTOR_HARD;
    agreement_t agreement[PROJECTIONS] = {{0}};
    random_t random = {SEED};
    bench_state_t state = {0};
    motion_init(&motion);
    for (uint32_t i = 0; i < STATES; ++i) {
        states_next(&state, &board_config, &random, i);
        motion_step(&motion, &board_config.robot, state.position, state.velocity);
        observer_init(&observer);
        for (uint32_t joint = 0; joint < n; ++joint) {
            observer.residual[joint] = state.torque[joint];
        }
        observer.decay = board_config.observer.decay[0];
        const acceleration_t acceleration = sideways_of(&state);
        if (!is_clear(&motion, kind, &acceleration, observer.residual)) {
            continue;
        }
        index_init(&ours);
        index_step(&ours, &config, &row, &board_config.robot, &motion, &observer, &acceleration, &regressor);
        for (uint32_t p = 0; p < PROJECTIONS; ++p) {
            PROJECTION[p](&theirs, &config, &row, &board_config.robot, &motion, &observer, &acceleration, &regressor);
            compare(&agreement[p], ours.unexplained, theirs.unexplained, observer.residual, n);
        }
    }
    for (uint32_t p = 0; p < PROJECTIONS; ++p) {
        report(PROJECTION_NAMES[p], quantity, &agreement[p]);
    }
}

int main(void) {
    agree_on_motion("casadi", peer_casadi_motion_step);
#ifdef PEER_PINOCCHIO
    agree_on_motion("pinocchio", peer_pinocchio_motion_step);
#endif
    agree_on_index("payload", INDEX_PAYLOAD);
    agree_on_index("contact", INDEX_CONTACT);
    return 0;
}
