/* Tokens that prove that every stage ran: firmware/core/token.h. */
#include "token.h"

#include "core_fixture.h"

void setUp(void) {}
void tearDown(void) {}

static void test_a_token_mixes_its_predecessor_the_stage_and_the_bits_and_is_never_zero(void) {
    TEST_ASSERT_EQUAL_HEX32((((6u * 2654435761u) + 1u) << 1) | 1u, token_next(5u, TOKEN_MOTION, 3u));
    TEST_ASSERT_EQUAL_HEX32((7u << 1) | 1u, token_next(0u, TOKEN_DETECTOR, 0u));
}

static void test_the_bits_of_numbers_depend_on_each_and_on_their_order(void) {
    const num_t values[] = {NUM(1), NUM(-2), NUM(3), NUM(4)};
    uint32_t words[3];
    memcpy(words, values, sizeof words);
    TEST_ASSERT_EQUAL_HEX32((((words[0] << 1) + words[1]) << 1) + words[2], token_bits(values, 3u));
    TEST_ASSERT_EQUAL_HEX32(0u, token_bits(values, 0u));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_token_mixes_its_predecessor_the_stage_and_the_bits_and_is_never_zero);
    RUN_TEST(test_the_bits_of_numbers_depend_on_each_and_on_their_order);
    return UNITY_END();
}
