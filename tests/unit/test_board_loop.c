/* The boards' loop (firmware/boards/common/loop.c) with a model of a board: its time, bus, permission pin and watchdog.
 * The robot on its bus sends the frames of a cycle in every period, as the guard's fixture makes them. */
#include <setjmp.h>

#define tick board_tick /* the fixture has a function of this name, too */
#include "../../firmware/boards/common/loop.c"
#include "../../firmware/boards/common/restarts.c"
#undef tick

#include "guard_fixture.h"

#define POLL_US 7u /* duration of one round of the loop */
#define FRAMES  (JOINTS + 3u)
#define START   220u /* most cycles to the first permission: self-test, settling, health, a reset */

typedef enum { HANG_NOWHERE, HANG_RECEIVING, HANG_ANSWERING, HANG_LOOKING_FOR_FAULTS } hang_t;

static struct {
    uint64_t now_us, end_us;
    uint64_t silent_from_us; /* the robot is silent from then on */
    uint64_t hang_from_us;
    hang_t hang;
    uint32_t fault, told; /* CAN_FAULT_..., and how often it was reported */
    uint64_t fault_us[2];
    uint32_t answer_us; /* duration of sending */
    bool flood;         /* another frame is always waiting */
    bench_t robot;
    uint64_t cycle_us; /* begin of the robot's cycle */
    uint32_t sent;     /* frames of it that were received */
    uint32_t answers, permitted, toggles, withdrawals, served, inits;
    uint32_t watchdog_us;
    wire_format_t format;
    uint64_t served_us, longest_us; /* last service, longest time between two */
    uint64_t answered_us;
} board;

static guard_config_t storage;
__asm__(".globl board_config\n.set board_config, storage\n.globl board_config_end\n.set board_config_end, storage");
static guard_start_t start_cause;
static jmp_buf out_of_loop;

static void pass(uint64_t us) {
    board.now_us += us;
    if (board.now_us >= board.end_us) {
        longjmp(out_of_loop, 1);
    }
}

static void hang_at(hang_t place) {
    while ((board.hang == place) && (board.now_us >= board.hang_from_us)) {
        pass(POLL_US);
    }
}

uint64_t clock_us(void) {
    return board.now_us;
}

guard_start_t board_start_cause(void) {
    return start_cause;
}

void can_init(wire_format_t format) {
    board.format = format;
    ++board.inits;
}

bool can_receive(can_frame_t *frame) {
    pass(POLL_US);
    hang_at(HANG_RECEIVING);
    if (board.now_us >= (board.cycle_us + storage.period_us)) {
        board.cycle_us += storage.period_us;
        board.sent = 0;
        next_cycle(&board.robot);
    }
    if ((board.sent < FRAMES) && (board.now_us < board.silent_from_us)) {
        /* While the permission is missing the robot requests it, with an edge in every other cycle. */
        *frame = (board.sent == 0u)   ? sync_frame(&board.robot)
                 : (board.sent == 1u) ? task_frame(&board.robot)
                 : (board.sent < (FRAMES - 1u))
                     ? joint_frame(&board.robot, board.sent - 2u)
                     : reset_frame(&board.robot, out.trip_number, !out.permitted && ((board.robot.cycle % 2u) != 0u));
        ++board.sent;
        return true;
    }
    *frame = (can_frame_t){.id = 0x7FFu};
    return board.flood;
}

bool can_answer(const can_frame_t frames[], uint32_t count) {
    hang_at(HANG_ANSWERING);
    pass(board.answer_us);
    TEST_ASSERT_TRUE((count == GUARD_MAX_FRAMES) ||
                     ((count == GUARD_MAX_FRAMES + 1u) &&
                      (frames[GUARD_MAX_FRAMES].id == protocol_transmit[PROTOCOL_TRANSMIT_GUARD_EVENT].id)));
    TEST_ASSERT_EQUAL_HEX32(TAUPERP_STOP_COMMAND_FRAME_ID, frames[0].id);
    ++board.answers;
    board.permitted += out.permitted ? 1u : 0u;
    TEST_ASSERT_EQUAL(board.permitted, board.toggles); /* exactly one edge per permission */
    TEST_ASSERT_EQUAL(board.answers - board.permitted, board.withdrawals);
    board.answered_us = board.now_us;
    return true;
}

uint32_t can_faults(void) {
    hang_at(HANG_LOOKING_FOR_FAULTS);
    if ((board.told == 2u) || (board.now_us < board.fault_us[board.told])) {
        return 0;
    }
    ++board.told;
    return board.fault;
}

void permission_toggle(void) {
    ++board.toggles;
}

void permission_withdraw(void) {
    ++board.withdrawals;
}

void watchdog_start(uint32_t timeout_us) {
    board.watchdog_us = timeout_us;
    board.served_us = board.now_us;
}

