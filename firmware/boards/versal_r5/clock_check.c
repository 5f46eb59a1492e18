#include "clock_check.h"

#include "pmu.h"

#define US_PER_S  1000000u
#define TOLERANCE 20u /* 1 / 20: 5 % */

bool clock_agrees(uint32_t cycles, uint32_t counts, uint32_t hz) {
    if ((counts == 0u) || (hz == 0u)) {
        return false;
    }
    /* cycles / (counts / hz), in Hz */
    const uint64_t found = ((uint64_t)cycles * hz) / counts;
    const uint64_t wanted = (uint64_t)PMU_CYCLES_PER_US * US_PER_S;
    const uint64_t apart = (found > wanted) ? (found - wanted) : (wanted - found);
    return apart <= (wanted / TOLERANCE);
}
