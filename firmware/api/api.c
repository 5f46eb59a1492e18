#include "guard.h"

#include <stddef.h>

#include "scale.h"
#include "schedule.h"
#include "tauperp.h"

typedef struct {
    guard_t guard;
    schedule_t schedule;
    guard_output_t out; /* a member, to keep it off the stack */
} state_t;

_Static_assert(sizeof(state_t) <= sizeof(tauperp_guard_t), "TAUPERP_GUARD_BYTES is too small");
_Static_assert(_Alignof(state_t) <= _Alignof(tauperp_guard_t), "the storage is not aligned for the state");
_Static_assert((TAUPERP_MAX_JOINTS == ROBOT_MAX_JOINTS) && (TAUPERP_MAX_FRAMES == GUARD_MAX_FRAMES), "as inside");
_Static_assert(((uint32_t)TAUPERP_FRAME_FD == (uint32_t)CAN_FRAME_FD) &&
                   ((uint32_t)TAUPERP_FRAME_BRS == (uint32_t)CAN_FRAME_BRS) &&
                   ((uint32_t)TAUPERP_FRAME_EXTENDED == (uint32_t)CAN_FRAME_EXTENDED) &&
                   ((uint32_t)TAUPERP_FRAME_REMOTE == (uint32_t)CAN_FRAME_REMOTE),
               "as inside");
_Static_assert(((uint32_t)TAUPERP_START_POWER_ON == (uint32_t)GUARD_START_POWER_ON) &&
                   ((uint32_t)TAUPERP_START_SERVICE == (uint32_t)GUARD_START_SERVICE) &&
                   ((uint32_t)TAUPERP_STATE_MONITORING == (uint32_t)GUARD_STATE_MONITORING) &&
                   ((uint32_t)TAUPERP_STATE_FAULT == (uint32_t)GUARD_STATE_FAULT) &&
                   ((uint32_t)TAUPERP_REASON_BUS_OFF == (uint32_t)GUARD_REASON_BUS_OFF) &&
                   ((uint32_t)TAUPERP_REASON_SHUTDOWN == (uint32_t)GUARD_REASON_SHUTDOWN) &&
                   (TAUPERP_OK == (uint32_t)GUARD_OK),
               "as inside");

#define MILLI     SCALE(0.001F, 0, 1u, 1000)
#define LARGEST_M 512000

static state_t *state_of(tauperp_guard_t *self) {
    return (state_t *)(void *)self;
}

static const state_t *const_state_of(const tauperp_guard_t *self) {
    return (const state_t *)(const void *)self;
}

static int32_t milli(num_t value) {
    return scale_to_raw(value, MILLI, -LARGEST_M, LARGEST_M);
}

uint32_t tauperp_init(tauperp_guard_t *self, const void *block, size_t block_size, uint32_t start, uint32_t restarts,
                      uint64_t now_us) {
    state_t *state = state_of(self);
    const guard_config_t *config = (const guard_config_t *)block;
    guard_status_t status = GUARD_BAD_SIZE;
    state->guard = (guard_t){0};
    if (block_size == sizeof(guard_config_t)) {
        status = guard_init(&state->guard, config);
    }
    const bool accepted = status == GUARD_OK;
    if (accepted) {
        const bool known = (start <= (uint32_t)GUARD_START_SERVICE);
        guard_note_start(&state->guard, known ? (guard_start_t)start : GUARD_START_UNKNOWN, restarts,
                         GUARD_VARIANT_PRODUCT);
    }
    schedule_init(&state->schedule, accepted ? config : NULL, false, now_us);
    return (uint32_t)status;
}

bool tauperp_receive(tauperp_guard_t *self, const tauperp_frame_t *frame, uint64_t now_us) {
    state_t *state = state_of(self);
    can_frame_t inside = {.id = frame->id, .length = frame->length, .flags = frame->flags};
    for (uint32_t i = 0; i < CAN_FRAME_DATA_LENGTH; ++i) {
        inside.data[i] = frame->data[i];
    }
    schedule_hear(&state->schedule, &inside, now_us);
    guard_receive(&state->guard, &inside, now_us);
    return schedule_complete(&state->schedule, guard_cycle_complete(&state->guard));
}

bool tauperp_is_due(const tauperp_guard_t *self, uint64_t now_us) {
    return now_us >= tauperp_due_us(self);
}

uint64_t tauperp_due_us(const tauperp_guard_t *self) {
    return const_state_of(self)->schedule.due_us;
}

void tauperp_tick(tauperp_guard_t *self, uint64_t now_us, tauperp_output_t *out) {
    state_t *state = state_of(self);
    const guard_output_t *inside = &state->out;
    guard_tick(&state->guard, now_us, &state->out);
    schedule_ticked(&state->schedule, now_us, inside->fresh);
    *out = (tauperp_output_t){.permitted = inside->permitted,
                              .state = (uint8_t)inside->state,
                              .reason = (uint8_t)inside->reason,
                              .stop_category = inside->stop_category,
                              .task = inside->task,
                              .joint = inside->joint,
                              .trip_number = inside->trip_number,
                              .frame_count = (uint8_t)inside->frame_count};
    for (uint32_t i = 0; i < GUARD_MAX_FRAMES; ++i) {
        const can_frame_t *from = &inside->frame[i];
        out->frame[i] = (tauperp_frame_t){.id = from->id, .length = from->length, .flags = from->flags};
        for (uint32_t j = 0; j < CAN_FRAME_DATA_LENGTH; ++j) {
            out->frame[i].data[j] = from->data[j];
        }
    }
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        out->residual_mnm[i] = milli(inside->residual[i]);
        out->index_mnm[i] = milli(inside->index[i]);
        out->threshold_mnm[i] = milli(inside->threshold[i]);
    }
}

void tauperp_note_tick_time(tauperp_guard_t *self, uint32_t tick_us) {
    guard_note_tick_time(&state_of(self)->guard, tick_us);
}

void tauperp_trip(tauperp_guard_t *self, uint32_t reason) {
    guard_trip(&state_of(self)->guard, (guard_reason_t)reason);
}
