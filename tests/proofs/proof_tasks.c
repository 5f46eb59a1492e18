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
    const bool valid = check_task(&block, &task) == GUARD_OK;
    const explained_config_t *const limits = &task.limits;
    HOLDS(!valid || !is_of_payload(&task.index) || ((limits->mass_max_kg > 0) && (limits->force_slack_n > 0)),
          "explained.c relies on the limits of a payload");
    HOLDS(!valid || (task.index.kind < (uint32_t)INDEX_KIND_COUNT), "a known kind");
    HOLDS(!valid || has_no_axes(&task.index), "index.c relies on a row without axes and point");
    REACHED;
}

void proof_axes(void) {
    index_config_t index;
    if (axes_are_valid(&index)) {
        for (uint32_t a = 0; a < 3u; ++a) {
            for (uint32_t b = 0; b < 3u; ++b) {
                HOLDS(num_abs(index.axis[a][b]) < NUM(2), "index.c relies on the axes");
            }
            HOLDS(num_abs(index.point[a]) < NUM(2), "index.c relies on the point");
        }
    }
    REACHED;
}

/* Instead of check_task, which proof_task and proof_axes show (proofs.toml). */
static uint32_t tasks_seen;

guard_status_t stub_task(const guard_config_t *config, const task_config_t *task) {
    guard_status_t status;
    HOLDS(__CPROVER_r_ok(config, sizeof(*config)) && __CPROVER_r_ok(task, sizeof(*task)), "block and row are there");
    HOLDS(task->index.kind != (uint32_t)INDEX_OFF, "a row in use");
    ++tasks_seen;
    return status;
}

void proof_tasks(void) {
    guard_config_t block;
    uint32_t used = 0;
    for (uint32_t t = 0; t < (uint32_t)TASK_COUNT; ++t) {
        used += (block.task[t].index.kind != (uint32_t)INDEX_OFF) ? 1u : 0u;
    }
    tasks_seen = 0;
    if (check_tasks(&block) == GUARD_OK) {
        HOLDS(used > 0u, "a block without a task is refused");
        HOLDS(tasks_seen == used, "every row in use was checked");
        HOLDS(block.task[TASK_INVALID].index.kind == (uint32_t)INDEX_OFF, "the invalid task is off");
    }
    REACHED;
}
