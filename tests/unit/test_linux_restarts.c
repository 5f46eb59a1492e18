/* Restarts recorded in the service manager's folder: firmware/hosts/linux/restarts.h. */
#include "../../firmware/hosts/linux/restarts.c"

#include <stdio.h>

#include "unity.h"

static char folder[] = "/tmp/tauperp-restarts-XXXXXX";

void setUp(void) {
    (void)memcpy(folder + sizeof folder - 7, "XXXXXX", 6);
    TEST_ASSERT_NOT_NULL(mkdtemp(folder));
    TEST_ASSERT_EQUAL(0, setenv("RUNTIME_DIRECTORY", folder, 1));
}

void tearDown(void) {
    restarts_forget();
    (void)rmdir(folder);
}

static void assert_noted(guard_start_t cause, uint32_t count) {
    const restarts_t restarts = restarts_note();
    TEST_ASSERT_EQUAL(cause, restarts.cause);
    TEST_ASSERT_EQUAL_UINT(count, restarts.count);
}

static void test_a_process_without_a_service_manager_has_a_commanded_start(void) {
    TEST_ASSERT_EQUAL(0, unsetenv("RUNTIME_DIRECTORY"));
    assert_noted(GUARD_START_COMMANDED, 0);
    assert_noted(GUARD_START_COMMANDED, 0);
}

static void test_each_start_after_the_first_is_one_more(void) {
    assert_noted(GUARD_START_COMMANDED, 0);
    assert_noted(GUARD_START_SERVICE, 1);
    assert_noted(GUARD_START_SERVICE, 2);
    restarts_forget();
    assert_noted(GUARD_START_COMMANDED, 0);
}

static void test_a_folder_that_cannot_be_opened_may_hide_any_number(void) {
    TEST_ASSERT_EQUAL(0, setenv("RUNTIME_DIRECTORY", "/nowhere/at/all", 1));
    assert_noted(GUARD_START_UNKNOWN, GUARD_MAX_RESTARTS);
}

/* /dev/full reads as zeros and refuses every write. */
static void test_a_count_that_cannot_be_written_may_hide_any_number(void) {
    char path[PATH_MAX];
    TEST_ASSERT_TRUE(path_of(path));
    TEST_ASSERT_EQUAL(0, symlink("/dev/full", path));
    assert_noted(GUARD_START_UNKNOWN, GUARD_MAX_RESTARTS);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_process_without_a_service_manager_has_a_commanded_start);
    RUN_TEST(test_each_start_after_the_first_is_one_more);
    RUN_TEST(test_a_folder_that_cannot_be_opened_may_hide_any_number);
    RUN_TEST(test_a_count_that_cannot_be_written_may_hide_any_number);
    return UNITY_END();
}