void watchdog_serve(void) {
    TEST_ASSERT_EQUAL(board.answers,
                      board.served + 1u); /* every answer serves the watchdog once, and nothing else does */
    ++board.served;
    const uint64_t since_us = board.now_us - board.served_us;
    board.longest_us = (since_us > board.longest_us) ? since_us : board.longest_us;
    board.served_us = board.now_us;
}

void log_text(const char *text) {
    (void)text;
}
void log_number(uint32_t number) {
    (void)number;
}
void log_pump(void) {}
void log_flush(void) {}
void identity_log(void) {}

void setUp(void) {
    memset(&board, 0, sizeof(board));
    memset(&out, 0, sizeof(out));
    storage = make_config();
    start_with(&board.robot, &storage);
    board.now_us = 5000000u;
    board.cycle_us = board.now_us;
    board.silent_from_us = UINT64_MAX;
    start_cause = GUARD_START_POWER_ON;
}

void tearDown(void) {}

static void run(uint32_t periods) {
    board.end_us = board.now_us + (uint64_t)periods * PERIOD_US;
    if (setjmp(out_of_loop) == 0) {
        loop_run();
    }
}

static void test_a_healthy_robot_is_permitted_and_every_permission_is_an_edge(void) {
    run(START + 100u);
    TEST_ASSERT_UINT32_WITHIN(3u, START + 100u, board.answers);
    TEST_ASSERT_TRUE(board.permitted >= 100u);
    TEST_ASSERT_EQUAL(board.answers, board.served);
    TEST_ASSERT_TRUE(board.longest_us < board.watchdog_us);
    TEST_ASSERT_EQUAL(1, board.inits);
}

static void test_the_tick_follows_at_once_when_the_cycle_is_complete(void) {
    run(100u);
    const uint64_t after_us = board.answered_us - board.cycle_us;
    TEST_ASSERT_TRUE(after_us <= (FRAMES + 1u) * POLL_US);
}

static void test_silence_ends_the_permission_but_not_the_ticks(void) {
    board.silent_from_us = board.now_us + START * PERIOD_US;
    run(START + 100u);
    TEST_ASSERT_EQUAL(GUARD_REASON_SYNC_TIMEOUT, out.reason);
    TEST_ASSERT_TRUE(board.permitted > 0u);
    TEST_ASSERT_FALSE(out.permitted);
    TEST_ASSERT_UINT32_WITHIN(5u, START + 100u, board.answers);
    TEST_ASSERT_TRUE(board.longest_us < board.watchdog_us);
}

/* At any place where the loop hangs: no edge, no service, and the watchdog expires. */
static void test_a_hung_loop_does_not_serve_the_watchdog(void) {
    for (hang_t place = HANG_RECEIVING; place <= HANG_LOOKING_FOR_FAULTS; ++place) {
        setUp();
        board.hang = place;
        board.hang_from_us = board.now_us + 100u * PERIOD_US;
        run(150u);
        TEST_ASSERT_TRUE(board.served > 90u);
        TEST_ASSERT_TRUE(board.served_us <= board.hang_from_us + PERIOD_US);
        TEST_ASSERT_TRUE((board.now_us - board.served_us) > board.watchdog_us);
    }
}

static void test_a_flood_of_frames_does_not_delay_the_tick(void) {
    board.flood = true;
    board.silent_from_us = board.now_us + START * PERIOD_US;
    run(START + 100u);
    TEST_ASSERT_UINT32_WITHIN(5u, START + 100u, board.answers);
    TEST_ASSERT_EQUAL(GUARD_REASON_SYNC_TIMEOUT, out.reason);
}

static void test_a_tick_that_takes_too_long_by_the_boards_clock_is_a_fault(void) {
    board.answer_us = storage.tick_budget_us;
    run(START);
    TEST_ASSERT_TRUE(board.permitted > 0u);
    setUp();
    board.answer_us = storage.tick_budget_us + 1u;
    run(100u);
    TEST_ASSERT_EQUAL(0, board.permitted);
    TEST_ASSERT_EQUAL(GUARD_REASON_TICK_OVER_BUDGET, out.reason);
    TEST_ASSERT_EQUAL(GUARD_STATE_FAULT, out.state);
    TEST_ASSERT_UINT32_WITHIN(4u, 100u, board.answers); /* one per cycle, although no tick evaluates the snapshot */
}

/* Before the first tick, where it must not be forgotten, and during a permission. */
static void assert_fault_ends_permission(uint32_t fault, guard_reason_t reason) {
    setUp();
    board.fault = fault;
    board.fault_us[0] = board.now_us;
    board.fault_us[1] = UINT64_MAX;
    run(50u);
    TEST_ASSERT_EQUAL(GUARD_STATE_STOPPED, out.state);
    TEST_ASSERT_EQUAL(reason, out.reason);
    TEST_ASSERT_EQUAL(1, out.trip_number);

    setUp();
    board.fault = fault;
    board.fault_us[0] = board.now_us + START * PERIOD_US;
    board.fault_us[1] = UINT64_MAX;
    run(START + 2u);
    TEST_ASSERT_TRUE(board.permitted > 0u);
    TEST_ASSERT_EQUAL(GUARD_STATE_STOPPED, out.state);
    TEST_ASSERT_EQUAL(reason, out.reason);
    TEST_ASSERT_EQUAL(1, out.trip_number);
}

