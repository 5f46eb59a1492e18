/* The loader of the Linux process: its messages for a file that is not a block for this robot. */
#include "../../firmware/hosts/linux/block.c"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include "guard_fixture.h"

static char said[256];

void complain(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(said, sizeof said, format, arguments);
    va_end(arguments);
}

void setUp(void) {
    said[0] = '\0';
}

void tearDown(void) {}

static const void *second;

static const guard_config_t *loaded(const void *content, size_t size) {
    char path[] = "/tmp/tauperp-block-XXXXXX";
    const int file = mkstemp(path);
    TEST_ASSERT_TRUE(file >= 0);
    TEST_ASSERT_EQUAL(size, write(file, content, size));
    (void)close(file);
    const guard_config_t *const block = block_load(path, "ku_dex", &second);
    (void)unlink(path);
    return block;
}

static void test_a_block_for_the_robot_is_loaded(void) {
    const guard_config_t config = make_config();
    const guard_config_t *const block = loaded(&config, sizeof config);
    TEST_ASSERT_NOT_NULL(block);
    TEST_ASSERT_EQUAL_MEMORY(&config, block, sizeof config);
    TEST_ASSERT_EQUAL_STRING("", said);
    TEST_ASSERT_NULL(second);
    (void)munmap((void *)(uintptr_t)block, 2u * sizeof config + 1u);
}

static void test_the_block_of_the_second_channel_follows_the_first(void) {
    guard_config_t both[2] = {make_config(), make_config()};
    both[1].robot.name[0] = 'x'; /* pair_init compares the two */
    const guard_config_t *const block = loaded(both, sizeof both);
    TEST_ASSERT_EQUAL_MEMORY(&both[0], block, sizeof both[0]);
    TEST_ASSERT_EQUAL_MEMORY(&both[1], second, sizeof both[1]);
    TEST_ASSERT_EQUAL_STRING("", said);
    (void)munmap((void *)(uintptr_t)block, sizeof both + 1u);
}

static void test_a_file_between_one_block_and_two_is_refused(void) {
    const guard_config_t both[2] = {make_config(), make_config()};
    TEST_ASSERT_NULL(loaded(both, sizeof both - 1u));
    TEST_ASSERT_NOT_NULL(strstr(said, "two channels have two of them"));
    TEST_ASSERT_NULL(loaded(both, sizeof both[0] + 1u));
    TEST_ASSERT_NOT_NULL(strstr(said, "two channels have two of them"));
}

static void test_a_name_is_printed_without_control_characters(void) {
    guard_config_t config = make_config();
    memcpy(config.robot.name, "\x1b[2J\nx\x7fy\xff", 10u);
    TEST_ASSERT_NULL(loaded(&config, sizeof config));
    TEST_ASSERT_NOT_NULL(strstr(said, "the block is for the robot '?[2J?x?y?', not for 'ku_dex'"));
}

static void test_a_file_that_is_too_short_is_refused(void) {
    const guard_config_t config = make_config();
    TEST_ASSERT_NULL(loaded(&config, sizeof config - 1u));
    TEST_ASSERT_NOT_NULL(strstr(said, "bytes, a configuration block of this firmware has"));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_block_for_the_robot_is_loaded);
    RUN_TEST(test_the_block_of_the_second_channel_follows_the_first);
    RUN_TEST(test_a_file_between_one_block_and_two_is_refused);
    RUN_TEST(test_a_name_is_printed_without_control_characters);
    RUN_TEST(test_a_file_that_is_too_short_is_refused);
    return UNITY_END();
}
