/* faults: flips bits in a guard's state and block, and disturbs its clock and ticks, while it receives a recorded run.
 *
 *     faults RECORDING SEED FIRST COUNT [PART...]
 *
 * PART: `state` (as without one: with `table`), `table`, `time`, or a name of parts.c, with `second.` before it for the
 * second channel's; `unwatched`: the first channel's table, without the check that detects it, as a test of this
 * program.
 *
 * RECORDING (tools/faults/record.py): one or two blocks, then one cycle after the other: its time and its frames. The
 * run without a fault comes first; it is the reference. Fault number i is drawn from SEED and i alone. Each fault
 * starts from the reference's own state at its cycle, and runs until nothing differs any more that a permission rests
 * on, or the flipped bit alone differs for 10 cycles and the reference's permission stays as it is, or 420 cycles are
 * over. The judge of each answer is the robot's side (firmware/robot_side): what counts is whether the robot may move.
 *
 *   none       the robot may move in the same cycles
 *   detected   it may not although it might, or FAULT: a self-check, an exception, or an answer that no robot takes
 *   needless   it may not although it might: a stop for another reason
 *   late       it may move beyond the reference's stop, for no longer than the reaction time of the block
 *   wrong      it may move in a cycle, and the reference permitted neither in it nor within the reaction time before
 *
 * The worst outcome of a fault counts. Prints: reaction CYCLES; reference CYCLES STOPS; then a line for each part,
 * moment and outcome that came up: `count PART MOMENT OUTCOME FAULTS SUM WORST`, SUM and WORST of the cycles from the
 * fault to the reaction; then `wrong PART BYTE BIT CYCLE` for the first ones.
 */
#include <inttypes.h>
#include <setjmp.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/time.h>

#include "draw.h"

enum { DORMANT = 10, TOLD = 200, HANG_MS = 500 };
typedef enum { NONE, DETECTED, NEEDLESS, LATE, WRONG, OUTCOMES } outcome_t;
static const char *const outcome_name[OUTCOMES] = {"none", "detected", "needless", "late", "wrong"};
static const char *const moment_name[MOMENTS] = {"before-stop", "after-stop", "anywhere"};

typedef struct {
    uint64_t faults, sum, worst;
} tally_t;

static reference_t reference;
static tally_t tally[PARTS_MAX][MOMENTS][OUTCOMES];
static sigjmp_buf crashed;

/* Not permitted in this cycle nor in any of the reaction time before it. */
static bool long_stopped(uint32_t at) {
    for (uint32_t back = 0; (back <= reference.reaction) && (back <= at); ++back) {
        if (reference.answer[at - back].permits) {
            return false;
        }
    }
    return true;
}

/* Nothing differs that a permission rests on. The world becomes the reference where it is only counted. With a fault:
 * or its flipped bit alone does, which nothing has read or written. */
static bool is_same(world_t *world, const world_t *other, const fault_t *dormant) {
    machine_moved(&world->machine, &other->machine);
    machine_take_counts(&world->machine, &other->machine);
    bool same = memcmp(world, other, sizeof(*world)) == 0;
    if (!same && (dormant != NULL)) {
        uint8_t *const byte = (uint8_t *)&world->machine + machine_part[dormant->part].offset + dormant->byte;
        *byte ^= (uint8_t)(1u << dormant->bit);
        same = memcmp(world, other, sizeof(*world)) == 0;
        *byte ^= (uint8_t)(1u << dormant->bit);
    }
    machine_moved(&world->machine, &world->machine);
    return same;
}

