/* block: the configuration block, from its file into memory that nothing in this process can write to any more. */
#ifndef TAUPERP_LINUX_BLOCK_H
#define TAUPERP_LINUX_BLOCK_H

#include "config.h"

/* NULL after one line on stderr: the file cannot be read, is not as long as a block, or is for another robot than
 * `robot`. What is in the block is for guard_init to judge. */
const guard_config_t *block_load(const char *path, const char *robot);

/* Why guard_init refused it, for a person. */
const char *block_problem(guard_status_t status);

#endif
