/* A guard of an arm with eight joints: every loop over joints ends at the last one that the wire can carry. */
#include "guard_fixture.h"
#include "guard_parts.h"

static bench_t bench;

void setUp(void) {
    const guard_config_t config = make_config_of_eight();
    start_with(&bench, &config);
}
void tearDown(void) {}

static void test_it_permits_and_sends_every_joint_in_turn(void) {
    run_until_permitted(&bench);
    uint32_t joints = 0;
    for (uint32_t i = 0; i < 2u * ROBOT_MAX_JOINTS; ++i) {
        cycle(&bench);
        if (bench.out.frame[1].id == protocol_transmit[PROTOCOL_TRANSMIT_GUARD_INDEX].id) {
            joints |= 1u << (bench.out.frame[1].data[1] >> 4);
        }
    }
    TEST_ASSERT_EQUAL_HEX32(0xFFu, joints);
}

static void test_a_collision_on_the_last_joint_is_told_with_its_numbers(void) {
    run_until_permitted(&bench);
    push(&bench, 7u, 1000);
    run_until(&bench, GUARD_REASON_COLLISION);
    assert_stopped(&bench, GUARD_REASON_COLLISION, 8u);
    TEST_ASSERT_TRUE(bench.out.index[7] == bench.guard.detector.value_nm[7]);
    TEST_ASSERT_TRUE(num_abs(bench.out.index[7]) > NUM(2));
    TEST_ASSERT_TRUE(bench.out.residual[7] == bench.guard.observer.residual[7]);
    TEST_ASSERT_TRUE(bench.out.threshold[7] == NUM(2));
}

static void test_a_slow_contact_on_the_last_joint_is_a_touch(void) {
    bench.guard.contact.rising[7] = 1000;
    contact_note_trip(&bench.guard, &(guard_event_t){.reason = GUARD_REASON_COLLISION, .joint = 8u});
    TEST_ASSERT_TRUE(bench.guard.contact.slow);
    contact_note_trip(&bench.guard, &(guard_event_t){.reason = GUARD_REASON_COLLISION, .joint = 1u});
    TEST_ASSERT_FALSE(bench.guard.contact.slow);
}

static void test_an_opinion_has_the_last_joint(void) {
    guard_finding_t finding = {.wish = WISH_GO_ON};
    opinion_t opinion;
    run_until_permitted(&bench);
    push(&bench, 7u, 100);
    cycles(&bench, 20u);
    guard_tell(&bench.guard, &finding, &opinion);
    TEST_ASSERT_EQUAL(ROBOT_MAX_JOINTS, opinion.joints);
    TEST_ASSERT_TRUE((opinion.residual[7] > 100000) || (opinion.residual[7] < -100000)); /* micronewton metres */
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_it_permits_and_sends_every_joint_in_turn);
    RUN_TEST(test_a_collision_on_the_last_joint_is_told_with_its_numbers);
    RUN_TEST(test_a_slow_contact_on_the_last_joint_is_a_touch);
    RUN_TEST(test_an_opinion_has_the_last_joint);
    return UNITY_END();
}
