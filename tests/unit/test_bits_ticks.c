/* The bits of every stage of a tick (bits.h): each task, both projectors, both orders. */
#include "bits.h"
#include "guard.h"
#include "robots.h"

void setUp(void) {}
void tearDown(void) {}

static void fold_vector(vec3_t v) {
    fold_number(v.x);
    fold_number(v.y);
    fold_number(v.z);
}

/* --- a tick ------------------------------------------------------------------------------------------------------- */

/* Only its stages are used, as the guard runs them. */
static guard_t stage;

static observer_config_t gains;
static bank_config_t channels;
static regressor_config_t rows;
static subspace_config_t projection;
static task_config_t task;
static const acceleration_config_t bounds = {.force_floor_n = NUM(1), .error_max = NUM(2)};

static void configure(void) {
    static const double decay[OBSERVER_MAX_GAP] = {0.95, 0.9025, 0.857375, 0.81450625};
    gains.torque_sample = TORQUE_INTERVAL;
    channels.channels = 2u;
    channels.channel[1].of = (uint32_t)CHANNEL_SUDDEN;
    rows.used = 1u;
    projection = (subspace_config_t){
        .order = ORDER_PROJECT_FIRST, .tolerance = NUM(0.005), .lever_m = NUM(0.1), .softness = NUM(0.05)};
    task = (task_config_t){.detector = {.debounce_ticks = 2u, .channels = 3u},
                           .limits = {.mass_max_kg = NUM(5),
                                      .arm_max_m = NUM(0.2),
                                      .force_max_n = NUM(140),
                                      .moment_max_nm = NUM(40),
                                      .force_slack_n = NUM(25),
                                      .moment_slack_nm = NUM(10)}};
    for (uint32_t g = 0; g < OBSERVER_MAX_GAP; ++g) {
        gains.decay[g] = num_of(decay[g]);
        gains.gain[g] = num_of(1.0 - decay[g]);
        gains.momentum_gain[g] = num_of((1.0 - decay[g]) * 1000.0 / (g + 1.0));
        channels.channel[0].own[g] = num_of(decay[g]);
        channels.channel[0].in[g] = NUM(1);
        channels.channel[1].own[g] = num_of(0.99 * decay[g]);
        channels.channel[1].cross[g] = num_of(0.1 * (g + 1.0));
        channels.channel[1].back[g] = num_of(-0.1 * (g + 1.0));
        channels.channel[1].stay[g] = num_of(0.8 * decay[g]);
        channels.channel[1].in[g] = NUM(0.25);
        channels.channel[1].in_back[g] = NUM(1.75);
        channels.channel[1].high_pass[g] = num_of(0.02 * (g + 1.0));
        rows.low_pass = channels.channel[1];
        rows.low_pass.high_pass[g] = NUM(0);
    }
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        task.detector.threshold_nm[0][i] = num_of(2.0 + 0.5 * i);
        task.detector.threshold_nm[1][i] = num_of(3.0 - 0.25 * i);
        task.limits.residual_max_nm[i] = NUM(60);
    }
}

static void fold_stages(uint32_t joints) {
    fold_numbers(stage.motion.momentum, joints);
    fold_numbers(stage.motion.coriolis, joints);
    fold_numbers(stage.motion.gravity, joints);
    for (uint32_t row = 0; row < MOTION_TWIST_ROWS; ++row) {
        fold_numbers(stage.motion.jacobian[row], joints);
    }
    fold_vector(stage.motion.tool_x);
    fold_vector(stage.motion.tool_y);
    fold_vector(stage.motion.tool_z);
    fold_numbers(stage.observer.residual, joints);
    fold_numbers(stage.observer.update, joints);
    fold_vector(stage.acceleration.sideways);
    fold_number(stage.acceleration.trust);
    fold_number(stage.acceleration.across);
    fold_number(stage.acceleration.size);
    for (uint32_t c = 0; c < REGRESSOR_COLUMNS; ++c) {
        fold_numbers(stage.regressor.column[c], joints);
    }
    fold_numbers(stage.regressor.torque, joints);
    fold_numbers(stage.index.unexplained, joints);
    fold_numbers(stage.index.explained, joints);
    fold_numbers(stage.index.sudden, joints);
    fold_number(stage.index.smallest);
    fold(stage.index.rank);
    fold_numbers(stage.explained.coefficient, stage.index.columns);
    fold((uint32_t)stage.explained.excess);
    fold_number(stage.explained.value);
    fold_number(stage.explained.limit);
    fold(stage.explained.above);
    for (uint32_t c = 0; c < channels.channels; ++c) {
        fold_numbers(stage.bank.channel[c].output, joints);
    }
    fold_numbers(stage.detector.value_nm, joints);
    fold_numbers(stage.detector.threshold_nm, joints);
    for (uint32_t i = 0; i < joints; ++i) {
        fold(stage.detector.above[i]);
        fold(stage.detector.channel[i]);
    }
    fold(stage.detector.joint);
    fold(stage.detector.token);
}

