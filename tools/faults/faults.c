/* faults: flips bits in a guard's state and block, and spoils its clock and ticks, while it hears a recorded run.
 *
 *     faults RECORDING SEED FIRST COUNT [PART...]
 *
 * PART: `state` (as without one: with `table`), `table`, `time`, or a name of machine.c; `unwatched`: the table,
 * without the check that sees it, as a test of this program.
 *
 * RECORDING (tools/faults/record.py): a block, then one cycle after the other: its time and its frames. The run without
 * a fault comes first; it is the reference. Fault number i is drawn from SEED and i alone. Each fault starts from the
 * reference's own state at its cycle, and runs until nothing differs any more that a permission rests on, or the
 * flipped bit alone differs for 10 cycles and the reference's permission stays as it is, or 420 cycles are over. The
 * judge of each answer is the robot's side (firmware/robot_side): what counts is whether the robot may move.
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

#include "machine.h"
#include "robot_side.h"

enum { HORIZON = 420, DORMANT = 10, BEFORE = 60, AFTER = 300, STOPS_MAX = 64, TOLD = 200, HANG_MS = 500 };
enum { TIME_PARTS = 7 };
static const char *const time_part[TIME_PARTS] = {"clock.fast",    "clock.slow",  "clock.stopped", "clock.back",
                                                  "clock.forward", "tick.missed", "tick.late"};
typedef enum { NONE, DETECTED, NEEDLESS, LATE, WRONG, OUTCOMES } outcome_t;
static const char *const outcome_name[OUTCOMES] = {"none", "detected", "needless", "late", "wrong"};
typedef enum { BEFORE_STOP, AFTER_STOP, ANYWHERE, MOMENTS } moment_t;
static const char *const moment_name[MOMENTS] = {"before-stop", "after-stop", "anywhere"};

typedef struct {
    uint64_t now_us;
    uint32_t first, frames;
} cycle_t;

typedef struct {
    machine_t machine;
    robot_side_t robot;
} world_t;

typedef struct {
    bool permits, in_fault;
} answer_t;

typedef struct {
    uint64_t faults, sum, worst;
} tally_t;

/* One fault. part: of machine_part, or behind them of time_part. */
typedef struct {
    uint32_t part, byte, bit, cycle, position;
    moment_t moment;
    double factor;
    uint32_t ticks;
    int64_t step_us;
} fault_t;

static cycle_t *cycles;
static can_frame_t *frames;
static uint32_t cycle_count;
static world_t *before; /* the reference at the beginning of each cycle */
static answer_t *reference;
static uint32_t *quiet; /* cycles until the reference's permission changes next */
static uint32_t stop[STOPS_MAX], stops, reaction;
static tally_t tally[MACHINE_PARTS_MAX + TIME_PARTS][MOMENTS][OUTCOMES];
static bool unwatched; /* for the test of this program: the block's watch takes a flipped bit for the block */
static sigjmp_buf crashed;

static _Noreturn void give_up(const char *why) {
    (void)fprintf(stderr, "faults: %s\n", why);
    exit(2);
}