static void test_a_fault_of_the_bus_ends_a_permission(void) {
    assert_fault_ends_permission(CAN_FAULT_OFF, GUARD_REASON_BUS_OFF);
    assert_fault_ends_permission(CAN_FAULT_OVERFLOW, GUARD_REASON_RX_OVERFLOW);
    assert_fault_ends_permission(CAN_FAULT_STUCK, GUARD_REASON_BUS_DOWN);
}

/* Its period would be the longest possible, and its format one that no bus has. */
static void test_no_value_of_a_refused_configuration_is_used(void) {
    storage.period_us = UINT32_MAX;
    storage.tick_deadline_us = UINT32_MAX;
    storage.format = 77u;
    run(100u);
    TEST_ASSERT_TRUE(board.answers >= (100u * PERIOD_US) / SCHEDULE_REFUSED_PERIOD_US - 1u);
    TEST_ASSERT_EQUAL(WATCHDOG_TICKS * SCHEDULE_REFUSED_DEADLINE_US, board.watchdog_us);
    TEST_ASSERT_EQUAL(FORMAT_CLASSIC, board.format);
    TEST_ASSERT_EQUAL(0, board.permitted);
    TEST_ASSERT_EQUAL(GUARD_STATE_UNINITIALISED, out.state);
}

/* In RAM that a power-on leaves undefined. */
static void start_after(guard_start_t cause) {
    setUp();
    start_cause = cause;
    run(START);
}

static void test_unexpected_restarts_are_counted_up_to_the_limit(void) {
    static const guard_start_t unexpected[] = {GUARD_START_WATCHDOG, GUARD_START_EXCEPTION, GUARD_START_UNKNOWN};
    start_after(GUARD_START_POWER_ON);
    TEST_ASSERT_TRUE(out.permitted);
    for (uint32_t i = 0; i < GUARD_MAX_RESTARTS; ++i) {
        start_after(unexpected[i % 3u]);
        TEST_ASSERT_EQUAL(i + 1u, pair.guard.restarts);
        TEST_ASSERT_EQUAL(unexpected[i % 3u], pair.guard.start_cause);
        TEST_ASSERT_TRUE(out.permitted); /* after its reset */
    }
    for (uint32_t i = 0; i < 300u; ++i) { /* the count must not wrap */
        start_cause = GUARD_START_WATCHDOG;
        (void)restarts_note(start_cause);
    }
    start_after(GUARD_START_WATCHDOG);
    TEST_ASSERT_EQUAL(GUARD_STATE_FAULT, out.state);
    TEST_ASSERT_EQUAL(GUARD_REASON_RESTART_LIMIT, out.reason);
    start_after(GUARD_START_COMMANDED);
    TEST_ASSERT_EQUAL(0, pair.guard.restarts);
    TEST_ASSERT_TRUE(out.permitted);
}

static void test_an_invalid_record_of_restarts_leaves_one_more_restart(void) {
    memset(&record, 0xA5, sizeof(record));
    TEST_ASSERT_FALSE(restarts_recorded());
    TEST_ASSERT_EQUAL(GUARD_MAX_RESTARTS, restarts_note(GUARD_START_WATCHDOG));
    TEST_ASSERT_EQUAL(GUARD_MAX_RESTARTS + 1u, restarts_note(GUARD_START_WATCHDOG));
    TEST_ASSERT_EQUAL(0, restarts_note(GUARD_START_POWER_ON));
    record.count ^= 1u;
    TEST_ASSERT_FALSE(restarts_recorded());
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_healthy_robot_is_permitted_and_every_permission_is_an_edge);
    RUN_TEST(test_the_tick_follows_at_once_when_the_cycle_is_complete);
    RUN_TEST(test_silence_ends_the_permission_but_not_the_ticks);
    RUN_TEST(test_a_hung_loop_does_not_serve_the_watchdog);
    RUN_TEST(test_a_flood_of_frames_does_not_delay_the_tick);
    RUN_TEST(test_a_tick_that_takes_too_long_by_the_boards_clock_is_a_fault);
    RUN_TEST(test_a_fault_of_the_bus_ends_a_permission);
    RUN_TEST(test_no_value_of_a_refused_configuration_is_used);
    RUN_TEST(test_unexpected_restarts_are_counted_up_to_the_limit);
    RUN_TEST(test_an_invalid_record_of_restarts_leaves_one_more_restart);
    return UNITY_END();
}
