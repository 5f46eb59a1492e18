/* parts: the parts of one channel's guard and block, by name. Compiled once for each channel: names.h (the second
 * channel's settings) gives each its own symbols. */
#ifndef FAULTS_PARTS_H
#define FAULTS_PARTS_H

#include <stdbool.h>
#include <stdint.h>

/* offset: in the guard, or in the block. */
typedef struct {
    const char *name;
    uint32_t offset, size;
    bool table; /* of the configuration block; else of the guard's state */
} part_t;

/* The layout of one channel, whose types the program does not see. */
typedef struct {
    const part_t *part;
    uint32_t parts, guard_bytes;
    /* The pointers into the block point to `block` from now on; a flipped bit in one of them stays. */
    void (*move)(void *guard, const void *block);
    /* Copies the counters, on which no permission rests. */
    void (*take_counts)(void *guard, const void *other);
} layout_t;

const layout_t *first_layout(void);
const layout_t *second_layout(void);

#endif
