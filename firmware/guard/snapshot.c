#include "snapshot.h"

#include <string.h>

#define NIBBLE_MASK   0x0Fu
#define NIBBLE_BEHIND 8u /* nibble distances from here on count as the past */

bool snapshot_init(snapshot_t *self, uint32_t joint_count) {
    (void)memset(self, 0, sizeof(*self));
    if ((joint_count < 1u) || (joint_count > ROBOT_MAX_JOINTS)) {
        return false;
    }
    self->expected = (uint8_t)(((uint32_t)1 << joint_count) - 1u);
    return true;
}

void snapshot_restart(snapshot_t *self) {
    const uint8_t expected = self->expected;
    (void)memset(self, 0, sizeof(*self));
    self->expected = expected;
}

void snapshot_begin(snapshot_t *self, uint16_t cycle) {
    self->cycle = cycle;
    self->received = 0u;
    self->begun = true;
    self->taken = false;
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
    return (self->received == self->expected) ? SNAPSHOT_COMPLETED : SNAPSHOT_TAKEN;
}

bool snapshot_is_complete(const snapshot_t *self) {
    return self->begun && (self->received == self->expected) && !self->taken;
}

uint32_t snapshot_take(snapshot_t *self) {
    const uint32_t gap = self->referenced ? (uint16_t)(self->cycle - self->taken_cycle) : 0u;
    self->taken_cycle = self->cycle;
    self->taken = true;
    self->referenced = true;
    return gap;
}

bool snapshot_is_valid(const snapshot_t *self) {
    const uint32_t expected = self->expected;
    const bool joints_valid = (expected != 0u) && ((expected & (expected + 1u)) == 0u) &&
                              ((self->received & ~expected) == 0u) && (self->begun || (self->received == 0u));
    const bool taken_valid =
        !self->taken || (self->referenced && (self->received == self->expected) && (self->taken_cycle == self->cycle));
    return joints_valid && taken_valid && (self->begun || !self->referenced);
}
