/* firmware/core, fixed point, part one: code without sums of products of two unbounded numbers. Overflow is proved too.
 */
#include "num_stub.h"

#include "bank.c"
#include "detector.c"
#include "observer.c"
#include "robot.c"
#include "sensor.c"
#include "vec3.h"

static bool is_constant(num_t a, num_t most) {
    return (a >= -most) && (a <= most);
}

static uint32_t any_joints(void) {
    uint32_t joints;
    ASSUME((joints >= 1u) && (joints <= ROBOT_MAX_JOINTS));
    return joints;
}

void proof_bank(void) {
    bank_t bank;
    bank_config_t config;
    num_t unexplained[ROBOT_MAX_JOINTS], sudden[ROBOT_MAX_JOINTS];
    uint32_t gap, token;
    config.channels = 1u; /* the loop treats each in the same way */
    for (uint32_t c = 0; c < 1u; ++c) {
        for (uint32_t g = 0; g < OBSERVER_MAX_GAP; ++g) { /* as config_filters.c requires */
            const channel_config_t *const channel = &config.channel[c];
            ASSUME(is_constant(channel->own[g], NUM(1)) && is_constant(channel->cross[g], NUM(1)));
            ASSUME(is_constant(channel->back[g], NUM(1)) && is_constant(channel->stay[g], NUM(1)));
            ASSUME(is_constant(channel->in[g], NUM(16)) && is_constant(channel->in_back[g], NUM(16)));
            ASSUME(is_constant(channel->high_pass[g], NUM(1)));
        }
    }
    bank_step(&bank, &config, any_joints(), gap, unexplained, sudden, token);
    bank_init(&bank);
    REACHED;
}

void proof_ratio(void) {
    num_t a, b, c, d;
    (void)ratio_is_greater(a, b, c, d);
    REACHED;
}

/* Either answer: what the detector promises does not depend on it. Two products of any numbers are too much for CBMC.
 */
bool stub_ratio(num_t a, num_t b, num_t c, num_t d) {
    bool greater;
    (void)a;
    (void)b;
    (void)c;
    (void)d;
    return greater;
}

void proof_detector_channels(void) {
    detector_config_t task;
    bank_t bank;
    watched_t watched[BANK_MAX_CHANNELS];
    ASSUME((task.channels != 0u) && ((task.channels >> BANK_MAX_CHANNELS) == 0u));
    const uint32_t count = watched_channels(&task, &bank, watched);
    HOLDS((count >= 1u) && (count <= BANK_MAX_CHANNELS), "at least one channel, and no more than the bank has");
    for (uint32_t k = 0; k < count; ++k) {
        HOLDS(watched[k].channel < BANK_MAX_CHANNELS, "the channel is one of the bank's");
        HOLDS(__CPROVER_r_ok(watched[k].value, ROBOT_MAX_JOINTS * sizeof(num_t)), "a value of each joint");
        HOLDS(__CPROVER_r_ok(watched[k].threshold, ROBOT_MAX_JOINTS * sizeof(num_t)), "a threshold of each joint");
    }
    REACHED;
}

void proof_detector_joint(void) {
    detector_t detector;
    num_t value[BANK_MAX_CHANNELS][ROBOT_MAX_JOINTS], threshold[BANK_MAX_CHANNELS][ROBOT_MAX_JOINTS];
    watched_t watched[BANK_MAX_CHANNELS];
    uint32_t count, i;
    ASSUME((count >= 1u) && (count <= BANK_MAX_CHANNELS) && (i < ROBOT_MAX_JOINTS)); /* proof_detector_channels */
    for (uint32_t k = 0; k < BANK_MAX_CHANNELS; ++k) {
        watched[k].value = value[k];
        watched[k].threshold = threshold[k];
        ASSUME(watched[k].channel < BANK_MAX_CHANNELS);
    }
    (void)look_at_joint(&detector, watched, count, i);
    HOLDS(detector.channel[i] < BANK_MAX_CHANNELS, "the channel is one of the bank's");
    REACHED;
}

