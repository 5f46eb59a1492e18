/* bits: a hash of the bits of results, for seeded inputs: the same from every compiler, on every target.
 *
 * Each expected hash was recorded from this firmware. It says nothing about accuracy, which the other programs hold
 * against closed forms in double. It says that no bit changed unnoticed. An intended change of the arithmetic needs new
 * hashes: the failing test prints them.
 */
#ifndef BITS_H
#define BITS_H

#include "core_fixture.h"

#define COLUMNS SUBSPACE_MAX_COLUMNS

static uint32_t hash; /* FNV-1a over 32-bit words */

static inline void fold(uint32_t word) {
    hash = (hash ^ word) * 16777619u;
}

static inline void fold_number(num_t number) {
    uint32_t word;
    memcpy(&word, &number, sizeof(word));
    fold(num_finite(number) ? word : 1u); /* processors differ in the bits of what is not a number */
}

static inline void fold_numbers(const num_t numbers[], uint32_t count) {
    for (uint32_t i = 0; i < count; ++i) {
        fold_number(numbers[i]);
    }
}

static inline void assert_hash(uint32_t expected) {
    char text[80];
    snprintf(text, sizeof(text), "the bits have the hash 0x%08X", (unsigned)hash);
    TEST_ASSERT_TRUE_MESSAGE(hash == expected, text);
}

static inline void start_hash(uint64_t seed) {
    hash = 2166136261u;
    random_start(seed);
}

#endif