static void fold_saturations(void) {
    fold(stage.motion.saturations);
    fold(stage.observer.saturations);
    fold(stage.acceleration.saturations);
    fold(stage.regressor.saturations);
    fold(stage.index.saturations + projection_saturations(&stage.index.projection));
    fold(stage.explained.saturations);
    fold(stage.bank.saturations);
}

static void step(const robot_t *robot, const num_t q[], const num_t qd[], const num_t torque[], uint32_t gap,
                 vec3_t commanded) {
    const uint32_t n = robot->joint_count;
    motion_step(&stage.motion, robot, q, qd);
    observer_step(&stage.observer, &gains, n, &stage.motion, torque, gap);
    acceleration_step(&stage.acceleration, &bounds, &gains, &stage.observer, robot, &stage.motion, qd, commanded,
                      NUM(5));
    regressor_step(&stage.regressor, &rows, &gains, robot, &stage.motion, &stage.observer, &stage.acceleration, qd);
    index_step(&stage.index, &projection, &task.index, robot, &stage.motion, &stage.observer, &stage.acceleration,
               &stage.regressor);
    explained_step(&stage.explained, &task.limits, &projection, 2u, robot, &stage.observer, &stage.acceleration,
                   &task.index, &stage.index);
    bank_step(&stage.bank, &channels, n, stage.observer.gap, stage.index.unexplained, stage.index.sudden,
              stage.explained.token);
    detector_step(&stage.detector, &task.detector, n, &stage.bank);
}

/* A walk through the joint space with torques near gravity, missing cycles, and two restarts of the observer. */
static void walk(const robot_t *robot, uint32_t order, uint32_t projector, const index_config_t *index, int ticks) {
    static const uint32_t gaps[] = {1u, 1u, 1u, 2u, 1u, 3u, 1u, 4u};
    num_t q[ROBOT_MAX_JOINTS] = {NUM(0)}, qd[ROBOT_MAX_JOINTS] = {NUM(0)}, torque[ROBOT_MAX_JOINTS] = {NUM(0)};
    double angle[ROBOT_MAX_JOINTS] = {0.3, 0.6, -0.4, -1.2, 0.5, 0.9, 0.2, 0.0}, speed[ROBOT_MAX_JOINTS] = {0.0};
    memset(&stage, 0, sizeof(stage));
    motion_init(&stage.motion);
    observer_init(&stage.observer);
    acceleration_init(&stage.acceleration);
    regressor_init(&stage.regressor);
    index_init(&stage.index);
    explained_init(&stage.explained);
    bank_init(&stage.bank);
    detector_init(&stage.detector);
    projection.order = order;
    projection.projector = projector;
    task.index = *index;
    for (int t = 0; t < ticks; ++t) {
        const uint32_t gap = (t % 40 == 39) ? 5u : gaps[t % 8];
        for (uint32_t i = 0; i < robot->joint_count; ++i) {
            speed[i] = 0.9 * speed[i] + 0.1 * random_one();
            angle[i] += 0.01 * gap * speed[i];
            q[i] = num_of(angle[i]);
            qd[i] = num_of(speed[i]);
            const double push = ((t % 32) > 20) ? 12.0 : 0.5;
            torque[i] = stage.motion.gravity[i] + num_of(push * random_one());
        }
        const double lift = 0.5 * random_one();
        step(robot, q, qd, torque, gap, (vec3_t){num_of(0.3 * random_one()), num_of(0.4), num_of(lift)});
        fold_stages(robot->joint_count);
    }
    fold_saturations();
}

