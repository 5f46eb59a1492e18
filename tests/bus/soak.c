/* soak: hours of simulated bus in minutes, with random faults, and an account of every frame.
 *
 *   soak BLOCK CYCLES SEED HEX...     HEX: the 8 bytes of each joint's JointState, of a robot that stands still
 *
 * One cycle per period: the robot's frames arrive. Some are lost, corrupted, repeated, delayed, reordered or
 * misaddressed, have a wrong length or format, a sensor fault or a value out of range; some are inserted without a
 * sender. At times the bus is silent, and at times people push the arm. Then comes one tick. After a trip the robot
 * requests a reset. The expected reaction (soak_judge.c) follows from the fault of each frame, not from the guard's
 * reports:
 *   - a frame is refused and moves exactly one counter, or it is what the robot sent and moves none;
 *   - motion is permitted only while intact readings of one whole cycle, Sync and task are within their deadlines;
 *   - it is never permitted on a tick that took in a sensor fault, a value out of range or a StopCommand;
 *   - after a stop it is not permitted again without a reset that named the trip;
 *   - a push of 5 Nm ends it while it lasts.
 * Corruption changes 1 to 3 bits. The CRC finds all of it outside the counter. A flipped counter bit also selects
 * another data id; about one in 1,400 of these is valid by chance. No check could detect a frame that is valid by
 * chance, so it is drawn again. Exit 1 at the first violation. Prints one JSON object.
 */
#include "soak.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define COUNTER_WRAP 60000u

static void step(soak_t *self) {
    const uint64_t now_us = self->cycle * self->config->period_us;
    robot_sends(self);
    deliver(self, now_us);
    guard_tick(&self->guard, now_us, &self->out);
    judge(self);
    /* They saturate at 65535; the account continues. */
    if ((self->guard.counters.crc_errors > COUNTER_WRAP) || (self->guard.counters.sequence_errors > COUNTER_WRAP) ||
        (self->guard.counters.format_errors > COUNTER_WRAP) || (self->guard.counters.late_frames > COUNTER_WRAP) ||
        (self->guard.counters.range_errors > COUNTER_WRAP)) {
        self->guard.counters = (guard_counters_t){0};
    }
    self->cycle++;
}

static void print(const soak_t *self, uint64_t seed) {
    const tally_t *const t = &self->tally;
    const uint64_t refused = t->crc + t->sequence + t->range + t->format + t->late;
    (void)printf("{\"seed\":%" PRIu64 ",\"cycles\":%" PRIu64 ",\"frames\":%" PRIu64 ",\"accepted\":%" PRIu64
                 ",\"initial\":%" PRIu64 ",\"crc_errors\":%" PRIu64 ",\"sequence_errors\":%" PRIu64
                 ",\"range_errors\":%" PRIu64 ",\"format_errors\":%" PRIu64 ",\"late_frames\":%" PRIu64
                 ",\"unaccounted\":%" PRId64 ",\"permitted\":%" PRIu64 ",\"trips\":%" PRIu64 ",\"resumed\":%" PRIu64
                 ",\"pushes\":%" PRIu64 ",\"silences\":%" PRIu64 ",\"faults\":{",
                 seed, self->cycle, t->frames, t->accepted, t->initial, t->crc, t->sequence, t->range, t->format,
                 t->late, (int64_t)(t->frames - t->accepted - t->initial - refused), t->permitted, t->trips, t->resets,
                 t->pushes, t->silences);
    for (uint32_t i = 1; i < (uint32_t)FAULT_COUNT; i++) {
        (void)printf("%s\"%s\":%" PRIu64, (i == 1u) ? "" : ",", fault_names[i], t->injected[i]);
    }
    (void)printf("}}\n");
}

int main(int argc, char **argv) {
    static soak_t soak;
    static guard_config_t block;
    if ((argc < 5) || (argc > 4 + (int)ROBOT_MAX_JOINTS)) {
        (void)fputs("soak: BLOCK CYCLES SEED HEX...\n", stderr);
        return 2;
    }
    FILE *const file = fopen(argv[1], "rb");
    if ((file == NULL) || (fread(&block, sizeof block, 1, file) != 1u)) {
        (void)fprintf(stderr, "soak: %s cannot be read\n", argv[1]);
        return 2;
    }
    (void)fclose(file);
    const uint64_t cycles = strtoull(argv[2], NULL, 10);
    const uint64_t seed = strtoull(argv[3], NULL, 10);
    soak.config = &block;
    soak.joints = (uint32_t)argc - 4u;
    soak.random = (seed * 0x9E3779B97F4A7C15u) | 1u;
    if ((guard_init(&soak.guard, &block) != GUARD_OK) || (soak.joints != block.robot.joint_count)) {
        (void)fputs("soak: the block is refused, or is for a robot with other joints\n", stderr);
        return 2;
    }
    for (uint32_t joint = 0; joint < soak.joints; joint++) {
        for (uint32_t i = 0; i < CAN_FRAME_DATA_LENGTH; i++) {
            unsigned int byte = 0;
            (void)sscanf(&argv[4u + joint][2u * i], "%2x", &byte);
            soak.hold[joint][i] = (uint8_t)byte;
        }
    }
    (void)fprintf(stderr, "soak: seed %" PRIu64 "\n", seed);
    while (soak.cycle < cycles) {
        step(&soak);
    }
    print(&soak, seed);
    return 0;
}
