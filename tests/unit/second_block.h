/* second_block: the installation of guard_fixture.h for the second channel, in Q9.22. Compiled as that channel is. */
#ifndef SECOND_BLOCK_H
#define SECOND_BLOCK_H

#include "second.h"

/* A sealed block, the same in every call. */
const void *second_block(void);

/* Flips what only the inverted copy of the second channel's permission depends on. */
void second_forgets_its_reset(tauperp_second_t *self);

#endif
