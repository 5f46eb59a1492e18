/* machine: the target of the faults: a guard of one or two channels with its blocks, driven as by a board.
 *
 * A machine is copied as bytes: a snapshot is an assignment, followed by machine_moved. */
#ifndef FAULTS_MACHINE_H
#define FAULTS_MACHINE_H

#include "pair.h"
#include "parts.h"

typedef struct {
    guard_config_t block;
    uint64_t second_block[(sizeof(guard_config_t) + 7u) / 8u]; /* in Q9.22; zero: one channel */
    pair_t pair;
} machine_t;

enum { MACHINE_PARTS_MAX = 192 };

/* Offsets in machine_t. The second channel's parts are named second.NAME. */
extern part_t machine_part[MACHINE_PARTS_MAX];
extern uint32_t machine_parts;

/* second: NULL for one channel. Fills machine_part. */
bool machine_init(machine_t *self, const guard_config_t *block, const void *second);
bool machine_has_two_channels(const machine_t *self);

/* After a copy: every pointer into a block points into `home`, self or the machine that it is compared with. */
void machine_moved(machine_t *self, const machine_t *home);
void machine_take_counts(machine_t *self, const machine_t *other);

/* A flipped bit counts as the block: for the test of this program. */
void machine_accept_block(machine_t *self);

#endif
