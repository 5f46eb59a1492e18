/* mutant_tests: a Unity program whose tests register themselves instead of running. Included before the program. */
#include "unity.h"

void mutant_register(const char *name, void (*test)(void));
int mutant_tests(void);

#undef RUN_TEST
#define RUN_TEST(test) mutant_register(#test, test)
#undef UNITY_BEGIN
#define UNITY_BEGIN() ((void)0)
#undef UNITY_END
#define UNITY_END() 0
#define main        mutant_tests
