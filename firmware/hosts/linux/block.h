/* block: reads the configuration block from its file into read-only memory. */
#ifndef TAUPERP_LINUX_BLOCK_H
#define TAUPERP_LINUX_BLOCK_H

#include "config.h"

/* A file has one block, or that of the second channel behind it: `second`, else NULL. Returns NULL, after one line on
 * stderr, if the file cannot be read, has another length, or is for another robot than `robot`. pair_init checks the
 * content. */
const guard_config_t *block_load(const char *path, const char *robot, const void **second);

/* The reason why guard_init refused the block, as text. */
const char *block_problem(guard_status_t status);

#endif
