/* The expected reaction of the guard to its frames, decided from the fault of each. */
#include "soak.h"

#include <stdio.h>
#include <stdlib.h>

const char *const fault_names[FAULT_COUNT] = {"none",    "lost",   "corrupt", "repeated", "delayed", "reordered",
                                              "address", "length", "format",  "status",   "range",   "inserted"};

static _Noreturn void breach(const soak_t *self, const char *what, const sent_t *sent) {
    (void)fprintf(stderr, "soak: cycle %" PRIu64 ": %s", self->cycle, what);
    if (sent != NULL) {
        (void)fprintf(stderr, " (fault %s, id %03x, cycle %" PRIu64 ")", fault_names[sent->fault], sent->frame.id,
                      sent->cycle);
    }
    (void)fprintf(stderr, "; state %d, reason %d\n", (int)self->out.state, (int)self->out.reason);
    exit(1);
}

/* Finds the counter that moved, and checks that at most one did. */
static void account(soak_t *self, const sent_t *sent, const guard_counters_t *before) {
    const guard_counters_t *const after = &self->guard.counters;
    tally_t *const tally = &self->tally;
    const uint32_t crc = (uint32_t)(after->crc_errors - before->crc_errors);
    const uint32_t sequence = (uint32_t)(after->sequence_errors - before->sequence_errors);
    const uint32_t range = (uint32_t)(after->range_errors - before->range_errors);
    const uint32_t format = (uint32_t)(after->format_errors - before->format_errors);
    const uint32_t late = (uint32_t)(after->late_frames - before->late_frames);
    const uint32_t moved = crc + sequence + range + format + late;
    tally->frames++;
    tally->crc += crc;
    tally->sequence += sequence;
    tally->range += range;
    tally->format += format;
    tally->late += late;
    if (moved > 1u) {
        breach(self, "a frame moved more than one counter", sent);
    }
    const uint32_t slot = protocol_slot(sent->frame.id);
    if ((moved == 0u) && (slot < (uint32_t)PROTOCOL_RECEIVE_COUNT) && !self->seen[slot]) {
        tally->initial++;
    } else if (moved == 0u) {
        tally->accepted++;
    } else {
        /* refused */
    }
    if ((slot < (uint32_t)PROTOCOL_RECEIVE_COUNT) && ((moved == 0u) || (sequence + range + late > 0u))) {
        self->seen[slot] = true;
    }
    if ((moved == 0u) && !sent->genuine) {
        breach(self, "the guard accepted a frame that the robot did not send in this form", sent);
    }
    const bool stop_command = (sent->frame.id == protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND].id) &&
                              ((sent->frame.flags & (uint8_t)CAN_FRAME_EXTENDED) == 0u);
    self->bad_value = self->bad_value || (range > 0u) || stop_command;
}

/* The robot's knowledge: intact frames in the order of their arrival. */
static void note_intact(soak_t *self, const sent_t *sent) {
    if (!sent->genuine) {
        return;
    }
    if (sent->kind == (uint8_t)PROTOCOL_KIND_SYNC) {
        self->good_sync = self->cycle + 1u;
        self->sync_in = sent->cycle == self->cycle;
        self->joints_in = 0;
    } else if ((sent->kind == (uint8_t)PROTOCOL_KIND_JOINT_STATE) && (sent->cycle == self->cycle) && self->sync_in) {
        self->joints_in |= 1u << sent->joint;
    } else if ((sent->kind == (uint8_t)PROTOCOL_KIND_JOINT_STATE) && !self->sync_in) {
        self->joints_in |= 1u << sent->joint; /* of a delayed Sync's cycle */
    } else if (sent->kind == (uint8_t)PROTOCOL_KIND_TASK_COMMAND) {
        self->good_task = self->cycle + 1u;
    } else if ((sent->kind == (uint8_t)PROTOCOL_KIND_GUARD_RESET) && self->stopped &&
               (sent->frame.data[2] == self->out.trip_number)) {
        self->reset_sent = self->reset_sent || ((sent->frame.data[1] & 0x10u) != 0u);
    } else {
        /* of another cycle */
    }
    if (self->joints_in == ((1u << self->joints) - 1u)) {
        self->good_joints = self->cycle + 1u;
    }
}

void deliver(soak_t *self, uint64_t now_us) {
    self->sync_in = false;
    self->joints_in = 0;
    self->bad_value = false;
    for (uint32_t i = 0; i < self->queued; i++) {
        const guard_counters_t before = self->guard.counters;
        guard_receive(&self->guard, &self->queue[i].frame, now_us);
        account(self, &self->queue[i], &before);
        note_intact(self, &self->queue[i]);
    }
}

void judge(soak_t *self) {
    const guard_config_t *const config = self->config;
    const bool permitted = self->out.permitted;
    const uint64_t now = self->cycle + 1u;
    if (permitted && ((now - self->good_sync) > (config->sync_deadline_us / config->period_us))) {
        breach(self, "permitted without Sync", NULL);
    }
    if (permitted && ((now - self->good_joints) > (config->joint_deadline_us / config->period_us))) {
        breach(self, "permitted without readings", NULL);
    }
    if (permitted && ((now - self->good_task) > (config->task_deadline_us / config->period_us))) {
        breach(self, "permitted without a task", NULL);
    }
    if (permitted && self->bad_value) {
        breach(self, "permitted on a sensor fault, a value out of range or another guard's StopCommand", NULL);
    }
    if (permitted && self->stopped && !self->reset_sent) {
        breach(self, "permitted after a stop without a reset", NULL);
    }
    if (permitted && (self->cycle + 1u == self->push_until)) {
        breach(self, "permitted during a push", NULL);
    }
    if (self->out.state == GUARD_STATE_FAULT) {
        breach(self, "the guard is in FAULT", NULL);
    }
    if (permitted) {
        self->stopped = false;
        self->reset_sent = false;
    }
    /* While it waits for its first permission it may also be stopped, by another guard's StopCommand. */
    const bool latched = self->out.state == GUARD_STATE_STOPPED;
    if (!permitted && (self->was_permitted || (latched && !self->stopped))) {
        self->stopped = true;
        self->reset_sent = false;
        self->tally.trips += self->was_permitted ? 1u : 0u;
    }
    self->tally.resets += (permitted && !self->was_permitted) ? 1u : 0u;
    self->tally.ticks++;
    self->tally.permitted += permitted ? 1u : 0u;
    self->was_permitted = permitted;
}
