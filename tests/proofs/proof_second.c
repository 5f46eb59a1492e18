/* firmware/pair/second.c: the second channel's guard in the storage that the first channel sees. */
#define TAUPERP_SECOND 1

#include "guard_stub.h"
#include "second.c"

void proof_second_start(void) {
    tauperp_second_t second;
    guard_config_t block;
    (void)tauperp_second_start(&second, &block);
    HOLDS(state_of(&second)->out.withheld && !state_of(&second)->out.permitted, "nothing is permitted at the start");
    HOLDS(!guard_is_alone(&state_of(&second)->guard), "the second of two channels");
    REACHED;
}

void proof_second_tick(void) {
    tauperp_second_t second;
    tauperp_second_finding_t finding;
    opinion_t own, other;
    can_frame_t frame;
    uint64_t now_us;
    tauperp_second_look(&second, now_us, &finding, &own);
    const bool permits = tauperp_second_decide(&second, now_us, &finding, &own, &other);
    tauperp_second_confirm(&second, &frame);
    HOLDS(confirmed_as == permits, "the copy is that of this decision");
    REACHED;
}

void proof_second_calls(void) {
    tauperp_second_t second;
    can_frame_t frame;
    uint64_t now_us;
    uint32_t cause, restarts, variant, tick_us, reason;
    tauperp_second_note_start(&second, cause, restarts, variant);
    tauperp_second_receive(&second, &frame, now_us);
    (void)tauperp_second_complete(&second);
    tauperp_second_note_tick_time(&second, tick_us);
    tauperp_second_trip(&second, reason);
    REACHED;
}
