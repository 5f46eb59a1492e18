/* The event recorder: the samples that it keeps of a trip, and the frames that it sends. */
#include "event_log.h"

#include "e2e.h"
#include "messages.h"
#include "robots.h"
#include "unity.h"

#define JOINT     3u
#define JOINTS    7u
#define PERIOD_US 1000u

/* A frame as the receiver reads it. */
typedef struct {
    uint32_t slot, part, trip, reason, joint, joints, step, before, number, sample_joint, task, channel;
    int16_t residual, index;
} said_t;

static event_log_t log_;
static guard_config_t config;
static guard_output_t out;
static can_frame_t frame;
static uint32_t waited; /* ticks for the newest frame */

void setUp(void) {
    config = (guard_config_t){.format = FORMAT_CLASSIC, .period_us = PERIOD_US, .robot = robot_ku_dex};
    event_log_init(&log_, &config);
    out = (guard_output_t){.task = 1u, .trip_number = 0u};
    frame = (can_frame_t){0};
}
void tearDown(void) {}

/* One tick whose residual on JOINT is `value`; true if a frame is to be sent. */
static bool step(double value) {
    out.residual[JOINT] = (num_t)NUM(value);
    out.index[JOINT] = (num_t)NUM(-value);
    event_log_note(&log_, &out);
    return event_log_frame(&log_, &frame);
}

static void ticks(uint32_t count, double value) {
    for (uint32_t i = 0; i < count; ++i) {
        (void)step(value);
    }
}

static void trip(uint8_t number) {
    out.trip_number = number;
    out.reason = GUARD_REASON_COLLISION;
    out.joint = JOINT + 1u;
}

static uint32_t bits(uint32_t first, uint32_t length) {
    uint64_t word = 0;
    for (uint32_t i = 0; i < 8u; ++i) {
        word |= (uint64_t)frame.data[i] << (8u * i);
    }
    return (uint32_t)(word >> first) & ((1u << length) - 1u);
}

static said_t next(void) {
    for (uint32_t i = 0; i < EVENT_FRAME_TICKS; ++i) {
        if (step(0.0)) {
            waited = i + 1u;
            return (said_t){.slot = bits(12, 3),
                            .part = bits(15, 1),
                            .trip = bits(16, 8),
                            .reason = bits(24, 8),
                            .joint = bits(32, 4),
                            .joints = bits(36, 4),
                            .step = bits(40, 16),
                            .before = bits(56, 6),
                            .number = bits(16, 6),
                            .sample_joint = bits(22, 3),
                            .task = bits(25, 2),
                            .channel = bits(27, 2),
                            .residual = (int16_t)bits(32, 16),
                            .index = (int16_t)bits(48, 16)};
        }
    }
    TEST_FAIL_MESSAGE("no frame");
    return (said_t){0};
}

static void test_no_frame_is_sent_before_a_trip_is_complete(void) {
    for (uint32_t i = 0; i < 1000u; ++i) {
        TEST_ASSERT_FALSE(step(0.1));
    }
    trip(1u);
    for (uint32_t i = 0; i < (5u * EVENT_AFTER); ++i) {
        TEST_ASSERT_FALSE(step(5.0));
    }
}

static void test_an_event_has_samples_from_before_and_after_its_trip(void) {
    ticks(500u, 1.0);
    trip(7u);
    ticks(1u, 6.0);
    ticks(5u * EVENT_AFTER, 4.0);
    const said_t header = next();
    TEST_ASSERT_EQUAL(0u, header.part);
    TEST_ASSERT_EQUAL(7u, header.trip);
    TEST_ASSERT_EQUAL(GUARD_REASON_COLLISION, header.reason);
    TEST_ASSERT_EQUAL(JOINT + 1u, header.joint);
    TEST_ASSERT_EQUAL(JOINTS, header.joints);
    TEST_ASSERT_EQUAL(5000u, header.step);
    TEST_ASSERT_EQUAL(EVENT_SAMPLES - EVENT_AFTER - 1u, header.before);
    for (uint32_t number = 0; number < EVENT_SAMPLES; ++number) {
        for (uint32_t joint = 0; joint < JOINTS; ++joint) {
            const said_t sample = next();
            const int16_t expected = (number < header.before) ? 100 : (number == header.before) ? 600 : 400;
            TEST_ASSERT_EQUAL(1u, sample.part);
            TEST_ASSERT_EQUAL(number, sample.number);
            TEST_ASSERT_EQUAL(joint, sample.sample_joint);
            TEST_ASSERT_EQUAL(1u, sample.task);
            TEST_ASSERT_EQUAL((joint == JOINT) ? expected : 0, sample.residual);
            TEST_ASSERT_EQUAL((joint == JOINT) ? -expected : 0, sample.index);
        }
    }
    TEST_ASSERT_EQUAL(0u, next().part); /* and from the beginning */
}

