/* The robot's end of the wire: what it packs, and which answers of the guard permit motion.
 * tests/host/test_robot_side.py compares the same code with cantools and with the Python one. */
#include "robot_side.h"

#include <string.h>

#include "protocol.h"
#include "unity.h"

#define PERIOD_US 1000u
#define ANSWER_US 500u
#define HOLD_US   1500u
#define NO_REASON 1u
#define COLLISION 6u

static robot_side_t robot;
static e2e_transmitter_t guard; /* the guard's counter */
static can_frame_t frame;
static uint64_t now_us;

static const robot_side_config_t config = {.joints = 7u, .answer_us = ANSWER_US, .hold_us = HOLD_US};

void setUp(void) {
    TEST_ASSERT_TRUE(robot_side_init(&robot, &config));
    guard = (e2e_transmitter_t){0};
    now_us = 1000000u;
}
void tearDown(void) {}

static uint8_t nibbles(uint32_t high, uint32_t low) {
    return (uint8_t)((high << 4u) | low);
}

/* StopCommand with a permission for the current cycle, without counter and CRC. */
static can_frame_t permission(void) {
    can_frame_t stop = {.id = protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND].id, .length = 8u};
    stop.data[1] = nibbles(3u, 0u);
    stop.data[2] = nibbles(0xEu, 0x1u);
    stop.data[3] = nibbles(robot.cycle & 0xFu, 2u);
    stop.data[4] = NO_REASON;
    stop.data[5] = 9u;
    return stop;
}

static can_frame_t stop_of(uint32_t category, uint8_t reason) {
    can_frame_t stop = permission();
    stop.data[2] = nibbles(0xFu, 0x0u);
    stop.data[3] = nibbles(robot.cycle & 0xFu, category);
    stop.data[4] = reason;
    return stop;
}

static void hear_unsealed(can_frame_t heard) {
    robot_side_hear(&robot, &heard, now_us);
}

static void hear(can_frame_t heard) {
    e2e_protect(&guard, heard.data, heard.length, protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND].data_ids);
    hear_unsealed(heard);
}

static void begin(void) {
    now_us += PERIOD_US;
    robot_side_begin(&robot, now_us, &frame);
}

static bool permits(void) {
    return robot_side_permit(&robot, now_us).allowed;
}

/* One cycle before: the first frame only sets the reference of the counter. */
static void start(void) {
    begin();
    hear(permission());
    TEST_ASSERT_FALSE(permits());
    begin();
}

static void test_a_configuration_outside_its_ranges_permits_nothing(void) {
    static const robot_side_config_t refused[] = {
        {.joints = 0u, .answer_us = ANSWER_US, .hold_us = HOLD_US},
        {.joints = ROBOT_SIDE_MAX_JOINTS + 1u, .answer_us = ANSWER_US, .hold_us = HOLD_US},
        {.joints = 7u, .answer_us = 0u, .hold_us = HOLD_US},
        {.joints = 7u, .answer_us = ANSWER_US, .hold_us = ANSWER_US - 1u}};
    for (size_t i = 0; i < sizeof(refused) / sizeof(refused[0]); ++i) {
        TEST_ASSERT_FALSE(robot_side_init(&robot, &refused[i]));
        start();
        hear(permission());
        now_us += 1u;
        TEST_ASSERT_FALSE(permits());
    }
}

static void test_an_answer_permits_for_its_time_and_no_longer(void) {
    start();
    const uint64_t begun_us = now_us;
    now_us = begun_us + ANSWER_US;
    hear(permission());
    const robot_side_permit_t permit = robot_side_permit(&robot, begun_us + HOLD_US);
    TEST_ASSERT_TRUE(permit.allowed);
    TEST_ASSERT_EQUAL(2, permit.category);
    TEST_ASSERT_EQUAL(3, permit.joint);
    TEST_ASSERT_EQUAL(9, permit.trip);
    TEST_ASSERT_FALSE(robot_side_permit(&robot, begun_us + HOLD_US + 1u).allowed);
    TEST_ASSERT_FALSE(robot_side_permit(&robot, begun_us - 1u).allowed);
    TEST_ASSERT_EQUAL(1, robot_side_permit(&robot, begun_us - 1u).category);
}

static void test_an_answer_that_is_late_or_from_before_the_cycle_permits_nothing(void) {
    start();
    const uint64_t begun_us = now_us;
    now_us = begun_us + ANSWER_US + 1u;
    hear(permission());
    TEST_ASSERT_FALSE(robot_side_permit(&robot, begun_us + ANSWER_US).allowed);
    now_us = begun_us - 1u;
    hear(permission());
    TEST_ASSERT_FALSE(robot_side_permit(&robot, begun_us + 1u).allowed);
}

