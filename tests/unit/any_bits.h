/* any_bits: numbers that no frame can carry. Float: all exponents, subnormals, infinities and NaN. Q9.22: every
 * int32_t. */
#ifndef ANY_BITS_H
#define ANY_BITS_H

#include "core_fixture.h"

static inline uint32_t random_bits(void) {
    return (uint32_t)((random_one() + 1.0) * 2147483648.0);
}

/* One in three is arbitrary. The others are from the edges of the arithmetic, or ordinary numbers. */
static inline num_t any(void) {
    const uint32_t choice = random_bits() >> 16;
    num_t number;
    uint32_t bits = random_bits();
    if ((choice % 3u) == 1u) {
#ifdef TAUPERP_FIXED
        const uint32_t edges[] = {0u, 1u, 0xFFFFFFFFu, 0x7FFFFFFFu, 0x80000000u, 0x80000001u, 1u << (bits % 32u)};
#else
        const uint32_t edges[] = {0u,          0x80000000u, 1u,          0x007FFFFFu, 0x00800000u, 0x7F7FFFFFu,
                                  0xFF7FFFFFu, 0x7F800000u, 0xFF800000u, 0x7FC00000u, 0x7F800001u, 0x5F7FFFFFu,
                                  0x5F3504F3u, 0x1F800000u, 0x3F800000u, 0xBF800000u};
#endif
        bits = edges[(choice / 3u) % (sizeof(edges) / sizeof(edges[0]))];
    } else if ((choice % 3u) == 2u) {
        return num_of(4.0 * random_one());
    } else {
        /* unchanged */
    }
    memcpy(&number, &bits, sizeof(number));
    return number;
}

/* Its square fits into a float; the sum of a few squares may not. */
static inline num_t huge(void) {
    return IF_FIXED(num_of(500.0 * random_one()), num_of(ldexp(random_one(), 63)));
}

static inline void any_of(num_t to[], uint32_t count) {
    for (uint32_t i = 0; i < count; ++i) {
        to[i] = any();
    }
}

/* A matrix of n rows and k columns, with every mixture of ordinary numbers and arbitrary bits; zero after them. */
static inline void any_columns(num_t column[][ROBOT_MAX_JOINTS], uint32_t columns, uint32_t n, uint32_t k) {
    const uint32_t kinds = random_bits() % 8u;
    memset(column, 0, columns * sizeof(column[0]));
    for (uint32_t c = 0; c < k; ++c) {
        for (uint32_t j = 0; j < n; ++j) {
            column[c][j] = (kinds == 7u) ? huge() : (((c % 4u) < kinds) ? any() : num_of(random_one()));
        }
    }
}

#endif