static void test_the_last_three_trips_are_kept(void) {
    for (uint8_t number = 1; number <= 5u; ++number) {
        ticks(300u, 0.0);
        trip(number);
        ticks(5u * EVENT_AFTER + 5u, 0.0);
    }
    uint32_t seen = 0;
    for (uint32_t i = 0; i < (3u * (1u + (EVENT_SAMPLES * JOINTS))); ++i) {
        const said_t message = next();
        seen |= (message.part == 0u) ? (1u << message.trip) : 0u;
    }
    TEST_ASSERT_EQUAL_HEX32(0x38u, seen);
}

static void test_a_trip_soon_after_the_start_has_fewer_samples_before(void) {
    ticks(12u, 0.0); /* 3 samples */
    trip(1u);
    ticks(1u + (5u * EVENT_AFTER), 0.0);
    TEST_ASSERT_EQUAL(3u, next().before);
    for (uint32_t i = 0; i < ((3u + 1u + EVENT_AFTER) * JOINTS); ++i) {
        TEST_ASSERT_EQUAL(1u, next().part);
    }
    TEST_ASSERT_EQUAL(0u, next().part);
}

static void test_a_second_trip_within_an_event_belongs_to_it(void) {
    ticks(300u, 0.0);
    trip(1u);
    ticks(20u, 0.0);
    trip(2u);
    ticks((5u * EVENT_AFTER) - 19u, 0.0);
    TEST_ASSERT_EQUAL(1u, next().trip);
    TEST_ASSERT_EQUAL(0u, log_.remaining);
}

static void test_frames_are_sealed_and_in_the_format_of_the_bus(void) {
    config.format = FORMAT_FD;
    event_log_init(&log_, &config);
    trip(1u);
    ticks(1u + (5u * EVENT_AFTER), 0.0);
    e2e_receiver_t receiver = {0};
    const protocol_transmit_t *const entry = &protocol_transmit[PROTOCOL_TRANSMIT_GUARD_EVENT];
    for (uint32_t i = 0; i < 40u; ++i) {
        (void)next();
        TEST_ASSERT_TRUE((waited == EVENT_FRAME_TICKS) || (i == 0u));
        TEST_ASSERT_EQUAL(entry->id, frame.id);
        TEST_ASSERT_EQUAL(CAN_FRAME_FD | CAN_FRAME_BRS, frame.flags);
        TEST_ASSERT_EQUAL((i == 0u) ? E2E_INITIAL : E2E_OK,
                          e2e_check(&receiver, frame.data, frame.length, entry->data_ids, 1u));
    }
}

static void test_a_classic_bus_gets_classic_frames(void) {
    trip(1u);
    ticks(1u + (5u * EVENT_AFTER), 0.0);
    (void)next();
    TEST_ASSERT_EQUAL(0u, frame.flags);
}

static void test_the_first_tick_is_a_sample(void) {
    ticks(11u, 0.0); /* the 1st, 6th and 11th */
    trip(1u);
    ticks(1u + (5u * EVENT_AFTER), 0.0);
    TEST_ASSERT_EQUAL(3u, next().before);
}

static void test_samples_are_as_many_whole_periods_apart_as_fit_into_5_ms(void) {
    config.period_us = 1667u; /* three are 5001 us */
    event_log_init(&log_, &config);
    trip(1u);
    ticks(1u + (2u * EVENT_AFTER), 0.0);
    TEST_ASSERT_EQUAL(3334u, next().step);
}

