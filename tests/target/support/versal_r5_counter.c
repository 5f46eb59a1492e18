#include "counter.h"

#include "pmu.h"

void counter_init(void) {
    pmu_init();
}

uint32_t counter_read(void) {
    return pmu_cycles();
}

uint32_t counter_instructions(uint32_t from, uint32_t to) {
    return to - from;
}