static void test_an_answer_to_another_cycle_or_before_any_permits_nothing(void) {
    hear(permission());
    hear(permission());
    TEST_ASSERT_FALSE(permits());
    setUp();
    start();
    can_frame_t other = permission();
    other.data[3] = nibbles((robot.cycle + 1u) & 0xFu, 2u);
    hear(other);
    TEST_ASSERT_FALSE(permits());
    hear(permission());
    TEST_ASSERT_TRUE(permits());
    begin();
    TEST_ASSERT_FALSE(permits());
}

/* Each frame has a valid CRC and contradicts itself in one field. */
static void test_a_permission_that_contradicts_itself_is_a_stop(void) {
    const struct {
        uint32_t byte;
        uint8_t value;
    } changed[] = {{2u, 0xE0u}, {2u, 0xF1u}, {4u, COLLISION}, {1u, 0x90u}};
    for (size_t i = 0; i < sizeof(changed) / sizeof(changed[0]); ++i) {
        setUp();
        start();
        can_frame_t odd = permission();
        odd.data[changed[i].byte] = changed[i].value;
        hear(odd);
        TEST_ASSERT_FALSE(permits());
        hear(permission());
        TEST_ASSERT_FALSE_MESSAGE(permits(), "a stop lasts for its cycle");
    }
    setUp();
    start();
    can_frame_t unknown = permission();
    unknown.data[3] |= 3u;
    hear(unknown);
    TEST_ASSERT_FALSE(permits());
    TEST_ASSERT_EQUAL(0, robot_side_permit(&robot, now_us).category);
    setUp();
    start();
    can_frame_t without_index = permission();
    without_index.data[7] = 0x80u;
    hear(without_index);
    TEST_ASSERT_FALSE(permits());
    setUp();
    start();
    can_frame_t with_index = permission();
    with_index.data[6] = 1u;
    with_index.data[7] = 0x80u;
    hear(with_index);
    TEST_ASSERT_TRUE(permits());
}

static void test_the_worst_stop_of_a_cycle_applies(void) {
    start();
    hear(stop_of(1u, COLLISION));
    hear(stop_of(2u, COLLISION + 1u));
    TEST_ASSERT_EQUAL(1, robot_side_permit(&robot, now_us).category);
    TEST_ASSERT_EQUAL(COLLISION, robot_side_permit(&robot, now_us).reason);
    hear(stop_of(0u, COLLISION + 2u));
    TEST_ASSERT_EQUAL(0, robot_side_permit(&robot, now_us).category);
    TEST_ASSERT_EQUAL(COLLISION + 2u, robot_side_permit(&robot, now_us).reason);
}

static void test_foreign_frames_and_frames_with_a_wrong_crc_have_no_effect(void) {
    start();
    can_frame_t sealed = permission();
    e2e_protect(&guard, sealed.data, 8u, protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND].data_ids);
    can_frame_t other = sealed;
    ++other.id;
    hear_unsealed(other);
    other = sealed;
    --other.length;
    hear_unsealed(other);
    other = sealed;
    other.flags = CAN_FRAME_EXTENDED;
    hear_unsealed(other);
    other = sealed;
    other.data[7] ^= 1u;
    hear_unsealed(other);
    TEST_ASSERT_FALSE(permits());
    hear_unsealed(sealed);
    TEST_ASSERT_TRUE(permits());
}

static void test_two_guards_on_the_bus_permit_nothing(void) {
    start();
    e2e_transmitter_t second = {.counter = 7u};
    for (uint32_t i = 0; i < 12u; ++i) {
        begin();
        hear(permission());
        can_frame_t twin = permission();
        e2e_protect(&second, twin.data, 8u, protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND].data_ids);
        hear_unsealed(twin);
        hear_unsealed(twin);
    }
    begin();
    hear(permission());
    begin();
    hear(permission()); /* a good answer, with a good counter */
    TEST_ASSERT_TRUE(robot_side_has_company(&robot));
    TEST_ASSERT_FALSE(permits());
    for (uint32_t i = 0; i < 24u; ++i) {
        begin();
        hear(permission());
    }
    TEST_ASSERT_FALSE(robot_side_has_company(&robot));
    TEST_ASSERT_TRUE(permits());
}

static void test_a_node_follows_the_cycle_of_a_good_sync_alone(void) {
    robot_side_t node;
    TEST_ASSERT_TRUE(robot_side_init(&node, &config));
    for (uint32_t i = 0; i < 300u; ++i) {
        begin();
    }
    const can_frame_t sync = frame;
    can_frame_t bad = sync;
    ++bad.id;
    TEST_ASSERT_FALSE(robot_side_follow(&node, &bad, now_us));
    bad = sync;
    ++bad.length;
    TEST_ASSERT_FALSE(robot_side_follow(&node, &bad, now_us));
    bad = sync;
    bad.flags = CAN_FRAME_REMOTE;
    TEST_ASSERT_FALSE(robot_side_follow(&node, &bad, now_us));
    bad = sync;
    bad.data[2] ^= 1u;
    TEST_ASSERT_FALSE(robot_side_follow(&node, &bad, now_us));
    TEST_ASSERT_FALSE(node.begun);
    TEST_ASSERT_TRUE(robot_side_follow(&node, &sync, now_us));
    TEST_ASSERT_EQUAL(299, node.cycle);
}

