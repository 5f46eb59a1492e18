/* guard: the instructions of a whole cycle (frames in, tick, answers out), its stack use, and its memory.
 *
 * Each random state starts a guard that permits motion. The arm then moves for CYCLES cycles with the torque of this
 * motion, so that the guard permits it, as in most ticks. MEASURED cycles are counted. In the others, among them the
 * first and the last, the stack is painted and inspected. Tasks alternate.
 */
#include "guard.h"

#include "cycle.h"
#include "motion.h"
#include "report.h"

#define STATES   10000u
#define CYCLES   5u
#define SETTLING 2u /* cycles before those that are counted */
#define MEASURED 2u
#define SEED     20240301u
#define PAINTED  4096u /* bytes */
#define PAINT    0xA5A5A5A5u

extern const guard_config_t board_config;

static guard_config_t config;
static guard_t fresh; /* after guard_init, which is slow and not counted */
static guard_t guard;
static guard_output_t out;
static cycle_frames_t frames;
static motion_t before, now;

/* Readings of the joints' sensors while the arm moves from `before` to `now` without a contact. */
static void undisturbed_torque(bench_state_t *state, bool first) {
    uint32_t saturations = 0;
    const num_t rate = num_from_int((int32_t)(1000000u / config.period_us / 10u));
    before = now;
    motion_step(&now, &config.robot, state->position, state->velocity);
    for (uint32_t i = 0; i < config.robot.joint_count; ++i) {
        const num_t limit = config.robot.joint[i].torque_max_nm;
        const num_t change = first ? NUM(0) : (now.momentum[i] - before.momentum[i]);
        const num_t force = num_mul(num_mul(change, rate, &saturations), NUM(10), &saturations);
        const num_t torque = force - now.coriolis[i] + now.gravity[i];
        state->torque[i] = num_max(-limit, num_min(limit, torque));
    }
}

typedef struct {
    tally_t total, receive, tick;
    uint32_t permitted, deficient;
} result_t;

static void run_cycle(uint64_t now_us, uint32_t columns, result_t *result) {
    stretch_begin();
    for (uint32_t i = 0; i < frames.count; ++i) {
        guard_receive(&guard, &frames.frame[i], now_us);
    }
    const uint32_t receive = stretch_end();
    guard_tick(&guard, now_us, &out);
    const uint32_t tick = stretch_end();
    guard_note_tick_time(&guard, 1u);
    tally_add(&result->receive, receive);
    tally_add(&result->tick, tick);
    tally_add(&result->total, receive + tick);
    result->permitted += out.permitted ? 1u : 0u;
    result->deficient += (out.rank < columns) ? 1u : 0u;
}

/* As after the self-test, the settling time and the first reset. */
static void make_ready(void) {
    guard.state = (uint32_t)GUARD_STATE_MONITORING;
    guard.state_inverted = ~guard.state;
    guard.acknowledged = (uint8_t)GUARD_SET;
    guard.settled_cycles = UINT32_MAX / 2u;
}

/* Bytes of stack below this function that the guard writes to in one cycle, found by painting them first. */
__attribute__((noinline)) static uint32_t touched_stack(uint64_t now_us, bool start) {
    volatile uint32_t *top;
#ifdef __x86_64__
    __asm volatile("mov %%rsp, %0" : "=r"(top));
#else
    __asm volatile("mov %0, sp" : "=r"(top));
#endif
    for (uint32_t i = 1; i <= PAINTED / 4u; ++i) {
        *(top - i) = PAINT;
    }
    if (start) {
        guard = fresh;
        make_ready();
    }
    for (uint32_t i = 0; i < frames.count; ++i) {
        guard_receive(&guard, &frames.frame[i], now_us);
    }
    guard_tick(&guard, now_us, &out);
    guard_note_tick_time(&guard, 1u);
    uint32_t deepest = 0;
    for (uint32_t i = 1; i <= PAINTED / 4u; ++i) {
        deepest = (*(top - i) != PAINT) ? i : deepest;
    }
    return deepest * 4u;
}

static void count_guard(void) {
    result_t result = {{0}, {0}, {0}, 0, 0};
    random_t random = {SEED};
    bench_state_t state = {0};
    motion_init(&now);
    uint32_t stack = 0;
    for (uint32_t i = 0; i < STATES / MEASURED; ++i) {
        const uint32_t chosen = ((i % 2u) == 0u) ? TASK_PAYLOAD : TASK_CONTACT;
        states_jump(&state, &config, &random);
        for (uint32_t cycle = 0; cycle < CYCLES; ++cycle) {
            const uint64_t now_us = (uint64_t)cycle * config.period_us;
            undisturbed_torque(&state, cycle == 0u);
            cycle_encode(&frames, &config, &state, chosen, (uint16_t)cycle);
            if (cycle == SETTLING) {
                make_ready();
            }
            if ((cycle >= SETTLING) && (cycle < (SETTLING + MEASURED))) {
                run_cycle(now_us, (chosen == TASK_PAYLOAD) ? 5u : 6u, &result);
            } else {
                const uint32_t touched = touched_stack(now_us, cycle == 0u);
                stack = (touched > stack) ? touched : stack;
            }
            states_advance(&state, &config, &random);
        }
    }
    report_tally("guard_tick", "total", &result.total);
    report_tally("guard_tick", "receive", &result.receive);
    report_tally("guard_tick", "tick", &result.tick);
    report_deficient("guard_tick", result.deficient);
    report_size("permitted_ticks", result.permitted);
    report_size("painted_stack_bytes", stack);
}

int main(void) {
    config = board_config;
    (void)guard_init(&fresh, &config);
    guard_note_start(&fresh, GUARD_START_POWER_ON, 0u, GUARD_VARIANT_PRODUCT);
    stretch_init();
    report_size("guard_bytes", sizeof(guard_t));
    count_guard();
    return 0;
}
