#include "reference.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

_Noreturn void give_up(const char *why) {
    (void)fprintf(stderr, "faults: %s\n", why);
    exit(2);
}

/* --- one cycle ---------------------------------------------------------------------------------------------------- */

static void flip(machine_t *machine, const fault_t *fault) {
    uint8_t *const byte = (uint8_t *)machine + machine_part[fault->part].offset + fault->byte;
    *byte ^= (uint8_t)(1u << fault->bit);
    if (fault->unwatched) {
        machine_accept_block(machine);
    }
}

/* The guard's time: the recorded one, or the one changed by the fault. */
static uint64_t time_of(const cycle_t cycles[], uint32_t at, const fault_t *fault) {
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

/* A tick of cycle `at`; the robot receives it at once. */
static void tick(world_t *world, uint64_t guard_us, uint64_t robot_us, answer_t *answer) {
    guard_output_t out;
    pair_tick(&world->machine.pair, guard_us, &out);
    pair_note_tick_time(&world->machine.pair, 0u);
    for (uint32_t i = 0; (i < out.frame_count) && (i < GUARD_MAX_FRAMES); ++i) {
        robot_side_hear(&world->robot, &out.frame[i], robot_us);
    }
    answer->in_fault = out.state == GUARD_STATE_FAULT;
}

answer_t reference_cycle(const reference_t *self, world_t *world, uint32_t at, const fault_t *fault) {
    const cycle_t *const cycle = &self->cycles[at];
    answer_t answer = {false, false};
    const uint64_t now_us = time_of(self->cycles, at, fault);
    for (uint32_t i = 0; i < cycle->frames; ++i) {
        if ((fault != NULL) && (at == fault->cycle) && (i == fault->position) && (fault->part < machine_parts)) {
            flip(&world->machine, fault);
        }
        const can_frame_t *const frame = &self->frames[cycle->first + i];
        (void)robot_side_follow(&world->robot, frame, cycle->now_us);
        pair_receive(&world->machine.pair, frame, now_us);
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

static void read_recording(reference_t *self, const char *path, guard_config_t block[2]) {
    FILE *const file = fopen(path, "rb");
    uint32_t head[4]; /* channels, bytes of a block, cycles, frames */
    if ((file == NULL) || (fread(head, sizeof(head), 1, file) != 1u) || ((head[0] != 1u) && (head[0] != 2u)) ||
        (head[1] != sizeof(*block)) || (fread(block, sizeof(*block), head[0], file) != head[0])) {
        give_up("not a recording for this build");
    }
    self->channels = head[0];
    self->cycle_count = head[2];
    self->cycles = calloc(self->cycle_count, sizeof(*self->cycles));
    self->frames = calloc(head[3], sizeof(*self->frames));
    self->before = calloc(self->cycle_count, sizeof(*self->before));
    self->answer = calloc(self->cycle_count, sizeof(*self->answer));
    self->quiet = calloc(self->cycle_count, sizeof(*self->quiet));
    if ((self->cycles == NULL) || (self->frames == NULL) || (self->before == NULL) || (self->answer == NULL) ||
        (self->quiet == NULL)) {
        give_up("out of memory");
    }
    uint32_t first = 0;
    for (uint32_t i = 0; i < self->cycle_count; ++i) {
        uint32_t count;
        if ((fread(&self->cycles[i].now_us, sizeof(uint64_t), 1, file) != 1u) ||
            (fread(&count, sizeof(count), 1, file) != 1u)) {
            give_up("the recording is cut off");
        }
        self->cycles[i].first = first;
        self->cycles[i].frames = count;
        for (uint32_t j = 0; j < count; ++j, ++first) {
            uint8_t raw[16]; /* id, flags, length, 2 spare, data */
            if ((first >= head[3]) || (fread(raw, sizeof(raw), 1, file) != 1u)) {
                give_up("the recording is cut off");
            }
            memcpy(&self->frames[first].id, raw, 4u);
            self->frames[first].flags = raw[4];
            self->frames[first].length = raw[5];
            memcpy(self->frames[first].data, raw + 8, 8u);
        }
    }
    (void)fclose(file);
}

static void answer_all(reference_t *self, const guard_config_t block[]) {
    world_t world;
    memset(&world, 0, sizeof(world));
    if (!machine_init(&world.machine, block, (self->channels == 2u) ? &block[1] : NULL)) {
        give_up("the guard refuses the block");
    }
    const robot_side_config_t robot = {.joints = block->robot.joint_count,
                                       .fd = block->format == (uint32_t)FORMAT_FD,
                                       .answer_us = block->period_us / 2u,
                                       .hold_us = block->period_us + block->period_us / 2u};
    if (!robot_side_init(&world.robot, &robot)) {
        give_up("the robot's side refuses its settings");
    }
    self->reaction = (config_reaction_us(block) + block->period_us - 1u) / block->period_us;
    for (uint32_t i = 0; i < self->cycle_count; ++i) {
        memcpy(&self->before[i], &world, sizeof(world));
        machine_moved(&self->before[i].machine, &self->before[i].machine);
        self->answer[i] = reference_cycle(self, &world, i, NULL);
        if ((i > 0u) && self->answer[i - 1u].permits && !self->answer[i].permits && (self->stops < STOPS_MAX)) {
            self->stop[self->stops++] = i;
        }
    }
    self->quiet[self->cycle_count - 1u] = UINT32_MAX / 2u; /* to the end */
    for (uint32_t i = self->cycle_count - 1u; i-- > 0u;) {
        self->quiet[i] = (self->answer[i + 1u].permits != self->answer[i].permits) ? 1u : (self->quiet[i + 1u] + 1u);
    }
    if ((self->stops == 0u) || (self->cycle_count <= (uint32_t)HORIZON)) {
        give_up("the recording has no stop in it, or is too short");
    }
}

void reference_run(reference_t *self, const char *path) {
    guard_config_t block[2];
    read_recording(self, path, block);
    answer_all(self, block);
}
