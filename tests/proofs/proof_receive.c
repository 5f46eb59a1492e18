/* firmware/guard/guard_receive.c: any frame, at any time, in any state. */
#include "proof.h"

#include "guard_any.h"
#include "guard_reason.c"
#include "guard_receive.c"
#include "messages.c"
#define protocol_slot table_slot
#include "protocol.c"
#undef protocol_slot
#include "snapshot.c"
#include "values.c"

/* The entry of the frame's id; proof_slot in proof_e2e.c proves this contract. */
static uint32_t chosen_slot;

uint32_t protocol_slot(uint32_t id) {
    (void)id;
    return chosen_slot;
}

/* proof_e2e.c proves the contract of this stub: the status, `lost`, and that a refused frame keeps the reference. */
static e2e_status_t last_status;

bool e2e_accepts(e2e_status_t status) {
    return (status == E2E_OK) || (status == E2E_SOME_LOST);
}

e2e_status_t e2e_check(e2e_receiver_t *self, const uint8_t *data, uint8_t length, const uint8_t *data_ids,
                       uint8_t max_delta) {
    e2e_status_t status;
    e2e_receiver_t after;
    HOLDS((length >= 2u) && (length <= CAN_FRAME_DATA_LENGTH) && (max_delta >= 1u) && (max_delta <= E2E_MAX_DELTA),
          "the precondition of e2e_check");
    HOLDS(__CPROVER_r_ok(data, length) && __CPROVER_r_ok(data_ids, E2E_DATA_ID_COUNT), "the bytes are readable");
    ASSUME((status >= E2E_WRONG_CRC) && (status <= E2E_OK) && (after.lost < E2E_MAX_DELTA));
    if (status >= E2E_WRONG_SEQUENCE) {
        *self = after;
    }
    last_status = status;
    return status;
}

/* A frame that fails its length, format or E2E check changes no signal. */
static void signals_are_unchanged(const guard_inputs_t *before, const guard_inputs_t *after) {
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        HOLDS(after->snapshot.position[i] == before->snapshot.position[i], "position");
        HOLDS(after->snapshot.velocity[i] == before->snapshot.velocity[i], "velocity");
        HOLDS(after->snapshot.torque[i] == before->snapshot.torque[i], "torque");
    }
    HOLDS(after->snapshot.cycle == before->snapshot.cycle, "cycle");
    HOLDS(after->snapshot.received == before->snapshot.received, "readings");
    HOLDS((after->sync.good_us == before->sync.good_us) && (after->sync.seen == before->sync.seen), "age of Sync");
    HOLDS((after->task.good_us == before->task.good_us) && (after->task.seen == before->task.seen), "age of the task");
    HOLDS(after->completed_us == before->completed_us, "age of the snapshot");
    HOLDS((after->task_number == before->task_number) && (after->task_cycle == before->task_cycle), "task");
    HOLDS(after->task_number_inverted == before->task_number_inverted, "inverted task");
    HOLDS((after->acceleration.x == before->acceleration.x) && (after->acceleration.y == before->acceleration.y) &&
              (after->acceleration.z == before->acceleration.z),
          "acceleration");
    HOLDS((after->request == before->request) && (after->edge == before->edge), "request");
    HOLDS(after->requested_trip == before->requested_trip, "requested trip");
}

/* One harness per kind of message, so that CBMC examines one table entry at a time. */
static void receive_one(uint32_t slot) {
    guard_t guard;
    uint64_t now_us;
    can_frame_t frame;
    any_guard(&guard);
    /* 73,000 years: the products of compare_clocks fit. */
    ASSUME((guard.inputs.window_start_us <= now_us) && (now_us < ((uint64_t)1 << 61)));
    chosen_slot = slot;
    last_status = E2E_UNCHECKED;
    const guard_inputs_t before = guard.inputs;
    guard_receive(&guard, &frame, now_us);
    HOLDS(guard_is_sound(&guard), "the guard stays sound");
    if (!e2e_accepts(last_status)) {
        signals_are_unchanged(&before, &guard.inputs);
    }
    (void)guard_cycle_complete(&guard);
}

void proof_receive_sync(void) {
    receive_one(PROTOCOL_RECEIVE_SYNC);
    REACHED;
}

void proof_receive_first_joint(void) {
    receive_one(PROTOCOL_RECEIVE_JOINT_STATE);
    REACHED;
}

void proof_receive_every_joint(void) {
    for (uint32_t joint = 1; joint < ROBOT_MAX_JOINTS; ++joint) {
        receive_one(PROTOCOL_RECEIVE_JOINT_STATE + joint);
    }
    REACHED;
}

void proof_receive_task(void) {
    receive_one(PROTOCOL_RECEIVE_TASK_COMMAND);
    REACHED;
}

void proof_receive_reset(void) {
    receive_one(PROTOCOL_RECEIVE_GUARD_RESET);
    REACHED;
}

void proof_receive_unknown(void) {
    receive_one(PROTOCOL_RECEIVE_COUNT);
    REACHED;
}