nearest_t stub_look(detector_t *self, const watched_t watched[], uint32_t count, uint32_t i) {
    nearest_t any;
    uint8_t channel;
    HOLDS((count >= 1u) && (count <= BANK_MAX_CHANNELS) && (i < ROBOT_MAX_JOINTS), "channels and joint are there");
    HOLDS(__CPROVER_r_ok(watched, count * sizeof(*watched)), "an entry of each channel");
    ASSUME(channel < BANK_MAX_CHANNELS);
    self->channel[i] = channel;
    return any;
}

void proof_detector(void) {
    detector_t detector;
    detector_config_t task;
    bank_t bank;
    const uint32_t joints = any_joints();
    ASSUME((task.channels != 0u) && ((task.channels >> BANK_MAX_CHANNELS) == 0u));
    detector_step(&detector, &task, joints, &bank);
    HOLDS(detector.joint < joints, "the reported joint is one of the arm's");
    HOLDS(!detector.tripped || detector.any_above, "a trip is above a threshold");
    HOLDS(!detector.tripped || (detector.above[detector.joint] >= task.debounce_ticks), "a trip has its debounce");
    for (uint32_t i = 0; i < joints; ++i) {
        HOLDS(detector.channel[i] < BANK_MAX_CHANNELS, "the channel is one of the bank's");
    }
    detector_init(&detector);
    REACHED;
}

void proof_observer(void) {
    observer_t observer;
    observer_config_t config;
    motion_t motion;
    num_t torque[ROBOT_MAX_JOINTS];
    uint32_t gap;
    for (uint32_t g = 0; g < OBSERVER_MAX_GAP; ++g) { /* as config_bounds.c requires */
        ASSUME(is_constant(config.decay[g], NUM(1)) && is_constant(config.gain[g], NUM(1)));
        ASSUME(is_constant(config.momentum_gain[g], NUM(500)));
    }
    observer_step(&observer, &config, any_joints(), &motion, torque, gap);
    HOLDS(observer.gap <= OBSERVER_MAX_GAP, "later stages have constants for the gap");
    HOLDS(is_constant(observer.decay, NUM(1)), "explained.c relies on the decay");
    observer_init(&observer);
    REACHED;
}

void proof_sensor(void) {
    sensor_config_t config;
    num_t velocity[ROBOT_MAX_JOINTS], torque[ROBOT_MAX_JOINTS], corrected[ROBOT_MAX_JOINTS];
    (void)sensor_config_is_valid(&config);
    sensor_correct(&config, any_joints(), velocity, torque, corrected);
    REACHED;
}

/* Any joint of any table. */
void proof_robot_joint(void) {
    robot_joint_t joint;
    (void)joint_is_valid(&joint);
    REACHED;
}

void proof_tokens(void) {
    num_t values[ROBOT_MAX_JOINTS];
    uint32_t before;
    HOLDS(token_next(before, TOKEN_MOTION, token_bits(values, any_joints())) != 0u, "a token is never zero");
    REACHED;
}

void proof_vec3(void) {
    vec3_t a, b;
    uint32_t saturations;
    (void)vec3_add(a, b, &saturations);
    (void)vec3_subtract(a, b, &saturations);
    (void)vec3_unit(a, &saturations);
    (void)vec3_length(a);
    REACHED;
}

/* A vector times one with components below 64, as in every caller. */
void proof_vec3_products(void) {
    vec3_t a, b;
    uint32_t saturations;
    ASSUME(is_constant(b.x, NUM(63.9)) && is_constant(b.y, NUM(63.9)) && is_constant(b.z, NUM(63.9)));
    (void)vec3_dot(a, b, &saturations);
    (void)vec3_cross(a, b, &saturations);
    (void)vec3_across(a, b, &saturations);
    REACHED;
}
