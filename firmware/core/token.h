/* token: proof that every stage ran on the input of this tick.
 *
 * The first stage makes a token from its input. Each later stage makes one from the token of the previous stage. The
 * caller clears all tokens before a tick and computes the expected last token. A stage that did not run leaves zero, or
 * the token of another input, and every later token is then wrong.
 */
#ifndef TAUPERP_TOKEN_H
#define TAUPERP_TOKEN_H

#include "num.h"

typedef enum {
    TOKEN_MOTION = 1,
    TOKEN_OBSERVER = 2,
    TOKEN_ACCELERATION = 3,
    TOKEN_INDEX = 4,
    TOKEN_EXPLAINED = 5,
    TOKEN_BANK = 6,
    TOKEN_DETECTOR = 7,
    TOKEN_REGRESSOR = 8,
    TOKEN_SIGHT = 9
} token_stage_t;

/* Token of a stage from the previous stage's token and the bits of this stage's input. Never zero: bit 0 is set. */
static inline uint32_t token_next(uint32_t before, token_stage_t stage, uint32_t bits) {
    return ((((before ^ bits) * 2654435761u) + (uint32_t)stage) << 1) | 1u;
}

static inline uint32_t token_bits(const num_t values[], uint32_t number) {
    uint32_t bits = 0;
    for (uint32_t i = 0; i < number; ++i) {
        uint32_t word;
        __builtin_memcpy(&word, &values[i], sizeof(word));
        bits = (bits << 1) + word;
    }
    return bits;
}

#endif
