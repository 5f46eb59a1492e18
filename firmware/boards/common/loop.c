#include "loop.h"

#include "board.h"
#include "guard.h"
#include "identity.h"
#include "log.h"

#ifdef TAUPERP_LOCKSTEP
#include "lockstep.h"
static lockstep_t lockstep;
#endif

#define WATCHDOG_TICKS 4u /* tick deadlines that may pass without a tick */

static guard_t guard;
static guard_output_t out;
static uint64_t due_us;

/* --- one tick ----------------------------------------------------------------------------------------------------- */

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

static void tick(uint64_t now_us) {
    static guard_output_t before;
    before = out;
    guard_tick(&guard, now_us, &out);
    if (out.permitted) {
        permission_toggle();
    } else {
        permission_withdraw();
    }
    (void)can_answer(out.frame, out.frame_count);
    log_state(&before);
    watchdog_serve();
}

/* A fault of the bus ends a permission; before the first one there is nothing to end. */
static void look_at_bus(void) {
    const uint32_t faults = can_faults();
    if ((faults == 0u) || ((out.state != GUARD_STATE_MONITORING) && (out.state != GUARD_STATE_STOPPED))) {
        return;
    }
    if ((faults & CAN_FAULT_OFF) != 0u) {
        guard_trip(&guard, GUARD_REASON_BUS_OFF);
    } else if ((faults & CAN_FAULT_OVERFLOW) != 0u) {
        guard_trip(&guard, GUARD_REASON_RX_OVERFLOW);
    } else {
        guard_trip(&guard, GUARD_REASON_BUS_DOWN);
    }
}

/* --- guard time is bus time --------------------------------------------------------------------------------------- */

#ifdef TAUPERP_LOCKSTEP

static void begin(void) {
    lockstep = (lockstep_t){.period_us = board_config.period_us};
}

static void take_frame(const can_frame_t *frame) {
    lockstep_hear(&lockstep, frame);
    while (lockstep_owes_tick(&lockstep)) {
        tick(lockstep.now_us);
    }
    guard_receive(&guard, frame, lockstep.now_us);
    if (guard_cycle_complete(&guard) && lockstep_complete(&lockstep)) {
        tick(lockstep.now_us);
    }
    due_us = clock_us() + LOCKSTEP_SILENCE_US;
}

static void look_at_clock(void) {
    const uint64_t now_us = clock_us();
    if (now_us >= due_us) {
        due_us = now_us + LOCKSTEP_SILENCE_US;
        if (lockstep_silence(&lockstep)) {
            tick(lockstep.now_us);
        }
    }
}

/* --- guard time is the board's ------------------------------------------------------------------------------------ */

#else

/* What a tick on a complete cycle leaves the next cycle to be late by. */
static uint32_t grace_us(void) {
    const uint32_t left = (board_config.tick_deadline_us - board_config.period_us) / 2u;
    const uint32_t half = board_config.period_us / 2u;
    return (left < half) ? left : half;
}

static void timed_tick(void) {
    const uint64_t begin_us = clock_us();
    tick(begin_us);
    const uint64_t took_us = clock_us() - begin_us;
    guard_note_tick_time(&guard, (took_us < UINT32_MAX) ? (uint32_t)took_us : UINT32_MAX);
    due_us = begin_us + board_config.period_us + (out.fresh ? grace_us() : 0u);
}

static void begin(void) {
    due_us = clock_us() + board_config.period_us;
}

static void take_frame(const can_frame_t *frame) {
    guard_receive(&guard, frame, clock_us());
    if (guard_cycle_complete(&guard)) {
        timed_tick();
    }
}

static void look_at_clock(void) {
    if (clock_us() >= due_us) {
        timed_tick();
    }
}

#endif

/* --- begin, go on ------------------------------------------------------------------------------------------------- */

_Noreturn void loop_run(void) {
    identity_log();
    const guard_status_t status = guard_init(&guard, &board_config);
    if (status != GUARD_OK) {
        log_text("configuration refused: ");
        log_number((uint32_t)status);
        log_text("\n");
    }
    log_flush();
    can_init((wire_format_t)board_config.format);
    watchdog_start(WATCHDOG_TICKS * board_config.tick_deadline_us);
    begin();
    log_text("on the bus\n");
    for (;;) {
        can_frame_t frame;
        if (can_receive(&frame)) {
            take_frame(&frame);
        }
        look_at_bus();
        look_at_clock();
        log_pump();
    }
}
