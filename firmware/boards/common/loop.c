#include "loop.h"

#include "board.h"
#include "event_log.h"
#include "identity.h"
#include "log.h"
#include "pair.h"
#include "restarts.h"
#include "schedule.h"

#define WATCHDOG_TICKS 4u /* tick deadlines without a tick until the watchdog resets */

static pair_t pair;
static guard_output_t out;
static schedule_t schedule;
static event_log_t events;
static bool recording; /* event recorder in use: real time only, with an accepted block */

static void log_state(const guard_output_t *before) {
    if ((out.state != before->state) || (out.trip_number != before->trip_number)) {
        log_text("state ");
        log_number((uint32_t)out.state);
        log_text(" reason ");
        log_number((uint32_t)out.reason);
        log_text(" joint ");
        log_number(out.joint);
        log_text(" cycle ");
        log_number(out.cycle);
        log_text("\n");
    }
}

/* Sends the guard's frames, and after them sometimes one of the event recorder. */
static void answer(void) {
    can_frame_t frames[GUARD_MAX_FRAMES + 1u];
    uint32_t count = out.frame_count;
    for (uint32_t i = 0; i < count; ++i) {
        frames[i] = out.frame[i];
    }
    if (recording) {
        event_log_note(&events, &out);
        count += event_log_frame(&events, &frames[count]) ? 1u : 0u;
    }
    (void)can_answer(frames, count);
}

static void tick(void) {
    static guard_output_t before;
    before = out;
    const uint64_t begin_us = clock_us();
    pair_tick(&pair, schedule_time(&schedule, begin_us), &out);
    if (out.permitted) {
        permission_toggle();
    } else {
        permission_withdraw();
    }
    answer();
    log_state(&before);
    watchdog_serve();
    schedule_ticked(&schedule, begin_us, out.fresh);
    if (!schedule.in_lockstep) { /* in lockstep a tick takes no time */
        const uint64_t took_us = clock_us() - begin_us;
        pair_note_tick_time(&pair, (took_us < UINT32_MAX) ? (uint32_t)took_us : UINT32_MAX);
    }
}

/* Passed on in every state, also before the first tick: the guard decides on the consequence. */
static void look_at_bus(void) {
    const uint32_t faults = can_faults();
    if ((faults & CAN_FAULT_OFF) != 0u) {
        pair_trip(&pair, GUARD_REASON_BUS_OFF);
    }
    if ((faults & CAN_FAULT_OVERFLOW) != 0u) {
        pair_trip(&pair, GUARD_REASON_RX_OVERFLOW);
    }
    if ((faults & CAN_FAULT_STUCK) != 0u) {
        pair_trip(&pair, GUARD_REASON_BUS_DOWN);
    }
}

static void take_frame(const can_frame_t *frame) {
    const uint64_t now_us = clock_us();
    schedule_hear(&schedule, frame, now_us);
    while (schedule_owes_tick(&schedule)) {
        tick();
    }
    pair_receive(&pair, frame, schedule_time(&schedule, now_us));
    if (schedule_complete(&schedule, pair_cycle_complete(&pair))) {
        tick();
    }
}

/* NULL: one channel. */
static const void *second_block(void) {
    const uintptr_t second = (uintptr_t)&board_config + sizeof(guard_config_t);
    const bool there = ((uintptr_t)board_config_end - second) == sizeof(guard_config_t);
    return there ? (const void *)second : 0;
}

static void start_guard(void) {
    const guard_status_t status = pair_init(&pair, &board_config, second_block());
    const bool accepted = status == GUARD_OK;
    if (accepted) {
        const guard_start_t cause = board_start_cause();
        const uint32_t restarts = restarts_note(cause);
        pair_note_start(&pair, cause, restarts, BOARD_VARIANT);
        log_text("start ");
        log_number((uint32_t)cause);
        log_text(" restarts ");
        log_number(restarts);
        log_text(guard_is_alone(&pair.guard) ? " one channel\n" : " two channels\n");
    } else {
        log_text("configuration refused: ");
        log_number((uint32_t)status);
        log_text("\n");
    }
    log_flush();
    /* Nothing of a refused block is used, not even its format and times. */
    can_init(accepted ? (wire_format_t)board_config.format : FORMAT_CLASSIC);
    schedule_init(&schedule, accepted ? &board_config : 0, BOARD_VARIANT == GUARD_VARIANT_LOCKSTEP, clock_us());
    recording = accepted && !schedule.in_lockstep;
    if (recording) {
        event_log_init(&events, &board_config);
    }
    watchdog_start(WATCHDOG_TICKS * schedule.tick_deadline_us);
}

_Noreturn void loop_run(void) {
    identity_log();
    start_guard();
    log_text("on the bus\n");
    for (;;) {
        can_frame_t frame;
        if (can_receive(&frame)) {
            take_frame(&frame);
        }
        look_at_bus();
        if (schedule_is_due(&schedule, clock_us())) {
            tick();
        }
        log_pump();
    }
}
