/* The two functions that compilers call implicitly, working by four words. Those of newlib-nano work byte by byte, with
 * four instructions each. That adds hundreds of instructions to a tick that clears or copies structs. */
#include <stddef.h>
#include <stdint.h>

/* Otherwise the compiler replaces these loops by calls of these functions. */
#define BY_ITSELF __attribute__((optimize("no-tree-loop-distribute-patterns")))

typedef uint32_t __attribute__((may_alias)) word_t;

/* Moved by one load and one store of several registers. */
typedef struct __attribute__((may_alias)) {
    uint32_t word[4];
} words_t;

/* NOLINTBEGIN(misc-use-internal-linkage): the compiler calls these two where it clears and copies structs */
void *memset(void *to, int byte, size_t length);
void *memcpy(void *restrict to, const void *restrict from, size_t length);
/* NOLINTEND(misc-use-internal-linkage) */

BY_ITSELF void *memset(void *to, int byte, size_t length) {
    uint8_t *at = to;
    uint8_t *const end = at + length;
    const uint32_t word = (uint32_t)(uint8_t)byte * 0x01010101u;
    while ((at != end) && (((uintptr_t)at % sizeof(word_t)) != 0u)) {
        *at++ = (uint8_t)byte;
    }
    for (; (size_t)(end - at) >= sizeof(words_t); at += sizeof(words_t)) {
        ((words_t *)at)->word[0] = word;
        ((words_t *)at)->word[1] = word;
        ((words_t *)at)->word[2] = word;
        ((words_t *)at)->word[3] = word;
    }
    for (; (size_t)(end - at) >= sizeof(word_t); at += sizeof(word_t)) {
        *(word_t *)at = word;
    }
    while (at != end) {
        *at++ = (uint8_t)byte;
    }
    return to;
}

BY_ITSELF void *memcpy(void *restrict to, const void *restrict from, size_t length) {
    uint8_t *at = to;
    uint8_t *const end = at + length;
    const uint8_t *source = from;
    if ((((uintptr_t)at | (uintptr_t)source) % sizeof(word_t)) == 0u) {
        for (; (size_t)(end - at) >= sizeof(words_t); at += sizeof(words_t), source += sizeof(words_t)) {
            *(words_t *)at = *(const words_t *)source;
        }
        for (; (size_t)(end - at) >= sizeof(word_t); at += sizeof(word_t), source += sizeof(word_t)) {
            *(word_t *)at = *(const word_t *)source;
        }
    }
    while (at != end) {
        *at++ = *source++;
    }
    return to;
}
