/* The reciprocal root for every one of its 3 * 2^30 arguments, which is cheaper than a proof:
 *   - the mantissa is 2^30 to 2^31, which num_times requires;
 *   - a number times the inverse root of its square or of a larger one is at most 1, before rounding, plus 4.7e-9: no
 *     entry of a unit vector is larger, and no cosine or sine of num_rotation is larger than 2^30 + 6;
 *   - in num_root, one step of Heron's method stays within 32 bits. Its first root depends on the upper 32 bits of the
 *     square only;
 *   - the root of a square up to 2^58 is at most 2^29 + 2, for the largest square with these 32 bits. A smaller square
 *     with more leading zeros has a first root of at most half of that.
 * Exit code 0: it holds. */
#include <stdbool.h>
#include <stdio.h>

#include "num.h"

/* The error and half of num_root, for one square. */
static bool step_fits(uint64_t x, uint64_t root) {
    const int64_t error = (int64_t)(x - (root * root)) / 128;
    const int64_t half = (int64_t)(root / 128u);
    const int64_t most = (int64_t)INT32_MAX - (1 << 27) - half;
    return (error <= most) && (error >= -most);
}

/* num_root adds at most 2 to what Heron's step leaves. */
static bool root_fits(uint64_t top, uint64_t y) {
    const uint64_t x = (top << 26) | 0x3FFFFFFu;
    const int64_t root = (int64_t)((top * y) >> 33);
    const int64_t error = (int64_t)(x - (uint64_t)(root * root)) / 128;
    const int64_t half = root / 128;
    return (root + ((error + ((error < 0) ? -half : half)) / (2 * half))) <= ((int64_t)1 << 29);
}

static bool unit_fits(uint64_t top, uint64_t y) {
    const unsigned __int128 limit = ((unsigned __int128)1 << 92) + ((unsigned __int128)5 << 63);
    return ((unsigned __int128)(top + 1u) * (y * y)) <= limit; /* y * y is at most 2^62 */
}

int main(void) {
    uint64_t wrong = 0;
    for (uint64_t top = (uint64_t)1 << 30; top < ((uint64_t)1 << 32); ++top) {
        const uint64_t y = num_newton((uint32_t)top);
        bool holds = (y >= ((uint64_t)1 << 30)) && (y <= ((uint64_t)1 << 31));
        const uint32_t leading = (top >= ((uint64_t)1 << 31)) ? 2u : 0u; /* a square is below 2^63 */
        const uint64_t root = (top * y) >> (30u + (leading / 2u));
        const uint64_t least = (top << 32) >> leading;
        holds = holds && step_fits(least, root) && step_fits(least + (0xFFFFFFFFu >> leading), root);
        wrong += (holds && root_fits(top, y) && unit_fits(top, y)) ? 0u : 1u;
    }
    printf("%llu of %llu arguments are wrong\n", (unsigned long long)wrong, 3ull << 30);
    return (wrong == 0u) ? 0 : 1;
}
