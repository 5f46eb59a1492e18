#include "crc32.h"

#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

static uint32_t crc_of(const char *text, uint32_t length) {
    return crc32_finish(crc32_fold(CRC32_START, (const uint8_t *)text, length));
}

/* Published check values of CRC-32/ISO-HDLC. */
static void test_known_answers(void) {
    TEST_ASSERT_EQUAL_HEX32(0x00000000u, crc_of("", 0u));
    TEST_ASSERT_EQUAL_HEX32(0xCBF43926u, crc_of("123456789", 9u));
    TEST_ASSERT_EQUAL_HEX32(0xD202EF8Du, crc_of("\0", 1u));
    TEST_ASSERT_EQUAL_HEX32(0xE8B7BE43u, crc_of("a", 1u));
}

static void test_slices_give_the_crc_of_the_whole(void) {
    static const uint8_t digits[] = "123456789";
    for (uint32_t cut = 0; cut <= 9u; ++cut) {
        const uint32_t state = crc32_fold(CRC32_START, digits, cut);
        TEST_ASSERT_EQUAL_HEX32(0xCBF43926u, crc32_finish(crc32_fold(state, digits + cut, 9u - cut)));
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_known_answers);
    RUN_TEST(test_slices_give_the_crc_of_the_whole);
    return UNITY_END();
}
