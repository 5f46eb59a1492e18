/* Sine, cosine, root and reciprocal over the whole range of the numbers: bit patterns at equal distances from one end
 * to the other, with the bounds in num_float.h and num_fixed.h. */
#include "core_fixture.h"

#define STEP (1.0 / 4194304.0) /* of Q9.22 */

static uint32_t saturations;

void setUp(void) {
    saturations = 0;
}
void tearDown(void) {}

/* A prime, so that every low digit occurs. On an emulated processor the distance is larger. */
#define STRIDE (997u * SPARSER)

#ifdef TAUPERP_FIXED

static void test_sine_and_cosine_of_every_angle(void) {
    double worst = 0.0;
    for (int64_t bits = -(int64_t)INT32_MAX; bits <= INT32_MAX; bits += STRIDE) {
        const double angle = (double)bits * STEP;
        const num_sincos_t result = num_sincos((num_t)bits);
        worst = fmax(worst, fabs(value_of(result.sin) - sin(angle)));
        worst = fmax(worst, fabs(value_of(result.cos) - cos(angle)));
    }
    printf("%.3f steps\n", worst / STEP);
    TEST_ASSERT_TRUE(worst <= 0.52 * STEP);
}

/* From the smallest number up. Only results that do not fit saturate and are counted. */
static void test_the_reciprocal_of_every_number(void) {
    double worst = 0.0;
    uint32_t held = 0;
    for (int64_t bits = 1; bits <= INT32_MAX; bits += (bits < 100000) ? 1 + SPARSER : STRIDE) {
        for (int sign = -1; sign <= 1; sign += 2) {
            const num_t x = (num_t)(sign * bits);
            const double exact = 1.0 / value_of(x);
            const num_t found = num_div(NUM(1), x, &saturations);
            if (fabs(exact) >= 512.0 - 0.5 * STEP) {
                TEST_ASSERT_EQUAL_INT32(sign * INT32_MAX, found);
                ++held;
            } else {
                worst = fmax(worst, fabs(value_of(found) - exact));
            }
            TEST_ASSERT_EQUAL(held, saturations);
        }
    }
    printf("%.4f steps\n", worst / STEP);
    TEST_ASSERT_TRUE(worst <= 0.5001 * STEP);
}

/* Of squares of every size, times the largest number that keeps the result in range. */
static void test_a_number_over_the_root_of_every_square(void) {
    double worst = 0.0;
    for (uint32_t size = 0; size < 62u; ++size) {
        for (uint32_t i = 0; i < 20000u / SPARSER; ++i) {
            const uint64_t low = (uint64_t)1 << size;
            const int64_t square = (int64_t)(low + ((low / 20000u) * (i * SPARSER)));
            const double root = sqrt((double)square * STEP * STEP);
            const double largest = fmin(511.0, 500.0 * root);
            const num_t a = num_of(((i % 2u) == 0u) ? largest : -0.37 * largest);
            const double exact = value_of(a) / root;
            const double error = fabs(value_of(num_times(a, num_inverse_root(square), &saturations)) - exact);
            worst = fmax(worst, (error - 3e-9 * fabs(exact)) / STEP);
        }
    }
    printf("%.4f steps beyond 3e-9 of the result\n", worst);
    TEST_ASSERT_TRUE(worst <= 0.501);
    TEST_ASSERT_EQUAL(0, saturations);
}

static void test_the_root_of_every_square(void) {
    for (uint32_t size = 0; size < 62u; ++size) {
        for (uint32_t i = 0; i < 20000u / SPARSER; ++i) {
            const uint64_t low = (uint64_t)1 << size;
            const uint64_t x = low + ((low / 20000u) * (i * SPARSER));
            const uint64_t root = (uint64_t)num_root((int64_t)x);
            TEST_ASSERT_TRUE((root * root < x + root + 1u) && (x <= root * root + root));
        }
    }
}

#else

static float float_of(uint32_t bits) {
    float x;
    memcpy(&x, &bits, sizeof(x));
    return x;
}

enum { SMALLEST_NORMAL = 0x00800000, INFINITE = 0x7F800000 };

