/* fault: the kind, place and time of a fault. */
#ifndef FAULTS_FAULT_H
#define FAULTS_FAULT_H

#include "machine.h"

typedef enum { BEFORE_STOP, AFTER_STOP, ANYWHERE, MOMENTS } moment_t;

enum { HORIZON = 420, TIME_PARTS = 7, PARTS_MAX = MACHINE_PARTS_MAX + TIME_PARTS };

/* part: of machine_part, or after them a fault of time (draw.c). unwatched: the watch takes a flipped bit for the
 * block, for the test of this program. */
typedef struct {
    uint32_t part, byte, bit, cycle, position;
    moment_t moment;
    double factor;
    uint32_t ticks;
    int64_t step_us;
    bool unwatched;
} fault_t;

#endif
