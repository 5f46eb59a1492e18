/* firmware/guard: CRC, reasons, snapshot. */
#include "proof.h"

#include "crc32.c"
#include "guard_reason.c"
#include "snapshot.c"
#include "values.c"

void proof_crc32(void) {
    uint8_t data[16];
    uint32_t state, length;
    ASSUME(length <= sizeof(data)); /* each byte is processed separately, so the proof covers any length */
    (void)crc32_finish(crc32_fold(state, data, length));
    REACHED;
}

void proof_reasons(void) {
    uint32_t first, second;
    const guard_reason_t worse = reason_worse((guard_reason_t)first, (guard_reason_t)second);
    HOLDS(((uint32_t)worse == first) || ((uint32_t)worse == second), "the worse reason is one of the two");
    HOLDS(reason_worse((guard_reason_t)first, GUARD_REASON_NONE) == (guard_reason_t)first,
          "NONE never replaces a fault");
    (void)reason_class((guard_reason_t)first);
    HOLDS(!reason_is_contact((guard_reason_t)first) || (reason_class((guard_reason_t)first) == REASON_STOPPED),
          "a contact is a stop, not a fault");
    REACHED;
}

void proof_snapshot(void) {
    snapshot_t snapshot;
    uint32_t joints, joint;
    uint16_t cycle;
    uint8_t counter;
    num_t position, velocity, torque;
    uint32_t action;
    ASSUME(snapshot_is_valid(&snapshot));
    switch (action) {
    case 0:
        (void)snapshot_init(&snapshot, joints);
        ASSUME((joints >= 1u) && (joints <= ROBOT_MAX_JOINTS));
        break;
    case 1:
        snapshot_restart(&snapshot);
        break;
    case 2:
        snapshot_begin(&snapshot, cycle);
        break;
    case 3:
        (void)snapshot_add(&snapshot, joint, counter, position, velocity, torque);
        break;
    default:
        ASSUME(snapshot_is_complete(&snapshot));
        (void)snapshot_take(&snapshot);
        HOLDS(!snapshot_is_complete(&snapshot), "a snapshot is evaluated once");
        break;
    }
    HOLDS(snapshot_is_valid(&snapshot), "a valid snapshot stays valid");
    REACHED;
}