/* Both signs; up to 32 rad with the bound, beyond within -1.0001 to 1.0001. */
static void test_sine_and_cosine_of_every_angle(void) {
    double worst = 0.0;
    for (uint32_t bits = 0; bits < (uint32_t)INFINITE; bits += STRIDE) {
        for (uint32_t sign = 0; sign < 2u; ++sign) {
            const float angle = float_of(bits | (sign << 31));
            const num_sincos_t result = num_sincos(angle);
            if (fabs((double)angle) <= 32.0) {
                worst = fmax(worst, fabs((double)result.sin - sin((double)angle)));
                worst = fmax(worst, fabs((double)result.cos - cos((double)angle)));
            } else if (fabs((double)angle) < 1e5) {
                TEST_ASSERT_TRUE(fabs((double)result.sin) <= 1.0001);
                TEST_ASSERT_TRUE(fabs((double)result.cos) <= 1.0001);
            } else {
                /* the sign returned */
            }
        }
    }
    printf("%.3g\n", worst);
    TEST_ASSERT_TRUE(worst <= 1.2e-7);
}

/* To half a unit in the last place, wherever the result is a normal number. */
static void test_the_reciprocal_of_every_number(void) {
    double worst = 0.0;
    for (uint32_t bits = (uint32_t)SMALLEST_NORMAL; bits < (uint32_t)INFINITE; bits += STRIDE) {
        const double x = (double)float_of(bits);
        if (x < 8.5e37) {
            worst = fmax(worst, fabs((double)num_div(NUM(1), float_of(bits), &saturations) * x - 1.0));
            worst = fmax(worst, fabs((double)num_div(NUM(-1), float_of(bits), &saturations) * x + 1.0));
        }
    }
    printf("%.3g of the result\n", worst);
    TEST_ASSERT_TRUE(worst <= 6e-8);
}

/* Two roundings and that of the product. */
static void test_a_number_over_the_root_of_every_square(void) {
    double worst = 0.0;
    for (uint32_t bits = (uint32_t)SMALLEST_NORMAL; bits < (uint32_t)INFINITE; bits += STRIDE) {
        const float square = float_of(bits);
        const double root = sqrt((double)square);
        worst = fmax(worst, fabs((double)num_times(NUM(3), num_inverse_root(square), &saturations) * root / 3.0 - 1.0));
    }
    printf("%.3g of the result\n", worst);
    TEST_ASSERT_TRUE(worst <= 1.8e-7);
}

/* Rounded to nearest, exactly like double precision. Includes subnormal squares. */
static void test_the_root_of_every_square(void) {
    for (uint32_t bits = 0; bits < (uint32_t)INFINITE; bits += STRIDE) {
        TEST_ASSERT_TRUE(num_root(float_of(bits)) == (float)sqrt((double)float_of(bits)));
    }
}

#endif

/* In float nothing is limited. */
static void test_a_factor_of_a_product_in_a_sum_is_below_64(void) {
    TEST_ASSERT_TRUE(num_narrow_factor(num_wide(NUM(-9), NUM(7)), &saturations) == NUM(-63));
    TEST_ASSERT_TRUE(num_factor(NUM(63.5), &saturations) == NUM(63.5));
    TEST_ASSERT_TRUE(num_factor(NUM(-63.5), &saturations) == NUM(-63.5));
    TEST_ASSERT_EQUAL(0, saturations);
#ifdef TAUPERP_FIXED
    const num_t most = NUM(64) - 1;
    TEST_ASSERT_EQUAL_INT32(most, num_factor(most, &saturations));
    TEST_ASSERT_EQUAL_INT32(-most, num_factor(-most, &saturations));
    TEST_ASSERT_EQUAL_INT32(most, num_narrow_factor(num_widen(most), &saturations));
    TEST_ASSERT_EQUAL_INT32(-most, num_narrow_factor(num_widen(-most), &saturations));
    TEST_ASSERT_EQUAL(0, saturations);
    TEST_ASSERT_EQUAL_INT32(most, num_factor(most + 1, &saturations));
    TEST_ASSERT_EQUAL_INT32(-most, num_factor(-most - 1, &saturations));
    TEST_ASSERT_EQUAL_INT32(most, num_narrow_factor(num_widen(most) + 1, &saturations));
    TEST_ASSERT_EQUAL_INT32(-most, num_narrow_factor(num_widen(-most) - 1, &saturations));
    TEST_ASSERT_EQUAL(4, saturations);
#else
    TEST_ASSERT_TRUE(num_factor(NUM(1e9), &saturations) == NUM(1e9));
    TEST_ASSERT_TRUE(num_narrow_factor(NUM(1e9), &saturations) == NUM(1e9));
    TEST_ASSERT_EQUAL(0, saturations);
#endif
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_sine_and_cosine_of_every_angle);
    RUN_TEST(test_the_reciprocal_of_every_number);
    RUN_TEST(test_a_number_over_the_root_of_every_square);
    RUN_TEST(test_the_root_of_every_square);
    RUN_TEST(test_a_factor_of_a_product_in_a_sum_is_below_64);
    return UNITY_END();
}
