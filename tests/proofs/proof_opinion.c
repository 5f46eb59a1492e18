/* firmware/guard/opinion.c: any two opinions, any state of the comparison. */
#include "proof.h"

#include "opinion.c"

void proof_agree(void) {
    agree_t agree;
    opinion_t own, other;
    uint32_t joint, channel;
    const uint32_t apart = agree.apart;
    const uint32_t waited_us = agree.wait_us;
    ASSUME((joint < OPINION_MAX_JOINTS) && (channel < OPINION_MAX_CHANNELS));
    if (agree_step(&agree, &own, &other)) {
        const int64_t residual = (int64_t)own.residual[joint] - other.residual[joint];
        const int64_t index = (int64_t)own.index[channel][joint] - other.index[channel][joint];
        const bool measured = own.state > (uint8_t)GUARD_STATE_SELF_TEST;
        HOLDS((own.trip_number == other.trip_number) && (own.task == other.task) && (own.cycle == other.cycle),
              "what must be equal is");
        HOLDS(agree.apart <= AGREE_TICKS, "no number was beyond its bound for longer");
        HOLDS(!measured || (apart < AGREE_TICKS) || ((residual <= AGREE_RESIDUAL) && (residual >= -AGREE_RESIDUAL)),
              "a residual is beyond its bound in AGREE_TICKS ticks at most");
        HOLDS(!measured || (apart < AGREE_TICKS) || (waited_us > own.period_us) || own.hard || own.saturated ||
                  other.saturated || ((index <= AGREE_INDEX) && (index >= -AGREE_INDEX)),
              "an index is beyond its bound in AGREE_TICKS ticks at most");
        HOLDS(!own.hard || (own.rank == other.rank) || (agree.rank_us < AGREE_RANK_MAX_US),
              "ranks do not differ for longer");
    }
    REACHED;
}

void proof_opinion_worse(void) {
    opinion_t first, second;
    const opinion_t *const worse = opinion_worse(&first, &second);
    HOLDS((worse == &first) || (worse == &second), "one of both");
    HOLDS((worse->wish <= first.wish) && (worse->wish <= second.wish), "no wish is worse");
    REACHED;
}
