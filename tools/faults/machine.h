/* machine: the target of the faults: one guard with its configuration block, driven as by a board.
 *
 * A machine is copied as bytes: a snapshot is an assignment, followed by machine_moved. */
#ifndef FAULTS_MACHINE_H
#define FAULTS_MACHINE_H

#include "guard.h"

typedef struct {
    guard_config_t config;
    guard_t guard;
} machine_t;

/* A part of a machine, by the name that the report uses. */
typedef struct {
    const char *name;
    uint32_t offset, size;
    bool table; /* a part of the configuration block, otherwise of the state */
} part_t;

enum { MACHINE_PARTS_MAX = 64 };
extern const part_t machine_part[];
extern const uint32_t machine_parts;

bool machine_init(machine_t *self, const guard_config_t *block);
void machine_moved(machine_t *self); /* after a copy: the guard points to its own block */

#endif
