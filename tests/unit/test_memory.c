/* The boards' own memset and memcpy (firmware/boards/common/memory.c), under other names. */
#include <stdint.h>
#include <string.h>

#define memset board_memset
#define memcpy board_memcpy
#include "../../firmware/boards/common/memory.c"
#undef memset
#undef memcpy

#include "unity.h"

enum { LONGEST = 41, OFFSETS = 8, SIZE = LONGEST + 2 * OFFSETS };

static _Alignas(8) uint8_t to[SIZE], from[SIZE];

void setUp(void) {
    for (uint32_t i = 0; i < SIZE; ++i) {
        to[i] = (uint8_t)(0x80u + i);
        from[i] = (uint8_t)(i * 37u + 1u);
    }
}
void tearDown(void) {}

static void assert_untouched_but(uint32_t begin, uint32_t end) {
    for (uint32_t i = 0; i < SIZE; ++i) {
        if ((i < begin) || (i >= end)) {
            TEST_ASSERT_EQUAL_HEX8(0x80u + i, to[i]);
        }
    }
}

static void test_memory_is_set_from_any_byte_on_and_in_any_length(void) {
    for (uint32_t at = 0; at < OFFSETS; ++at) {
        for (uint32_t length = 0; length <= LONGEST; ++length) {
            setUp();
            TEST_ASSERT_EQUAL_PTR(&to[at],
                                  board_memset(&to[at], 0x1C3 - (int)length, length)); /* an int above a byte */
            for (uint32_t i = at; i < (at + length); ++i) {
                TEST_ASSERT_EQUAL_HEX8(0xC3u - length, to[i]);
            }
            assert_untouched_but(at, at + length);
        }
    }
}

static void test_memory_is_copied_between_any_bytes_and_in_any_length(void) {
    for (uint32_t at = 0; at < OFFSETS; ++at) {
        for (uint32_t source = 0; source < OFFSETS; ++source) {
            for (uint32_t length = 0; length <= LONGEST; ++length) {
                setUp();
                TEST_ASSERT_EQUAL_PTR(&to[at], board_memcpy(&to[at], &from[source], length));
                for (uint32_t i = 0; i < length; ++i) {
                    TEST_ASSERT_EQUAL_HEX8((source + i) * 37u + 1u, to[at + i]);
                }
                assert_untouched_but(at, at + length);
            }
        }
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_memory_is_set_from_any_byte_on_and_in_any_length);
    RUN_TEST(test_memory_is_copied_between_any_bytes_and_in_any_length);
    return UNITY_END();
}
