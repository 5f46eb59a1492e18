/* A reflector maps a vector onto an axis, whatever the vector's size. */
#include "reflector.h"

#include "core_fixture.h"

#define END 6u

static num_t x[ROBOT_MAX_JOINTS];
static uint32_t saturations;

void setUp(void) {
    saturations = 0;
}
void tearDown(void) {
    TEST_ASSERT_EQUAL(0, saturations);
}

/* u has the squared length 2 and is parallel to x - image e. Only entries `at` to END - 1 are used and written. */
static void assert_reflects(uint32_t at, double size) {
    double before[ROBOT_MAX_JOINTS];
    double square = 0.0;
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        const bool used = (i >= at) && (i < END);
        x[i] = used ? num_of(size * random_one()) : NUM(7);
        before[i] = value_of(x[i]);
        square += used ? before[i] * before[i] : 0.0;
    }
    const double image = value_of(reflector_make(x, at, END, &saturations));
    ASSERT_CLOSE(sqrt(square), fabs(image), 4e-7 + 4e-7 * sqrt(square));
    TEST_ASSERT_TRUE(image * before[at] <= 0.0); /* no cancellation */
    double length = 0.0;
    double along = 0.0;
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        if ((i < at) || (i >= END)) {
            TEST_ASSERT_TRUE(x[i] == NUM(7));
        } else {
            length += value_of(x[i]) * value_of(x[i]);
            along += value_of(x[i]) * before[i];
        }
    }
    ASSERT_CLOSE(2.0, length, 6e-6);
    for (uint32_t i = at; i < END; ++i) {
        const double expected = (i == at) ? image : 0.0;
        ASSERT_CLOSE(expected, before[i] - along * value_of(x[i]), 4e-7 + 4e-6 * size);
    }
}

static void test_a_vector_of_any_size_is_mapped_onto_its_axis(void) {
    static const double sizes[] = {30.0, 1.0, 0.02, 0.001};
    random_start(77);
    for (uint32_t k = 0; k < 4u; ++k) {
        for (uint32_t round = 0; round < 20u; ++round) {
            assert_reflects(round % 3u, sizes[k]);
        }
    }
}

static void test_a_reflection_maps_its_own_vector_onto_the_axis(void) {
    num_t u[REFLECTOR_ROWS];
    num_t image_of[REFLECTOR_ROWS];
    random_start(78);
    for (uint32_t i = 0; i < REFLECTOR_ROWS; ++i) {
        x[i] = num_of(random_one());
        u[i] = x[i];
        image_of[i] = NUM(7);
    }
    const num_t image = reflector_make(u, 1u, REFLECTOR_ROWS, &saturations);
    reflector_apply(u, x, image_of, 1u, &saturations);
    TEST_ASSERT_TRUE(image_of[0] == NUM(7));
    for (uint32_t i = 1; i < REFLECTOR_ROWS; ++i) {
        ASSERT_CLOSE((i == 1u) ? value_of(image) : 0.0, value_of(image_of[i]), 4e-6);
    }
}

/* The largest entry may be in any place. */
static void test_one_large_entry_among_small_ones(void) {
    for (uint32_t place = 0; place < END; ++place) {
        for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
            x[i] = (i == place) ? NUM(-40) : NUM(0.5);
        }
        const double image = value_of(reflector_make(x, 0u, END, &saturations));
        ASSERT_CLOSE(sqrt(1600.0 + 5.0 * 0.25), fabs(image), 2e-5);
    }
}

static void test_the_reflection_maps_its_vector_onto_the_axis(void) {
    num_t before[ROBOT_MAX_JOINTS], after[ROBOT_MAX_JOINTS];
    random_start(78);
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        x[i] = num_of(3.0 * random_one());
        before[i] = x[i];
    }
    const double image = value_of(reflector_make(x, 0u, REFLECTOR_ROWS, &saturations));
    reflector_apply(x, before, after, 0u, &saturations);
    for (uint32_t i = 0; i < REFLECTOR_ROWS; ++i) {
        ASSERT_CLOSE((i == 0u) ? image : 0.0, value_of(after[i]), 2e-5);
    }
}

static void test_zero_has_no_reflection(void) {
    memset(x, 0, sizeof(x));
    TEST_ASSERT_TRUE(reflector_make(x, 0u, END, &saturations) == NUM(0));
    for (uint32_t i = 0; i < END; ++i) {
        TEST_ASSERT_TRUE(x[i] == NUM(0));
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_reflection_maps_its_own_vector_onto_the_axis);
    RUN_TEST(test_a_vector_of_any_size_is_mapped_onto_its_axis);
    RUN_TEST(test_one_large_entry_among_small_ones);
    RUN_TEST(test_the_reflection_maps_its_vector_onto_the_axis);
    RUN_TEST(test_zero_has_no_reflection);
    return UNITY_END();
}
