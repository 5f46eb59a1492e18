/* Every stage that does not run in a tick is detected. This program contains its own guard, in which each stage can
 * become an empty function, before and after the self-test. */
#include <stdbool.h>

#include "detector.h"
#include "explained.h"
#include "sight.h"

static unsigned dead; /* number of the stage that does nothing; 0: all run */
static bool lost;     /* the projection does not converge */

#define RUN(number, stage, ...)                                                                                        \
    do {                                                                                                               \
        if (dead != (number)) {                                                                                        \
            (stage)(__VA_ARGS__);                                                                                      \
        }                                                                                                              \
    } while (false)
#define motion_step(...)       RUN(1u, motion_step, __VA_ARGS__)
#define observer_step(...)     RUN(2u, observer_step, __VA_ARGS__)
#define acceleration_step(...) RUN(3u, acceleration_step, __VA_ARGS__)
#define index_step(self, ...)                                                                                          \
    do {                                                                                                               \
        RUN(4u, index_step, self, __VA_ARGS__);                                                                        \
        (self)->converged = (self)->converged && !lost;                                                                \
    } while (false)
#define regressor_step(...) RUN(8u, regressor_step, __VA_ARGS__)
#define explained_step(...) RUN(5u, explained_step, __VA_ARGS__)
#define bank_step(...)      RUN(6u, bank_step, __VA_ARGS__)
#define detector_step(...)  RUN(7u, detector_step, __VA_ARGS__)
#define sight_step(...)     RUN(9u, sight_step, __VA_ARGS__)
#define STAGES              9u

#define stages_init          dying_stages_init
#define stages_run           dying_stages_run
#define stages_step          dying_stages_step
#define stages_complete      dying_stages_complete
#define stages_valid         dying_stages_valid
#define stages_saturated     dying_stages_saturated
#define self_test_step       dying_self_test_step
#define guard_init           dying_guard_init
#define guard_tick           dying_guard_tick
#define guard_trip           dying_guard_trip
#define guard_look           dying_guard_look
#define guard_decide         dying_guard_decide
#define guard_refuse         dying_guard_refuse
#define guard_say            dying_guard_say
#define guard_note_start     dying_guard_note_start
#define guard_note_tick_time dying_guard_note_tick_time
#include "../../firmware/guard/guard_stages.c"

#define is_near self_test_is_near
#define rest    self_test_rest
#include "../../firmware/guard/guard_self_test.c"
#undef is_near
#undef rest

#include "../../firmware/guard/guard.c"

#undef motion_step
#include "guard_fixture.h"

static bench_t bench;

void setUp(void) {
    dead = 0;
    lost = false;
    start(&bench);
}
void tearDown(void) {}

static void test_a_stage_that_stops_running_is_a_fault_at_once(void) {
    for (unsigned stage = 1u; stage <= STAGES; ++stage) {
        setUp();
        run_until_permitted(&bench);
        dead = stage;
        cycle(&bench);
        assert_fault(&bench, GUARD_REASON_STAGE_MISSED);
        dead = 0;
        cycles(&bench, 2u * SETTLING_CYCLES);
        ask_reset(&bench, bench.out.trip_number);
        assert_fault(&bench, GUARD_REASON_STAGE_MISSED);
    }
}

/* From the start, with a collision on the arm: a guard that continued would not detect it. */
static void test_a_stage_that_never_ran_is_detected_by_the_self_test_or_the_first_tick(void) {
    for (unsigned stage = 1u; stage <= STAGES; ++stage) {
        setUp();
        dead = stage;
        cycles(&bench, 600u); /* the longest self-test */
        TEST_ASSERT_EQUAL(GUARD_STATE_FAULT, bench.out.state);
        TEST_ASSERT_TRUE((bench.out.reason == GUARD_REASON_SELF_TEST_FAILED) ||
                         (bench.out.reason == GUARD_REASON_STAGE_MISSED));
    }
}

static void test_a_projection_that_does_not_converge_is_a_fault_at_once(void) {
    run_until_permitted(&bench);
    lost = true;
    cycle(&bench);
    assert_fault(&bench, GUARD_REASON_STATE_CORRUPT);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_projection_that_does_not_converge_is_a_fault_at_once);
    RUN_TEST(test_a_stage_that_stops_running_is_a_fault_at_once);
    RUN_TEST(test_a_stage_that_never_ran_is_detected_by_the_self_test_or_the_first_tick);
    return UNITY_END();
}
