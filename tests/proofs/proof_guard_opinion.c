/* firmware/guard/guard_opinion.c: any guard, any opinion, any frame. proof_num.c and proof_e2e.c show scale_to_raw and
 * e2e_seal. */
#include "num_stub.h"

#include "guard_any.h"
#include "protocol.c"
#include "raw_stub.h"

void e2e_seal(uint8_t *data, uint8_t length, const uint8_t *data_ids, uint8_t counter) {
    HOLDS((length >= 2u) && (length <= CAN_FRAME_DATA_LENGTH), "what e2e_seal requires");
    HOLDS(__CPROVER_r_ok(data_ids, E2E_DATA_ID_COUNT), "the ids are there");
    data[0] = counter;
    data[1] = (uint8_t)((data[1] & 0xF0u) | (counter & 0x0Fu));
}

#include "guard_opinion.c"

void proof_tell(void) {
    guard_t guard;
    guard_finding_t finding;
    opinion_t opinion;
    uint32_t channel, joint;
    any_guard(&guard);
    ASSUME((finding.wish >= WISH_FAULT) && (finding.wish <= WISH_GO_ON));
    guard_tell(&guard, &finding, &opinion);
    HOLDS(opinion.wish == (uint8_t)finding.wish, "the wish of the finding");
    HOLDS((opinion.healthy == finding.healthy) && (opinion.tested == finding.tested) &&
              (opinion.fresh == finding.fresh),
          "the conditions of the finding");
    HOLDS(opinion.trip_number == guard.trip.number, "the trip of the guard");
    ASSUME((channel < BANK_MAX_CHANNELS) && (joint < ROBOT_MAX_JOINTS));
    HOLDS((opinion.index[channel][joint] >= -LARGEST_U) && (opinion.index[channel][joint] <= LARGEST_U),
          "an index is within its range");
    HOLDS((joint < guard.joints) || ((opinion.residual[joint] == 0) && (opinion.index[channel][joint] == 0)),
          "nothing beyond the joints");
    REACHED;
}

void proof_opinion_event(void) {
    opinion_t opinion;
    const guard_event_t event = opinion_event(&opinion);
    HOLDS(((uint32_t)event.reason == opinion.reason) && (event.joint == opinion.joint), "the event of the opinion");
    REACHED;
}

/* The second channel writes "move" only if it permits itself, for the cycle of this frame. */
void proof_confirm(void) {
    guard_output_t own;
    can_frame_t frame;
    ASSUME((frame.length >= 8u) && (frame.length <= CAN_FRAME_DATA_LENGTH));
    const uint8_t cycle = (uint8_t)(frame.data[CYCLE_BYTE] >> 4u);
    guard_confirm(&own, &frame);
    if ((frame.data[PERMISSION_BYTE] >> 4u) != TAUPERP_STOP_COMMAND_PERMISSION_INVERTED_STOP_CHOICE) {
        HOLDS(own.permitted && !own.withheld, "the second channel permits");
        HOLDS(cycle == (own.cycle & 0x0Fu), "in the cycle of the frame");
    }
    HOLDS(own.full_speed || ((frame.data[SPEED_BYTE] & FULL_SPEED_BIT) == 0u), "full speed only if both allow it");
    REACHED;
}

void proof_join(void) {
    guard_t guard;
    bool second;
    guard_join(&guard, second);
    HOLDS(!guard_is_alone(&guard) && (guard.second == second), "a channel of two");
    REACHED;
}
