#include "draw.h"

#include <string.h>

enum { BEFORE = 60, AFTER = 300 }; /* cycles around a stop of the reference */
static const char *const time_part[TIME_PARTS] = {"clock.fast",    "clock.slow",  "clock.stopped", "clock.back",
                                                  "clock.forward", "tick.missed", "tick.late"};

const char *part_name(uint32_t part) {
    return (part < machine_parts) ? machine_part[part].name : time_part[part - machine_parts];
}

selection_t select_parts(int count, char **names) {
    selection_t chosen = {.count = 0};
    for (uint32_t part = 0; part < (machine_parts + (uint32_t)TIME_PARTS); ++part) {
        bool wanted = (count == 0) && (part < machine_parts);
        for (int i = 0; i < count; ++i) {
            const bool time = part >= machine_parts;
            const bool table = !time && machine_part[part].table;
            chosen.unwatched = chosen.unwatched || (strcmp(names[i], "unwatched") == 0);
            wanted = wanted || (chosen.unwatched && table) || (strcmp(names[i], part_name(part)) == 0) ||
                     ((strcmp(names[i], "time") == 0) && time) || ((strcmp(names[i], "table") == 0) && table) ||
                     ((strcmp(names[i], "state") == 0) && !time && !table);
        }
        if (wanted) {
            chosen.part[chosen.count++] = part;
        }
    }
    return chosen;
}

static uint64_t draw(uint64_t *state) { /* splitmix64 */
    uint64_t z = (*state += 0x9E3779B97F4A7C15u);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

static uint32_t below(uint64_t *state, uint32_t bound) {
    return (uint32_t)((draw(state) >> 32) * bound >> 32);
}

fault_t draw_fault(const reference_t *reference, const selection_t *from, uint64_t seed, uint64_t number) {
    const uint32_t *const parts = from->part;
    uint64_t state = seed ^ (number * 0xD1342543DE82EF95u);
    fault_t fault = {.factor = 1.0, .unwatched = from->unwatched};
    /* Named parts are drawn in proportion to their size, the faults of time uniformly. */
    uint32_t total = 0;
    for (uint32_t i = 0; i < from->count; ++i) {
        total += (parts[i] < machine_parts) ? machine_part[parts[i]].size : 1u;
    }
    uint32_t at = below(&state, total);
    uint32_t chosen = 0;
    while (at >= ((parts[chosen] < machine_parts) ? machine_part[parts[chosen]].size : 1u)) {
        at -= (parts[chosen] < machine_parts) ? machine_part[parts[chosen]].size : 1u;
        ++chosen;
    }
    fault.part = parts[chosen];
    fault.byte = at;
    fault.bit = below(&state, 8u);
    fault.moment = (below(&state, 2u) == 0u) ? BEFORE_STOP : ((below(&state, 2u) == 0u) ? AFTER_STOP : ANYWHERE);
    const uint32_t near = reference->stop[below(&state, reference->stops)];
    switch (fault.moment) {
    case BEFORE_STOP:
        fault.cycle = (near > BEFORE) ? (near - 1u - below(&state, BEFORE)) : below(&state, near);
        break;
    case AFTER_STOP:
        fault.cycle = near + below(&state, AFTER);
        break;
    case ANYWHERE:
    case MOMENTS:
    default:
        fault.cycle = below(&state, reference->cycle_count);
        break;
    }
    const uint32_t last = reference->cycle_count - (uint32_t)HORIZON;
    fault.cycle = (fault.cycle < last) ? fault.cycle : last;
    fault.position = below(&state, reference->cycles[fault.cycle].frames + 1u);
    const double share = (double)below(&state, 1000000u) / 1e6;
    const int64_t period_us = (int64_t)reference->before[0].machine.block.period_us;
    switch ((fault.part >= machine_parts) ? (fault.part - machine_parts) : (uint32_t)TIME_PARTS) {
    case 0:
        fault.factor = 1.02 + 3.0 * share * share;
        break;
    case 1:
        fault.factor = 0.98 * share + 0.001;
        break;
    case 2:
        fault.factor = 0.0;
        break;
    case 3:
        fault.step_us = -(int64_t)(share * 100.0 * (double)period_us) - 1;
        break;
    case 4:
        fault.step_us = (int64_t)(share * 100.0 * (double)period_us) + 1;
        break;
    case 5:
        fault.ticks = 1u + below(&state, 40u);
        break;
    case 6:
        fault.ticks = 1u + below(&state, 3u);
        fault.step_us = (int64_t)(share * (double)period_us);
        break;
    default:
        break;
    }
    return fault;
}
