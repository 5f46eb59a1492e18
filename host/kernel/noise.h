/* noise: counter-based random numbers. A reading's noise depends on its run, cycle and joint only, not on earlier
 * draws. Philox 4x32-10 (Salmon et al., SC11, doi 10.1145/2063384.2063405), normals by Box and Muller.
 */
#ifndef TAUPERP_KERNEL_NOISE_H
#define TAUPERP_KERNEL_NOISE_H

#include <math.h>
#include <stdint.h>

static inline void philox(const uint32_t key_in[2], const uint32_t counter[4], uint32_t out[4]) {
    uint32_t key[2] = {key_in[0], key_in[1]};
    uint32_t x[4] = {counter[0], counter[1], counter[2], counter[3]};
    for (int round = 0; round < 10; ++round) {
        const uint64_t a = (uint64_t)0xD2511F53u * x[0];
        const uint64_t b = (uint64_t)0xCD9E8D57u * x[2];
        const uint32_t next[4] = {(uint32_t)(b >> 32) ^ x[1] ^ key[0], (uint32_t)b, (uint32_t)(a >> 32) ^ x[3] ^ key[1],
                                  (uint32_t)a};
        for (int i = 0; i < 4; ++i) {
            x[i] = next[i];
        }
        key[0] += 0x9E3779B9u;
        key[1] += 0xBB67AE85u;
    }
    for (int i = 0; i < 4; ++i) {
        out[i] = x[i];
    }
}

/* Four independent standard normals for one (seed, run, cycle, joint). */
static inline void normals(uint64_t seed, uint64_t run, uint32_t cycle, uint32_t joint, double out[4]) {
    const uint32_t key[2] = {(uint32_t)seed, (uint32_t)(seed >> 32)};
    const uint32_t counter[4] = {(uint32_t)run, (uint32_t)(run >> 32), cycle, joint};
    uint32_t bits[4];
    philox(key, counter, bits);
    for (int pair = 0; pair < 2; ++pair) {
        const double radius = sqrt(-2.0 * log(((double)bits[2 * pair] + 0.5) * 0x1p-32));
        const double turn = 6.283185307179586 * ((double)bits[2 * pair + 1] * 0x1p-32);
        out[2 * pair] = radius * cos(turn);
        out[2 * pair + 1] = radius * sin(turn);
    }
}

#endif
