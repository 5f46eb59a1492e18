/* The worse of two reasons: firmware/guard/guard_reason.h. */
#include "guard_reason.h"

#include "unity.h"

#define UNKNOWN ((guard_reason_t)200)

void setUp(void) {}
void tearDown(void) {}

static void test_an_unknown_number_has_the_class_unknown(void) {
    TEST_ASSERT_EQUAL(REASON_UNKNOWN, reason_class((guard_reason_t)GUARD_REASON_COUNT));
    TEST_ASSERT_EQUAL(REASON_UNKNOWN, reason_class(UNKNOWN));
    TEST_ASSERT_NOT_EQUAL(REASON_UNKNOWN, reason_class((guard_reason_t)(GUARD_REASON_COUNT - 1u)));
}

static void test_no_reason_is_worse_than_none(void) {
    TEST_ASSERT_EQUAL(GUARD_REASON_UNINITIALISED, reason_worse(GUARD_REASON_UNINITIALISED, GUARD_REASON_NONE));
    TEST_ASSERT_EQUAL(GUARD_REASON_NONE, reason_worse(GUARD_REASON_NONE, GUARD_REASON_UNINITIALISED));
    TEST_ASSERT_EQUAL(GUARD_REASON_SETTLING, reason_worse(GUARD_REASON_NONE, GUARD_REASON_SETTLING));
    TEST_ASSERT_EQUAL(GUARD_REASON_SETTLING, reason_worse(GUARD_REASON_UNINITIALISED, GUARD_REASON_SETTLING));
    TEST_ASSERT_EQUAL(GUARD_REASON_SETTLING, reason_worse(GUARD_REASON_SETTLING, GUARD_REASON_UNINITIALISED));
}

static void test_the_worse_class_stays_and_of_one_class_the_first(void) {
    TEST_ASSERT_EQUAL(GUARD_REASON_BUS_OFF, reason_worse(GUARD_REASON_SENSOR_STATUS, GUARD_REASON_BUS_OFF));
    TEST_ASSERT_EQUAL(GUARD_REASON_BUS_OFF, reason_worse(GUARD_REASON_BUS_OFF, GUARD_REASON_SENSOR_STATUS));
    TEST_ASSERT_EQUAL(GUARD_REASON_INPUT_RANGE, reason_worse(GUARD_REASON_INPUT_RANGE, GUARD_REASON_SENSOR_STATUS));
    TEST_ASSERT_EQUAL(GUARD_REASON_STATE_CORRUPT, reason_worse(GUARD_REASON_BUS_OFF, GUARD_REASON_STATE_CORRUPT));
}

static void test_an_unknown_reason_ranks_with_fault(void) {
    TEST_ASSERT_EQUAL(UNKNOWN, reason_worse(GUARD_REASON_BUS_OFF, UNKNOWN));
    TEST_ASSERT_EQUAL(UNKNOWN, reason_worse(UNKNOWN, GUARD_REASON_STATE_CORRUPT));
    TEST_ASSERT_EQUAL(GUARD_REASON_STATE_CORRUPT, reason_worse(GUARD_REASON_STATE_CORRUPT, UNKNOWN));
}

static void test_a_contact_is_a_computed_value_above_its_limit(void) {
    static const guard_reason_t contact[] = {GUARD_REASON_COLLISION, GUARD_REASON_SUDDEN, GUARD_REASON_EXPLAINED_FORCE,
                                             GUARD_REASON_EXPLAINED_MOMENT, GUARD_REASON_RESIDUAL_LIMIT};
    enum { CONTACTS = sizeof(contact) / sizeof(contact[0]) };
    uint32_t found = 0;
    for (uint32_t reason = 0; reason <= 255u; ++reason) {
        found += reason_is_contact((guard_reason_t)reason) ? 1u : 0u;
    }
    TEST_ASSERT_EQUAL(CONTACTS, found);
    for (uint32_t i = 0; i < (uint32_t)CONTACTS; ++i) {
        TEST_ASSERT_TRUE(reason_is_contact(contact[i]));
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_an_unknown_number_has_the_class_unknown);
    RUN_TEST(test_no_reason_is_worse_than_none);
    RUN_TEST(test_the_worse_class_stays_and_of_one_class_the_first);
    RUN_TEST(test_an_unknown_reason_ranks_with_fault);
    RUN_TEST(test_a_contact_is_a_computed_value_above_its_limit);
    return UNITY_END();
}
