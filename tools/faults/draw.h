/* draw: random faults that depend only on a seed and a number. */
#ifndef FAULTS_DRAW_H
#define FAULTS_DRAW_H

#include "reference.h"

/* The parts to draw from. */
typedef struct {
    uint32_t part[PARTS_MAX], count;
    bool unwatched;
} selection_t;

/* The name of a part, as the report uses it. */
const char *part_name(uint32_t part);

/* After machine_init. Parts, "state", "table", "time" or "unwatched"; without a name the whole state. */
selection_t select_parts(int count, char **names);

/* Fault `number` of the seed. */
fault_t draw_fault(const reference_t *reference, const selection_t *from, uint64_t seed, uint64_t number);

#endif