static const index_config_t residual = {.kind = INDEX_RESIDUAL}, payload = {.kind = INDEX_PAYLOAD},
                            contact = {.kind = INDEX_CONTACT, .components = INDEX_ALL_COMPONENTS},
                            wrench = {.kind = INDEX_REGRESSOR};
static const index_config_t at_point = {
    .kind = INDEX_CONTACT,
    .components = 0x0Bu,
    .fast = 0x08u,
    .frame = FRAME_TOOL,
    .axis = {{NUM(0.6), NUM(0.8), NUM(0)}, {NUM(-0.8), NUM(0.6), NUM(0)}, {NUM(0), NUM(0), NUM(1)}},
    .point = {NUM(0.05), NUM(-0.1), NUM(0.2)}};
static const index_config_t in_base = {
    .kind = INDEX_CONTACT,
    .components = 0x07u,
    .fast = 0x02u,
    .frame = FRAME_BASE,
    .axis = {{NUM(1), NUM(0), NUM(0)}, {NUM(0), NUM(0.8), NUM(0.6)}, {NUM(0), NUM(-0.6), NUM(0.8)}},
    .point = {NUM(0), NUM(0.1), NUM(0)}};

static void test_ticks_without_a_task(void) {
    robot_t robot = robot_panda;
    robot.joint[1].zero_rad = NUM(0.5);
    robot.joint[3].zero_rad = NUM(-0.25);
    configure();
    start_hash(706);
    walk(&robot, ORDER_PROJECT_FIRST, PROJECTOR_HARD, &residual, 80);
    assert_hash(IF_FIXED(0xAFE5E031u, 0x14D0624Du));
}

static void test_ticks_with_a_payload(void) {
    configure();
    start_hash(707);
    walk(&robot_ku_dex, ORDER_PROJECT_FIRST, PROJECTOR_HARD, &payload, 80);
    walk(&robot_ku_dex, ORDER_PROJECT_FIRST, PROJECTOR_SOFT, &payload, 80);
    walk(&robot_ku_dex, ORDER_FILTER_FIRST, PROJECTOR_HARD, &payload, 40);
    assert_hash(IF_FIXED(0xA119301Au, 0x151FC7EEu));
}

static void test_ticks_with_a_contact(void) {
    configure();
    start_hash(708);
    walk(&robot_ku_dex, ORDER_PROJECT_FIRST, PROJECTOR_HARD, &contact, 80);
    walk(&robot_iiwa7, ORDER_PROJECT_FIRST, PROJECTOR_SOFT, &contact, 80);
    walk(&robot_ku_dex, ORDER_FILTER_FIRST, PROJECTOR_HARD, &contact, 40);
    assert_hash(IF_FIXED(0x06CB32BDu, 0x0B15DA18u));
}

static void test_ticks_with_a_contact_at_a_point(void) {
    configure();
    start_hash(709);
    walk(&robot_kinova3, ORDER_PROJECT_FIRST, PROJECTOR_SOFT, &at_point, 80);
    walk(&robot_ku_dex, ORDER_PROJECT_FIRST, PROJECTOR_SOFT, &in_base, 80);
    assert_hash(IF_FIXED(0xBE63FDC2u, 0x080A4AA4u));
}

static void test_ticks_with_a_payload_by_its_regressor(void) {
    configure();
    start_hash(710);
    walk(&robot_ku_dex, ORDER_PROJECT_FIRST, PROJECTOR_SOFT, &wrench, 120);
    assert_hash(IF_FIXED(0x10D47E15u, 0xAAB2B7A3u));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_ticks_without_a_task);
    RUN_TEST(test_ticks_with_a_payload);
    RUN_TEST(test_ticks_with_a_contact);
    RUN_TEST(test_ticks_with_a_contact_at_a_point);
    RUN_TEST(test_ticks_with_a_payload_by_its_regressor);
    return UNITY_END();
}
