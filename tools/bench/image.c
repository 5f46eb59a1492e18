/* image: the firmware with one robot's table and without a board, to measure its size. */
#include "guard.h"

extern const guard_config_t board_config;

static guard_t guard;
static guard_output_t out;
static volatile can_frame_t mailbox;

int main(void) {
    (void)guard_init(&guard, &board_config);
    for (uint64_t now_us = 0; mailbox.id != 0u; now_us += board_config.period_us) {
        const can_frame_t frame = mailbox;
        guard_receive(&guard, &frame, now_us);
        if (guard_cycle_complete(&guard)) {
            guard_tick(&guard, now_us, &out);
            guard_note_tick_time(&guard, 1u);
        }
        guard_trip(&guard, GUARD_REASON_BUS_OFF);
        mailbox = out.frame[0];
    }
    return 0;
}
