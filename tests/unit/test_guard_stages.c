/* The guard looks after each tick whether the stages that ran are those that were due. No input makes them differ, so
 * this program holds a guard of its own in which a bit flips between two stages. */
#include <stdbool.h>

#include "index.h"

static bool flip;

/* `self` is the guard of stages_run: the task that was due is not the task any more. */
#define index_step(...)                                                                                                \
    do {                                                                                                               \
        (index_step)(__VA_ARGS__);                                                                                     \
        self->inputs.task_number = flip ? (uint8_t)TASK_INVALID : self->inputs.task_number;                            \
    } while (false)
#define stages_run           flipping_stages_run
#define stages_complete      flipping_stages_complete
#define stages_valid         flipping_stages_valid
#define stages_saturated     flipping_stages_saturated
#define guard_init           flipping_guard_init
#define guard_tick           flipping_guard_tick
#define guard_trip           flipping_guard_trip
#define guard_note_tick_time flipping_guard_note_tick_time
#include "../../firmware/guard/guard_stages.c"

#include "../../firmware/guard/guard.c"

#include "guard_fixture.h"

static bench_t bench;

void setUp(void) {
    flip = false;
    start(&bench);
}
void tearDown(void) {}

static void test_stages_that_were_not_due_are_a_fault(void) {
    run_until_permitted(&bench);
    flip = true;
    cycle(&bench);
    assert_fault(&bench, GUARD_REASON_STAGE_MISSED);
    flip = false;
    cycles(&bench, 50u);
    ask_reset(&bench, bench.out.trip_number);
    assert_fault(&bench, GUARD_REASON_STAGE_MISSED);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_stages_that_were_not_due_are_a_fault);
    return UNITY_END();
}