static outcome_t judge(const fault_t *fault, uint32_t *after) {
    static world_t world;
    volatile outcome_t worst = NONE;
    volatile uint32_t at = fault->cycle;
    memcpy(&world, &reference.before[fault->cycle], sizeof(world));
    machine_moved(&world.machine, &world.machine);
    if (sigsetjmp(crashed, 1) != 0) { /* on a board: an exception, or the watchdog */
        *after = at - fault->cycle;
        return (worst > DETECTED) ? worst : DETECTED;
    }
    const uint32_t end = fault->cycle + (uint32_t)HORIZON;
    *after = 0;
    for (; at < end; ++at) {
        const answer_t answer = reference_cycle(&reference, &world, at, fault);
        outcome_t outcome = NONE;
        if (answer.permits && !reference.answer[at].permits) {
            outcome = long_stopped(at) ? WRONG : LATE;
        } else if (answer.in_fault && !reference.answer[at].in_fault) {
            outcome = DETECTED;
        } else if (!answer.permits && reference.answer[at].permits) {
            /* The robot refuses the answer, or receives none: the fault is detected there. */
            outcome = (world.machine.pair.guard.state == (uint32_t)GUARD_STATE_MONITORING) ? DETECTED : NEEDLESS;
        } else {
            /* the same */
        }
        if ((outcome != NONE) && ((worst == NONE) || (outcome >= LATE))) {
            *after = at - fault->cycle;
        }
        worst = (outcome > worst) ? outcome : worst;
        if ((worst == WRONG) || answer.in_fault) { /* FAULT lasts until the guard is started again */
            break;
        }
        const bool over_soon = (at >= (fault->cycle + (uint32_t)DORMANT)) && ((at + reference.quiet[at]) >= end);
        if ((fault->part < machine_parts) && ((at + 1u) < reference.cycle_count) &&
            is_same(&world, &reference.before[at + 1u], over_soon ? fault : NULL)) {
            break;
        }
    }
    return worst;
}

static void on_signal(int number) {
    (void)number;
    siglongjmp(crashed, 1);
}

static void catch_crashes(void) {
    static uint8_t stack[65536];
    const stack_t other = {.ss_sp = stack, .ss_size = sizeof(stack)};
    struct sigaction action = {.sa_handler = on_signal, .sa_flags = SA_ONSTACK};
    (void)sigaltstack(&other, NULL);
    (void)sigaction(SIGSEGV, &action, NULL);
    (void)sigaction(SIGBUS, &action, NULL);
    (void)sigaction(SIGFPE, &action, NULL);
    (void)sigaction(SIGVTALRM, &action, NULL);
}

static void set_alarm(uint32_t ms) {
    const struct itimerval timer = {.it_value = {.tv_sec = (time_t)(ms / 1000u)}};
    (void)setitimer(ITIMER_VIRTUAL, &timer, NULL);
}

int main(int argc, char **argv) {
    if (argc < 5) {
        give_up("faults RECORDING SEED FIRST COUNT [PART...]");
    }
    const uint64_t seed = strtoull(argv[2], NULL, 10);
    const uint64_t first = strtoull(argv[3], NULL, 10);
    const uint64_t count = strtoull(argv[4], NULL, 10);
    reference_run(&reference, argv[1]);
    const selection_t chosen = select_parts(argc - 5, argv + 5);
    if (chosen.count == 0u) {
        give_up("there is no such part");
    }
    (void)printf("reaction %" PRIu32 "\nreference %" PRIu32 " %" PRIu32 "\n", reference.reaction, reference.cycle_count,
                 reference.stops);
    catch_crashes();
    uint32_t told = 0;
    for (uint64_t number = first; number < (first + count); ++number) {
        const fault_t fault = draw_fault(&reference, &chosen, seed, number);
        uint32_t after = 0;
        if ((number % 64u) == 0u) {
            set_alarm(64u * HANG_MS);
        }
        const outcome_t outcome = judge(&fault, &after);
        tally_t *const to = &tally[fault.part][fault.moment][outcome];
        to->faults++;
        to->sum += after;
        to->worst = (after > to->worst) ? after : to->worst;
        if ((outcome == WRONG) && (told < (uint32_t)TOLD)) {
            ++told;
            (void)printf("wrong %s %" PRIu32 " %" PRIu32 " %" PRIu32 " %" PRIu64 "\n", part_name(fault.part),
                         fault.byte, fault.bit, fault.cycle, number);
        }
    }
    set_alarm(0u);
    for (uint32_t part = 0; part < (machine_parts + (uint32_t)TIME_PARTS); ++part) {
        for (uint32_t moment = 0; moment < (uint32_t)MOMENTS; ++moment) {
            for (uint32_t outcome = 0; outcome < (uint32_t)OUTCOMES; ++outcome) {
                const tally_t *const of = &tally[part][moment][outcome];
                if (of->faults > 0u) {
                    (void)printf("count %s %s %s %" PRIu64 " %" PRIu64 " %" PRIu64 "\n", part_name(part),
                                 moment_name[moment], outcome_name[outcome], of->faults, of->sum, of->worst);
                }
            }
        }
    }
    return 0;
}
