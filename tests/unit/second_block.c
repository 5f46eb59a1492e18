#define robot_ku_dex second_robot_ku_dex /* the table once more, in Q9.22 */
#include "../robots/robot_ku_dex.c"

#include "guard_fixture.h"
#include "second_block.h"

const void *second_block(void) {
    static guard_config_t block;
    block = make_config();
    return &block;
}

void second_forgets_its_reset(tauperp_second_t *self) {
    guard_t *const guard = (guard_t *)(void *)self; /* the first member of its state */
    guard->acknowledged = (uint8_t)GUARD_CLEAR;
}