static void test_a_task_that_the_wire_cannot_carry_is_refused(void) {
    static const float rest[3] = {0.0f, 0.0f, 0.0f};
    static const float fast[3] = {0.0f, 33.0f, 0.0f};
    begin();
    TEST_ASSERT_FALSE(robot_side_task(&robot, (robot_side_task_t)0, rest, &frame));
    TEST_ASSERT_FALSE(robot_side_task(&robot, (robot_side_task_t)7, rest, &frame));
    TEST_ASSERT_FALSE(robot_side_task(&robot, ROBOT_SIDE_TASK_NONE, fast, &frame));
    TEST_ASSERT_TRUE(robot_side_task(&robot, ROBOT_SIDE_TASK_6, rest, &frame));
    TEST_ASSERT_EQUAL_HEX8(0x60, frame.data[1] & 0xF0);
}

/* Every value of the three, beyond either end, is "not available", and never clamped. */
static void test_a_reading_that_the_wire_cannot_carry_is_not_available(void) {
    const robot_side_reading_t good = {
        .status = ROBOT_SIDE_SENSOR_OK, .position_rad = -1.0f, .velocity_rad_s = 2.0f, .torque_nm = 3.0f};
    begin();
    TEST_ASSERT_TRUE(robot_side_joint(&robot, 6u, &good, &frame));
    TEST_ASSERT_EQUAL_HEX8(0x00, frame.data[1] & 0x30);
    TEST_ASSERT_EQUAL_HEX16(0xE0C0, (frame.data[3] << 8) | frame.data[2]); /* -8000 */
    TEST_ASSERT_FALSE(robot_side_joint(&robot, 7u, &good, &frame));
    const float beyond[] = {400.0f, -400.0f, 0.0f / 0.0f};
    for (size_t i = 0; i < sizeof(beyond) / sizeof(beyond[0]); ++i) {
        robot_side_reading_t bad[3] = {good, good, good};
        bad[0].position_rad = beyond[i];
        bad[1].velocity_rad_s = beyond[i];
        bad[2].torque_nm = beyond[i];
        for (size_t j = 0; j < 3u; ++j) {
            TEST_ASSERT_TRUE(robot_side_joint(&robot, 0u, &bad[j], &frame));
            TEST_ASSERT_EQUAL_HEX8(0x30, frame.data[1] & 0x30);
            TEST_ASSERT_EQUAL(0, frame.data[2] | frame.data[4] | frame.data[6]);
        }
    }
}

static void test_can_fd_marks_every_frame(void) {
    robot.config.fd = true;
    begin();
    TEST_ASSERT_EQUAL(CAN_FRAME_FD | CAN_FRAME_BRS, frame.flags);
}

static void test_a_reset_names_the_last_trip(void) {
    start();
    hear(stop_of(1u, COLLISION));
    robot_side_reset(&robot, false, &frame);
    TEST_ASSERT_EQUAL_HEX8(0x00, frame.data[1] & 0xF0);
    robot_side_reset(&robot, true, &frame);
    TEST_ASSERT_EQUAL_HEX8(0x10, frame.data[1] & 0xF0);
    TEST_ASSERT_EQUAL(9, frame.data[2]);
    TEST_ASSERT_EQUAL(2, frame.data[1] & 0x0F);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_configuration_outside_its_ranges_permits_nothing);
    RUN_TEST(test_an_answer_permits_for_its_time_and_no_longer);
    RUN_TEST(test_an_answer_that_is_late_or_from_before_the_cycle_permits_nothing);
    RUN_TEST(test_an_answer_to_another_cycle_or_before_any_permits_nothing);
    RUN_TEST(test_a_permission_that_contradicts_itself_is_a_stop);
    RUN_TEST(test_the_worst_stop_of_a_cycle_applies);
    RUN_TEST(test_foreign_frames_and_frames_with_a_wrong_crc_have_no_effect);
    RUN_TEST(test_two_guards_on_the_bus_permit_nothing);
    RUN_TEST(test_a_node_follows_the_cycle_of_a_good_sync_alone);
    RUN_TEST(test_a_task_that_the_wire_cannot_carry_is_refused);
    RUN_TEST(test_a_reading_that_the_wire_cannot_carry_is_not_available);
    RUN_TEST(test_can_fd_marks_every_frame);
    RUN_TEST(test_a_reset_names_the_last_trip);
    return UNITY_END();
}