static uint64_t draw(uint64_t *state) { /* splitmix64 */
    uint64_t z = (*state += 0x9E3779B97F4A7C15u);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

static uint32_t below(uint64_t *state, uint32_t bound) {
    return (uint32_t)((draw(state) >> 32) * bound >> 32);
}

/* --- one cycle ---------------------------------------------------------------------------------------------------- */

static void flip(machine_t *machine, const fault_t *fault) {
    uint8_t *const byte = (uint8_t *)machine + machine_part[fault->part].offset + fault->byte;
    *byte ^= (uint8_t)(1u << fault->bit);
    if (unwatched) {
        config_watch_start(&machine->guard.watch);
    }
}

/* The guard's time: the reference's, or what the fault makes of it. */
static uint64_t time_of(uint32_t at, const fault_t *fault) {
    const uint64_t true_us = cycles[at].now_us;
    if ((fault == NULL) || (fault->part < machine_parts) || (at < fault->cycle)) {
        return true_us;
    }
    const uint64_t begun_us = cycles[fault->cycle].now_us;
    return (uint64_t)((int64_t)begun_us + (int64_t)((double)(true_us - begun_us) * fault->factor) + fault->step_us);
}

static bool has_tick(uint32_t at, const fault_t *fault) {
    return (fault == NULL) || (fault->part < machine_parts) || (at < fault->cycle) ||
           (at >= (fault->cycle + fault->ticks));
}

/* A tick of cycle `at`; the robot hears it at once. */
static void tick(world_t *world, uint64_t guard_us, uint64_t robot_us, answer_t *answer) {
    guard_output_t out;
    guard_tick(&world->machine.guard, guard_us, &out);
    guard_note_tick_time(&world->machine.guard, 0u);
    for (uint32_t i = 0; (i < out.frame_count) && (i < GUARD_MAX_FRAMES); ++i) {
        robot_side_hear(&world->robot, &out.frame[i], robot_us);
    }
    answer->in_fault = out.state == GUARD_STATE_FAULT;
}

static answer_t run_cycle(world_t *world, uint32_t at, const fault_t *fault) {
    const cycle_t *const cycle = &cycles[at];
    answer_t answer = {false, false};
    const uint64_t now_us = time_of(at, fault);
    for (uint32_t i = 0; i < cycle->frames; ++i) {
        if ((fault != NULL) && (at == fault->cycle) && (i == fault->position) && (fault->part < machine_parts)) {
            flip(&world->machine, fault);
        }
        const can_frame_t *const frame = &frames[cycle->first + i];
        (void)robot_side_follow(&world->robot, frame, cycle->now_us);
        guard_receive(&world->machine.guard, frame, now_us);
    }
    if ((fault != NULL) && (at == fault->cycle) && (fault->position >= cycle->frames) &&
        (fault->part < machine_parts)) {
        flip(&world->machine, fault);
    }
    if (has_tick(at, fault)) {
        tick(world, now_us, cycle->now_us, &answer);
    }
    answer.permits = robot_side_permit(&world->robot, cycle->now_us).allowed;
    return answer;
}

/* --- the reference ------------------------------------------------------------------------------------------------ */

static void read_recording(const char *path, guard_config_t *block) {
    FILE *const file = fopen(path, "rb");
    uint32_t head[3]; /* bytes of the block, cycles, frames */
    if ((file == NULL) || (fread(head, sizeof(head), 1, file) != 1u) || (head[0] != sizeof(*block)) ||
        (fread(block, sizeof(*block), 1, file) != 1u)) {
        give_up("not a recording for this build");
    }
    cycle_count = head[1];
    cycles = calloc(cycle_count, sizeof(*cycles));
    frames = calloc(head[2], sizeof(*frames));
    before = calloc(cycle_count, sizeof(*before));
    reference = calloc(cycle_count, sizeof(*reference));
    quiet = calloc(cycle_count, sizeof(*quiet));
    if ((cycles == NULL) || (frames == NULL) || (before == NULL) || (reference == NULL) || (quiet == NULL)) {
        give_up("out of memory");
    }
    uint32_t first = 0;
    for (uint32_t i = 0; i < cycle_count; ++i) {
        uint32_t count;
        if ((fread(&cycles[i].now_us, sizeof(uint64_t), 1, file) != 1u) ||
            (fread(&count, sizeof(count), 1, file) != 1u)) {
            give_up("the recording is cut off");
        }
        cycles[i].first = first;
        cycles[i].frames = count;
        for (uint32_t j = 0; j < count; ++j, ++first) {
            uint8_t raw[16]; /* id, flags, length, 2 spare, data */
            if ((first >= head[2]) || (fread(raw, sizeof(raw), 1, file) != 1u)) {
                give_up("the recording is cut off");
            }
            memcpy(&frames[first].id, raw, 4u);
            frames[first].flags = raw[4];
            frames[first].length = raw[5];
            memcpy(frames[first].data, raw + 8, 8u);
        }
    }
    (void)fclose(file);
}

static void run_reference(const guard_config_t *block) {
    world_t world;
    memset(&world, 0, sizeof(world));
    if (!machine_init(&world.machine, block)) {
        give_up("the guard refuses the block");
    }
    const robot_side_config_t robot = {.joints = block->robot.joint_count,
                                       .fd = block->format == (uint32_t)FORMAT_FD,
                                       .answer_us = block->period_us / 2u,
                                       .hold_us = block->period_us + block->period_us / 2u};
    if (!robot_side_init(&world.robot, &robot)) {
        give_up("the robot's side refuses its settings");
    }
    reaction = (config_reaction_us(block) + block->period_us - 1u) / block->period_us;
    for (uint32_t i = 0; i < cycle_count; ++i) {
        memcpy(&before[i], &world, sizeof(world));
        reference[i] = run_cycle(&world, i, NULL);
        if ((i > 0u) && reference[i - 1u].permits && !reference[i].permits && (stops < STOPS_MAX)) {
            stop[stops++] = i;
        }
    }
    quiet[cycle_count - 1u] = UINT32_MAX / 2u; /* to the end */
    for (uint32_t i = cycle_count - 1u; i-- > 0u;) {
        quiet[i] = (reference[i + 1u].permits != reference[i].permits) ? 1u : (quiet[i + 1u] + 1u);
    }
    if ((stops == 0u) || (cycle_count <= (uint32_t)HORIZON)) {
        give_up("the recording has no stop in it, or is too short");
    }
}

/* --- one fault ---------------------------------------------------------------------------------------------------- */

static fault_t draw_fault(uint64_t seed, uint64_t number, const uint32_t parts[], uint32_t count) {
    uint64_t state = seed ^ (number * 0xD1342543DE82EF95u);
    fault_t fault = {.factor = 1.0};
    /* Parts that the caller names are drawn by their size, the ways of time evenly. */
    uint32_t total = 0;
    for (uint32_t i = 0; i < count; ++i) {
        total += (parts[i] < machine_parts) ? machine_part[parts[i]].size : 1u;
    }
    uint32_t at = below(&state, total);
    uint32_t chosen = 0;
    while (at >= ((parts[chosen] < machine_parts) ? machine_part[parts[chosen]].size : 1u)) {
        at -= (parts[chosen] < machine_parts) ? machine_part[parts[chosen]].size : 1u;
        ++chosen;
    }
    fault.part = parts[chosen];
    fault.byte = at;
    fault.bit = below(&state, 8u);
    fault.moment = (below(&state, 2u) == 0u) ? BEFORE_STOP : ((below(&state, 2u) == 0u) ? AFTER_STOP : ANYWHERE);
    const uint32_t near = stop[below(&state, stops)];
    switch (fault.moment) {
    case BEFORE_STOP:
        fault.cycle = (near > BEFORE) ? (near - 1u - below(&state, BEFORE)) : below(&state, near);
        break;
    case AFTER_STOP:
        fault.cycle = near + below(&state, AFTER);
        break;
    case ANYWHERE:
    case MOMENTS:
    default:
        fault.cycle = below(&state, cycle_count);
        break;
    }
    const uint32_t last = cycle_count - (uint32_t)HORIZON;
    fault.cycle = (fault.cycle < last) ? fault.cycle : last;
    fault.position = below(&state, cycles[fault.cycle].frames + 1u);
    const double share = (double)below(&state, 1000000u) / 1e6;
    const int64_t period_us = (int64_t)before[0].machine.config.period_us;
    switch ((fault.part >= machine_parts) ? (fault.part - machine_parts) : (uint32_t)TIME_PARTS) {
    case 0:
        fault.factor = 1.02 + 3.0 * share * share;
        break;
    case 1:
        fault.factor = 0.98 * share + 0.001;
        break;
    case 2:
        fault.factor = 0.0;
        break;
    case 3:
        fault.step_us = -(int64_t)(share * 100.0 * (double)period_us) - 1;
        break;
    case 4:
        fault.step_us = (int64_t)(share * 100.0 * (double)period_us) + 1;
        break;
    case 5:
        fault.ticks = 1u + below(&state, 40u);
        break;
    case 6:
        fault.ticks = 1u + below(&state, 3u);
        fault.step_us = (int64_t)(share * (double)period_us);
        break;
    default:
        break;
    }
    return fault;
}

/* Not permitted in this cycle nor in any of the reaction time before it. */
static bool long_stopped(uint32_t at) {
    for (uint32_t back = 0; (back <= reaction) && (back <= at); ++back) {
        if (reference[at - back].permits) {
            return false;
        }
    }
    return true;
}

/* Nothing differs that a permission rests on. The world becomes the reference where it is only counted. With a fault:
 * or its flipped bit alone does, which nothing has read or written. */
static bool is_same(world_t *world, const world_t *other, const fault_t *dormant) {
    guard_t *const guard = &world->machine.guard;
    guard->config = other->machine.guard.config;
    guard->counters = other->machine.guard.counters;
    guard->report.worst_tick_time_us = other->machine.guard.report.worst_tick_time_us;
    guard->report.margin_us = other->machine.guard.report.margin_us;
    bool same = memcmp(world, other, sizeof(*world)) == 0;
    if (!same && (dormant != NULL)) {
        uint8_t *const byte = (uint8_t *)&world->machine + machine_part[dormant->part].offset + dormant->byte;
        *byte ^= (uint8_t)(1u << dormant->bit);
        same = memcmp(world, other, sizeof(*world)) == 0;
        *byte ^= (uint8_t)(1u << dormant->bit);
    }
    machine_moved(&world->machine);
    return same;
}

static outcome_t judge(const fault_t *fault, uint32_t *after) {
    static world_t world;
    volatile outcome_t worst = NONE;
    volatile uint32_t at = fault->cycle;
    memcpy(&world, &before[fault->cycle], sizeof(world));
    machine_moved(&world.machine);
    if (sigsetjmp(crashed, 1) != 0) { /* on a board: an exception, or the watchdog */
        *after = at - fault->cycle;
        return (worst > DETECTED) ? worst : DETECTED;
    }
    const uint32_t end = fault->cycle + (uint32_t)HORIZON;
    *after = 0;
    for (; at < end; ++at) {
        const answer_t answer = run_cycle(&world, at, fault);
        outcome_t outcome = NONE;
        if (answer.permits && !reference[at].permits) {
            outcome = long_stopped(at) ? WRONG : LATE;
        } else if (answer.in_fault && !reference[at].in_fault) {
            outcome = DETECTED;
        } else if (!answer.permits && reference[at].permits) {
            /* The answer that the robot refuses, or no answer: the fault is seen there. */
            outcome = (world.machine.guard.state == (uint32_t)GUARD_STATE_MONITORING) ? DETECTED : NEEDLESS;
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
        const bool over_soon = (at >= (fault->cycle + (uint32_t)DORMANT)) && ((at + quiet[at]) >= end);
        if ((fault->part < machine_parts) && ((at + 1u) < cycle_count) &&
            is_same(&world, &before[at + 1u], over_soon ? fault : NULL)) {
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
    (void)sigaction(SIGALRM, &action, NULL);
}

static void set_alarm(uint32_t ms) {
    const struct itimerval timer = {.it_value = {.tv_sec = (time_t)(ms / 1000u)}};
    (void)setitimer(ITIMER_REAL, &timer, NULL);
}

static const char *name_of(uint32_t part) {
    return (part < machine_parts) ? machine_part[part].name : time_part[part - machine_parts];
}

static uint32_t chosen_parts(int count, char **names, uint32_t parts[]) {
    uint32_t chosen = 0;
    for (uint32_t part = 0; part < (machine_parts + (uint32_t)TIME_PARTS); ++part) {
        bool wanted = (count == 0) && (part < machine_parts);
        for (int i = 0; i < count; ++i) {
            const bool time = part >= machine_parts;
            const bool table = !time && machine_part[part].table;
            unwatched = unwatched || (strcmp(names[i], "unwatched") == 0);
            wanted = wanted || (unwatched && table) || (strcmp(names[i], name_of(part)) == 0) ||
                     ((strcmp(names[i], "time") == 0) && time) || ((strcmp(names[i], "table") == 0) && table) ||
                     ((strcmp(names[i], "state") == 0) && !time && !table);
        }
        if (wanted) {
            parts[chosen++] = part;
        }
    }
    return chosen;
}

int main(int argc, char **argv) {
    guard_config_t block;
    uint32_t parts[MACHINE_PARTS_MAX + TIME_PARTS];
    if (argc < 5) {
        give_up("faults RECORDING SEED FIRST COUNT [PART...]");
    }
    read_recording(argv[1], &block);
    const uint64_t seed = strtoull(argv[2], NULL, 10);
    const uint64_t first = strtoull(argv[3], NULL, 10);
    const uint64_t count = strtoull(argv[4], NULL, 10);
    const uint32_t chosen = chosen_parts(argc - 5, argv + 5, parts);
    if (chosen == 0u) {
        give_up("there is no such part");
    }
    run_reference(&block);
    (void)printf("reaction %" PRIu32 "\nreference %" PRIu32 " %" PRIu32 "\n", reaction, cycle_count, stops);
    catch_crashes();
    uint32_t told = 0;
    for (uint64_t number = first; number < (first + count); ++number) {
        const fault_t fault = draw_fault(seed, number, parts, chosen);
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
            (void)printf("wrong %s %" PRIu32 " %" PRIu32 " %" PRIu32 " %" PRIu64 "\n", name_of(fault.part), fault.byte,
                         fault.bit, fault.cycle, number);
        }
    }
    set_alarm(0u);
    for (uint32_t part = 0; part < (machine_parts + (uint32_t)TIME_PARTS); ++part) {
        for (uint32_t moment = 0; moment < (uint32_t)MOMENTS; ++moment) {
            for (uint32_t outcome = 0; outcome < (uint32_t)OUTCOMES; ++outcome) {
                const tally_t *const of = &tally[part][moment][outcome];
                if (of->faults > 0u) {
                    (void)printf("count %s %s %s %" PRIu64 " %" PRIu64 " %" PRIu64 "\n", name_of(part),
                                 moment_name[moment], outcome_name[outcome], of->faults, of->sum, of->worst);
                }
            }
        }
    }
    return 0;
}