/* An arm of eight joints, whose torques differ from joint to joint, and a ring that is not yet full. */
static void test_every_joint_of_a_sample_is_its_own(void) {
    config.robot.joint_count = ROBOT_MAX_JOINTS;
    event_log_init(&log_, &config);
    for (uint32_t joint = 0; joint < ROBOT_MAX_JOINTS; ++joint) {
        out.residual[joint] = (num_t)NUM(0.5) * (num_t)(joint + 1u);
        out.index[joint] = (num_t)NUM(-0.25) * (num_t)(joint + 1u);
    }
    trip(1u);
    for (uint32_t i = 0; i < 1u + (5u * EVENT_AFTER); ++i) {
        event_log_note(&log_, &out);
    }
    TEST_ASSERT_EQUAL(0u, next().before);
    for (uint32_t i = 0; i < (1u + EVENT_AFTER) * ROBOT_MAX_JOINTS; ++i) {
        const said_t sample = next();
        const int32_t joint = (int32_t)(i % ROBOT_MAX_JOINTS);
        TEST_ASSERT_EQUAL(joint, sample.sample_joint);
        TEST_ASSERT_EQUAL(50 * (joint + 1), sample.residual);
        TEST_ASSERT_EQUAL(-25 * (joint + 1), sample.index);
    }
}

static void test_a_torque_beyond_the_signal_is_its_end(void) {
    trip(1u);
    ticks(1u, 400.0); /* the signal ends at 327.67 Nm */
    ticks(5u * EVENT_AFTER, 0.0);
    for (uint32_t i = 0; i < 1u + JOINT; ++i) {
        (void)next();
    }
    const said_t sample = next();
    TEST_ASSERT_EQUAL(JOINT, sample.sample_joint);
    TEST_ASSERT_EQUAL(32767, sample.residual);
    TEST_ASSERT_EQUAL(-32767, sample.index);
}

static void test_events_take_one_slot_after_the_other_and_are_sent_so(void) {
    for (uint8_t number = 1; number <= 3u; ++number) {
        trip(number);
        ticks(1u + (5u * EVENT_AFTER), 0.0);
    }
    uint32_t order[3] = {0};
    for (uint32_t found = 0; found < 3u;) {
        const said_t message = next();
        if (message.part == 0u) {
            TEST_ASSERT_EQUAL(message.trip - 1u, message.slot);
            order[found++] = message.slot;
        }
    }
    TEST_ASSERT_EQUAL((order[0] + 1u) % 3u, order[1]);
    TEST_ASSERT_EQUAL((order[1] + 1u) % 3u, order[2]);
}

static void test_the_first_frame_comes_in_the_eighth_tick_from_the_last_sample(void) {
    trip(1u);
    for (uint32_t i = 0; i < (5u * EVENT_AFTER) + EVENT_FRAME_TICKS - 1u; ++i) {
        TEST_ASSERT_FALSE(step(0.0));
    }
    TEST_ASSERT_TRUE(step(0.0));
}

static void test_a_slow_guard_takes_a_sample_every_tick(void) {
    config.period_us = 20000u;
    event_log_init(&log_, &config);
    ticks(60u, 0.0);
    trip(1u);
    ticks(1u + EVENT_AFTER, 0.0);
    TEST_ASSERT_EQUAL(20000u, next().step);
}

static void test_a_step_longer_than_its_field_is_the_largest_that_fits(void) {
    log_.step_us = 100000u;
    trip(1u);
    ticks(1u + 5u * EVENT_AFTER, 1.0);
    TEST_ASSERT_EQUAL(UINT16_MAX, next().step);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_step_longer_than_its_field_is_the_largest_that_fits);
    RUN_TEST(test_no_frame_is_sent_before_a_trip_is_complete);
    RUN_TEST(test_an_event_has_samples_from_before_and_after_its_trip);
    RUN_TEST(test_the_last_three_trips_are_kept);
    RUN_TEST(test_a_trip_soon_after_the_start_has_fewer_samples_before);
    RUN_TEST(test_a_second_trip_within_an_event_belongs_to_it);
    RUN_TEST(test_frames_are_sealed_and_in_the_format_of_the_bus);
    RUN_TEST(test_a_classic_bus_gets_classic_frames);
    RUN_TEST(test_the_first_tick_is_a_sample);
    RUN_TEST(test_samples_are_as_many_whole_periods_apart_as_fit_into_5_ms);
    RUN_TEST(test_every_joint_of_a_sample_is_its_own);
    RUN_TEST(test_a_torque_beyond_the_signal_is_its_end);
    RUN_TEST(test_events_take_one_slot_after_the_other_and_are_sent_so);
    RUN_TEST(test_the_first_frame_comes_in_the_eighth_tick_from_the_last_sample);
    RUN_TEST(test_a_slow_guard_takes_a_sample_every_tick);
    return UNITY_END();
}
