#include "snapshot.h"

#include <string.h>

#define NIBBLE_MASK   0x0Fu
#define NIBBLE_BEHIND 8u /* nibble distances from here on are read as the past */

bool snapshot_init(snapshot_t *self, uint32_t joint_count) {
    memset(self, 0, sizeof(*self));
    if ((joint_count < 1u) || (joint_count > ROBOT_MAX_JOINTS)) {
        return false;
    }
    self->expected = (uint8_t)((1u << joint_count) - 1u);
    return true;
}

void snapshot_begin(snapshot_t *self, uint16_t cycle) {
    self->cycle = cycle;
    self->gap = self->referenced ? (uint16_t)(cycle - self->complete_cycle) : 0u;
    self->received = 0u;
    self->begun = true;
}

snapshot_status_t snapshot_add(snapshot_t *self, uint32_t joint, uint8_t counter, num_t position, num_t velocity,
                               num_t torque) {
    if (!self->begun) {
        return SNAPSHOT_NO_SYNC;
    }
    if ((joint >= ROBOT_MAX_JOINTS) || (((uint32_t)self->expected & (1u << joint)) == 0u)) {
        return SNAPSHOT_NO_JOINT;
    }
    const uint32_t ahead = ((uint32_t)counter - self->cycle) & NIBBLE_MASK;
    if (ahead != 0u) {
        return (ahead >= NIBBLE_BEHIND) ? SNAPSHOT_LATE : SNAPSHOT_WRONG_CYCLE;
    }
    if (((uint32_t)self->received & (1u << joint)) != 0u) {
        return SNAPSHOT_DUPLICATE;
    }
    self->position[joint] = position;
    self->velocity[joint] = velocity;
    self->torque[joint] = torque;
    self->received = (uint8_t)(self->received | (1u << joint));
    if (self->received != self->expected) {
        return SNAPSHOT_TAKEN;
    }
    self->complete_cycle = self->cycle;
    self->referenced = true;
    return SNAPSHOT_COMPLETED;
}

bool snapshot_is_complete(const snapshot_t *self) {
    return self->begun && (self->received == self->expected);
}

bool snapshot_holds(const snapshot_t *self) {
    const uint32_t expected = self->expected;
    const bool joints_hold = (expected != 0u) && ((expected & (expected + 1u)) == 0u) &&
                             ((self->received & ~expected) == 0u) && (self->begun || (self->received == 0u));
    const bool complete = snapshot_is_complete(self);
    const bool reference_holds =
        complete ? (self->referenced && (self->complete_cycle == self->cycle)) : (self->begun || !self->referenced);
    const bool gap_holds = self->referenced || (self->gap == 0u);
    return joints_hold && reference_holds && gap_holds;
}
