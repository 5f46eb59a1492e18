/* Vector products against double precision, and lengths up to the end of the range. */
#include "vec3.h"

#include "core_fixture.h"

#define TIGHT IF_FIXED(1e-6, 2e-5)

static uint32_t saturations;

void setUp(void) {
    random_start(47);
    saturations = 0;
}
void tearDown(void) {
    TEST_ASSERT_EQUAL(0, saturations);
}

static vec3_t any(double size) {
    return (vec3_t){
        .x = num_of(size * random_one()), .y = num_of(size * random_one()), .z = num_of(size * random_one())};
}

static vec3_t along(uint32_t axis, double size) {
    return (vec3_t){.x = num_of((axis == 0u) ? size : 0.0),
                    .y = num_of((axis == 1u) ? size : 0.0),
                    .z = num_of((axis == 2u) ? size : 0.0)};
}

static void assert_is(double x, double y, double z, vec3_t v) {
    ASSERT_CLOSE(x, value_of(v.x), TIGHT);
    ASSERT_CLOSE(y, value_of(v.y), TIGHT);
    ASSERT_CLOSE(z, value_of(v.z), TIGHT);
}

static void test_sums_and_products(void) {
    for (uint32_t round = 0; round < 20u; ++round) {
        const vec3_t a = any(5.0), b = any(5.0);
        const double ax = value_of(a.x), ay = value_of(a.y), az = value_of(a.z);
        const double bx = value_of(b.x), by = value_of(b.y), bz = value_of(b.z);
        assert_is(ax + bx, ay + by, az + bz, vec3_add(a, b, &saturations));
        assert_is(ax - bx, ay - by, az - bz, vec3_subtract(a, b, &saturations));
        ASSERT_CLOSE(ax * bx + ay * by + az * bz, value_of(vec3_dot(a, b, &saturations)), TIGHT);
        assert_is(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx, vec3_cross(a, b, &saturations));
        assert_is(ax / 4.0, ay / 4.0, az / 4.0, vec3_quarter(a));
    }
}

/* Below and above the size from which on a vector is divided by four. */
static void test_lengths_and_directions_of_every_size(void) {
    static const double size[] = {0.01, 1.0, 100.0, 129.0, 250.0};
    for (uint32_t i = 0; i < sizeof(size) / sizeof(size[0]); ++i) {
        for (uint32_t round = 0; round < 10u; ++round) {
            const vec3_t v = any(size[i]);
            const double x = value_of(v.x), y = value_of(v.y), z = value_of(v.z);
            const double length = sqrt(x * x + y * y + z * z);
            const double coarse = 3e-7 / length; /* steps of Q9.22 */
            const vec3_t unit = vec3_unit(v, &saturations);
            ASSERT_CLOSE(length, value_of(vec3_length(v)), 5e-6 + 3e-7 * length);
            ASSERT_CLOSE(x / length, value_of(unit.x), 1e-6 + coarse);
            ASSERT_CLOSE(y / length, value_of(unit.y), 1e-6 + coarse);
            ASSERT_CLOSE(z / length, value_of(unit.z), 1e-6 + coarse);
        }
    }
}

/* The square of a single component of 400 does not fit into the sums of Q9.22 without the division. */
static void test_each_component_may_be_large(void) {
    for (uint32_t axis = 0; axis < 3u; ++axis) {
        TEST_ASSERT_FALSE(vec3_is_large(along(axis, 127.999)));
        TEST_ASSERT_FALSE(vec3_is_large(along(axis, -127.999)));
        TEST_ASSERT_TRUE(vec3_is_large(along(axis, 128.0)));
        TEST_ASSERT_TRUE(vec3_is_large(along(axis, -128.0)));
        ASSERT_CLOSE(400.0, value_of(vec3_length(along(axis, 400.0))), 1e-4);
        ASSERT_CLOSE(400.0, value_of(vec3_length(along(axis, -400.0))), 1e-4);
        const vec3_t unit = vec3_unit(along(axis, -400.0), &saturations);
        assert_is((axis == 0u) ? -1.0 : 0.0, (axis == 1u) ? -1.0 : 0.0, (axis == 2u) ? -1.0 : 0.0, unit);
    }
}

/* The sum of three such squares does not fit into Q19.44 without the division. */
static void test_all_components_may_be_large(void) {
    const vec3_t v = {.x = NUM(500), .y = NUM(-500), .z = NUM(500)};
    const double third = sqrt(1.0 / 3.0);
    assert_is(third, -third, third, vec3_unit(v, &saturations));
}

static void test_zero_has_no_direction(void) {
    assert_is(0.0, 0.0, 0.0, vec3_unit(along(0u, 0.0), &saturations));
    TEST_ASSERT_TRUE(vec3_length(along(0u, 0.0)) == NUM(0));
}

static void test_the_part_across_a_direction(void) {
    for (uint32_t round = 0; round < 20u; ++round) {
        const vec3_t v = any(5.0);
        const vec3_t direction = vec3_unit(any(1.0), &saturations);
        const double x = value_of(direction.x), y = value_of(direction.y), z = value_of(direction.z);
        const double part = value_of(v.x) * x + value_of(v.y) * y + value_of(v.z) * z;
        assert_is(value_of(v.x) - part * x, value_of(v.y) - part * y, value_of(v.z) - part * z,
                  vec3_across(v, direction, &saturations));
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_sums_and_products);
    RUN_TEST(test_lengths_and_directions_of_every_size);
    RUN_TEST(test_each_component_may_be_large);
    RUN_TEST(test_all_components_may_be_large);
    RUN_TEST(test_zero_has_no_direction);
    RUN_TEST(test_the_part_across_a_direction);
    return UNITY_END();
}
