/* firmware/guard/config_tasks.c: any task of any block whose robot and bank are valid. */
#include "num_stub.h"

#include "config_tasks.c"
#include "guard_any.h"

/* One row; the loops run to the longest arm and the largest bank. */
void proof_task(void) {
    guard_config_t block;
    task_config_t task;
    block.robot.joint_count = ROBOT_MAX_JOINTS;
    block.bank.channels = BANK_MAX_CHANNELS;
    ASSUME(task.index.frame == (uint32_t)FRAME_TIP); /* the other frames have axes: the next harness */
    (void)check_task(&block, &task);
    REACHED;
}

void proof_axes(void) {
    index_config_t index;
    (void)axes_are_valid(&index);
    REACHED;
}
