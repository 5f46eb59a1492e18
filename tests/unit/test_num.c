#include "num.h"

#include "core_fixture.h"

static uint32_t saturations;

void setUp(void) {
    saturations = 0;
}
void tearDown(void) {}

#define STEP (1.0 / 4194304.0) /* of Q9.22 */

static void test_a_literal_is_the_nearest_number(void) {
    TEST_ASSERT_TRUE(NUM(0) == num_from_int(0));
    TEST_ASSERT_TRUE(NUM(-3) == num_from_int(-3));
    TEST_ASSERT_TRUE(NUM(511) == num_from_int(511));
    ASSERT_CLOSE(0.1, value_of(NUM(0.1)), 0.5 * STEP);
    ASSERT_CLOSE(-0.1, value_of(NUM(-0.1)), 0.5 * STEP);
    ASSERT_CLOSE(-1e-5, value_of(NUM(-1e-5)), 0.5 * STEP);
    ASSERT_CLOSE(327.67, value_of(NUM(327.67)), IF_FIXED(0.5 * STEP, 1.6e-5));
}

static void test_size_minimum_and_maximum(void) {
    TEST_ASSERT_TRUE(num_abs(NUM(-2.5)) == NUM(2.5));
    TEST_ASSERT_TRUE(num_abs(NUM(2.5)) == NUM(2.5));
    TEST_ASSERT_TRUE(num_abs(NUM(0)) == NUM(0));
    TEST_ASSERT_TRUE(num_min(NUM(-1), NUM(2)) == NUM(-1));
    TEST_ASSERT_TRUE(num_min(NUM(2), NUM(-1)) == NUM(-1));
    TEST_ASSERT_TRUE(num_max(NUM(-1), NUM(2)) == NUM(2));
    TEST_ASSERT_TRUE(num_max(NUM(2), NUM(-1)) == NUM(2));
}

/* Relative error in float; steps of Q9.22 in fixed point. */
static void assert_near(double expected, num_t actual, double steps) {
    ASSERT_CLOSE(expected, value_of(actual), IF_FIXED(steps * STEP, steps * 1.2e-7 * fabs(expected) + 1e-38));
}

static void test_products_and_quotients_are_rounded_once(void) {
    random_start(51);
    for (int i = 0; i < DRAWS(300000); ++i) {
        const num_t a = num_of(22.0 * random_one()), b = num_of(22.0 * random_one());
        assert_near(value_of(a) * value_of(b), num_mul(a, b, &saturations), 0.5001);
        assert_near(value_of(a) * value_of(b), num_narrow(num_wide(a, b), &saturations), 0.5001);
        if (fabs(value_of(b)) > 0.05) {
            assert_near(value_of(a) / value_of(b), num_div(a, b, &saturations), 0.5001);
        }
        ASSERT_CLOSE(value_of(a) + value_of(b), value_of(num_add(a, b, &saturations)), IF_FIXED(0.0, 4e-6));
        ASSERT_CLOSE(value_of(a) - value_of(b), value_of(num_subtract(a, b, &saturations)), IF_FIXED(0.0, 4e-6));
        TEST_ASSERT_TRUE(num_narrow(num_widen(a), &saturations) == a);
    }
    TEST_ASSERT_EQUAL(0, saturations);
}

static void test_a_sum_of_products_is_rounded_once_in_fixed_point(void) {
    random_start(52);
    for (int i = 0; i < DRAWS(100000); ++i) {
        num_wide_t sum = num_widen(NUM(0));
        double exact = 0.0;
        for (int t = 0; t < 8; ++t) {
            const num_t a = num_of(60.0 * random_one()), b = num_of(0.9 * random_one());
            sum += num_wide(a, b);
            exact += value_of(a) * value_of(b);
        }
        ASSERT_CLOSE(exact, value_of(num_narrow(sum, &saturations)), IF_FIXED(0.5001 * STEP, 1e-4));
    }
    TEST_ASSERT_EQUAL(0, saturations);
}

static void test_the_largest_sum_of_products_fits(void) {
    num_wide_t sum = num_widen(NUM(0));
    for (int t = 0; t < 8; ++t) {
        sum += num_wide(NUM(511), NUM(63.9)); /* the sanitizer watches */
    }
    (void)num_narrow(sum, &saturations);
    TEST_ASSERT_EQUAL(IF_FIXED(1, 0), saturations);
}

/* Every float exponent, and in fixed point every size of square from one bit on. */
static void test_a_root_is_the_nearest_over_the_whole_range(void) {
    TEST_ASSERT_TRUE(num_root(num_widen(NUM(0))) == NUM(0));
    TEST_ASSERT_TRUE(num_root(num_wide(NUM(13), NUM(13))) == NUM(13));
    random_start(53);
#ifdef TAUPERP_FIXED
    TEST_ASSERT_EQUAL(0, num_root(-5));
    TEST_ASSERT_EQUAL(INT32_MAX, num_root(INT64_MAX));
    for (int64_t square = 0; square < DRAWS(200000); ++square) {
        TEST_ASSERT_EQUAL((num_t)lrint(sqrt((double)square)), num_root(square));
    }
    for (int i = 0; i < DRAWS(2000000); ++i) {
        const int64_t square = (int64_t)exp2(random_in(0.0, 61.99));
        const uint64_t root = (uint64_t)num_root(square);
        const uint64_t x = (uint64_t)square;
        TEST_ASSERT_TRUE((root * root < x + root + 1u) && (x <= root * root + root)); /* (r - 1/2)^2 to (r + 1/2)^2 */
    }
    for (uint64_t root = 1; root < 2147483647u; root += 1u + root / 3000u) {
        const uint64_t around[] = {root * root - 1u, root * root, root * root + root, root * root + root + 1u};
        const uint64_t nearest[] = {(root == 1u) ? 0u : root, root, root, root + 1u};
        for (uint32_t i = 0; i < 4u; ++i) {
            TEST_ASSERT_EQUAL_UINT32(nearest[i], num_root((int64_t)around[i]));
        }
    }
#else
    for (int i = 0; i < DRAWS(1000000); ++i) {
        const float square = (float)exp2(random_in(-126.0, 126.0));
        TEST_ASSERT_TRUE(num_root(square) == (float)sqrt((double)square));
    }
#endif
}

static void test_a_number_over_a_root_keeps_its_bound(void) {
    random_start(54);
    for (int i = 0; i < DRAWS(1000000); ++i) {
        const double length = exp2(random_in(-4.0, 8.9));
        const num_t a = num_of(length * random_one());
        const num_wide_t square = num_wide(num_of(length), num_of(length));
        const double exact = value_of(a) / value_of(num_of(length));
        ASSERT_CLOSE(exact, value_of(num_times(a, num_inverse_root(square), &saturations)),
                     IF_FIXED(0.5001 * STEP + 3e-9, 2.4e-7));
    }
    TEST_ASSERT_EQUAL(0, saturations);
}

/* Within the wire's angles and far beyond; every 2^-10 of a turn's neighbourhood as well. */
static void test_sine_and_cosine_keep_their_bound_for_every_angle(void) {
    double worst = 0.0;
    random_start(55);
    const double range = IF_FIXED(511.9, 32.0);
    for (int i = 0; i < DRAWS(4000000); ++i) {
        const num_t angle = num_of((i % 2 == 0) ? range * random_one() : 8.0 * random_one());
        const num_sincos_t result = num_sincos(angle);
        worst = fmax(worst, fabs(value_of(result.sin) - sin(value_of(angle))));
        worst = fmax(worst, fabs(value_of(result.cos) - cos(value_of(angle))));
    }
    for (int quarter = -20; quarter <= 20; ++quarter) {
        for (int i = -2000; i <= 2000; ++i) { /* where the quarter changes */
            const num_t angle = num_of(quarter * 0.78539816339744831 + i * STEP);
            const num_sincos_t result = num_sincos(angle);
            worst = fmax(worst, fabs(value_of(result.sin) - sin(value_of(angle))));
            worst = fmax(worst, fabs(value_of(result.cos) - cos(value_of(angle))));
        }
    }
    printf("sine and cosine: worst error %.3g\n", worst);
    TEST_ASSERT_TRUE(worst <= IF_FIXED(0.52 * STEP, 1.2e-7));
}

static void test_sine_and_cosine_stay_in_range_for_any_bits(void) {
    random_start(56);
    for (int i = 0; i < DRAWS(1000000); ++i) {
        const uint32_t bits = (uint32_t)((random_one() + 1.0) * 2147483647.5);
        num_t angle;
        memcpy(&angle, &bits, sizeof(angle));
        const num_sincos_t result = num_sincos(angle);
        if (num_finite(angle) && (fabs(value_of(angle)) < 1e5)) {
            TEST_ASSERT_TRUE(fabs(value_of(result.sin)) <= 1.0001);
            TEST_ASSERT_TRUE(fabs(value_of(result.cos)) <= 1.0001);
        }
    }
}

static void test_only_numbers_are_finite(void) {
    TEST_ASSERT_TRUE(num_finite(NUM(0)));
    TEST_ASSERT_TRUE(num_finite(NUM(-511)));
#ifndef TAUPERP_FIXED
    TEST_ASSERT_TRUE(num_finite(3.4e38f));
    TEST_ASSERT_FALSE(num_finite(NAN));
    TEST_ASSERT_FALSE(num_finite(INFINITY));
    TEST_ASSERT_FALSE(num_finite(-INFINITY));
#else
    TEST_ASSERT_TRUE(num_finite(INT32_MIN));
#endif
}

/* Two columns of random length and angle: what the rotation leaves between them, and their lengths. */
static void test_a_rotation_makes_two_columns_orthogonal(void) {
    random_start(57);
    for (int i = 0; i < DRAWS(200000); ++i) {
        const double far = 31.0, near = far * exp2(random_in(-14.0, 0.0)), angle = 3.14159 * random_one();
        double a[2] = {far, 0.0}, b[2] = {near * cos(angle), near * sin(angle)};
        if (i % 2 == 0) {
            const double c[2] = {a[0], a[1]};
            memcpy(a, b, sizeof(a));
            memcpy(b, c, sizeof(b));
        }
        const num_t x[2] = {num_of(a[0]), num_of(a[1])}, y[2] = {num_of(b[0]), num_of(b[1])};
        num_wide_t first = num_wide(x[0], x[0]) + num_wide(x[1], x[1]);
        num_wide_t second = num_wide(y[0], y[0]) + num_wide(y[1], y[1]);
        const num_wide_t inner = num_wide(x[0], y[0]) + num_wide(x[1], y[1]);
        if (num_orthogonal(first, second, inner, NUM_ANGLE(20))) {
            continue;
        }
        const num_rotation_t turn = num_orthogonalise(&first, &second, inner);
        const double c = value_of(turn.cos), s = value_of(turn.sin);
        ASSERT_CLOSE(1.0, c * c + s * s, IF_FIXED(3.5e-7, 3e-7));
        TEST_ASSERT_TRUE(c > 0.7071); /* the smaller of the two angles */
        double p[2], q[2], across = 0.0, square[2] = {0.0, 0.0};
        for (int k = 0; k < 2; ++k) {
            p[k] = c * value_of(x[k]) - s * value_of(y[k]);
            q[k] = s * value_of(x[k]) + c * value_of(y[k]);
            across += p[k] * q[k];
            square[0] += p[k] * p[k];
            square[1] += q[k] * q[k];
        }
        const double scale = far * far;
        ASSERT_CLOSE(0.0, across, 4e-7 * scale);
        ASSERT_CLOSE(square[0], IF_FIXED((double)first / 17592186044416.0, (double)first), 1e-6 * scale);
        ASSERT_CLOSE(square[1], IF_FIXED((double)second / 17592186044416.0, (double)second), 1e-6 * scale);
    }
}

static void test_orthogonal_columns_need_no_rotation(void) {
    const num_wide_t square = num_wide(NUM(20), NUM(20)), small = num_wide(NUM(0.01), NUM(0.01));
    const num_wide_t none = num_widen(NUM(0));
    TEST_ASSERT_TRUE(num_orthogonal(square, square, none, NUM_ANGLE(20)));
    TEST_ASSERT_TRUE(num_orthogonal(square, small, none, NUM_ANGLE(20)));
    TEST_ASSERT_TRUE(num_orthogonal(square, none, none, NUM_ANGLE(20)));
    TEST_ASSERT_FALSE(num_orthogonal(square, square, num_wide(NUM(0.1), NUM(0.1)), NUM_ANGLE(20)));
    TEST_ASSERT_FALSE(num_orthogonal(square, small, num_wide(NUM(20), NUM(0.001)), NUM_ANGLE(20)));
    TEST_ASSERT_FALSE(num_orthogonal(small, square, -num_wide(NUM(20), NUM(0.001)), NUM_ANGLE(20)));
}

/* A block scaled by its headroom has its largest size from 16 to 32, and comes back as it was. A float stays. */
static void test_headroom_and_back(void) {
    random_start(58);
    TEST_ASSERT_EQUAL(0, num_headroom(NUM(0)));
    for (int i = 0; i < DRAWS(100000); ++i) {
        const num_t a = num_of(exp2(random_in(-21.0, 8.99)));
        const int32_t shift = num_headroom(a);
        const num_t scaled = num_shift(a, shift, &saturations);
        TEST_ASSERT_TRUE(IF_FIXED((scaled >= NUM(16)) && (scaled < NUM(32)), scaled == a));
        ASSERT_CLOSE(value_of(a), value_of(num_shift(scaled, -shift, &saturations)), IF_FIXED(16.0 * STEP, 0.0));
        if (shift >= 0) {
            TEST_ASSERT_TRUE(num_shift(scaled, -shift, &saturations) == a);
            TEST_ASSERT_TRUE(num_shift(-scaled, -shift, &saturations) == -a);
        }
    }
    TEST_ASSERT_EQUAL(0, saturations);
}

/* What does not fit is held at the end of the range and counted; a float has nothing to count. */
static void test_what_does_not_fit_saturates_and_is_counted(void) {
#ifdef TAUPERP_FIXED
    uint32_t counted = 0;
    const struct {
        num_t result, expected;
    } cases[] = {
        {num_mul(NUM(30), NUM(30), &saturations), INT32_MAX},
        {num_mul(NUM(-30), NUM(30), &saturations), -INT32_MAX},
        {num_mul(INT32_MIN, INT32_MIN, &saturations), INT32_MAX},
        {num_add(NUM(300), NUM(300), &saturations), INT32_MAX},
        {num_add(INT32_MIN, INT32_MIN, &saturations), -INT32_MAX},
        {num_subtract(NUM(-300), NUM(300), &saturations), -INT32_MAX},
        {num_subtract(INT32_MAX, INT32_MIN, &saturations), INT32_MAX},
        {num_narrow(INT64_MAX, &saturations), INT32_MAX},
        {num_narrow(INT64_MIN, &saturations), -INT32_MAX},
        {num_div(NUM(100), NUM(0.1), &saturations), INT32_MAX},
        {num_div(NUM(-100), NUM(0.1), &saturations), -INT32_MAX},
        {num_div(NUM(3), NUM(0), &saturations), INT32_MAX},
        {num_div(NUM(-3), NUM(0), &saturations), -INT32_MAX},
        {num_div(NUM(0), NUM(0), &saturations), INT32_MAX},
        {num_div(INT32_MIN, 1, &saturations), -INT32_MAX},
        {num_shift(NUM(300), 1, &saturations), INT32_MAX},
        {num_shift(-1, 31, &saturations), -INT32_MAX},
        {num_times(NUM(1), num_inverse_root(0), &saturations), INT32_MAX},
    };
    for (uint32_t i = 0; i < sizeof(cases) / sizeof(cases[0]); ++i) {
        TEST_ASSERT_EQUAL_INT32(cases[i].expected, cases[i].result);
        ++counted;
    }
    TEST_ASSERT_EQUAL(counted, saturations);
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, num_abs(INT32_MIN));
    TEST_ASSERT_EQUAL_INT32(NUM(511), num_from_int(INT32_MAX));
    TEST_ASSERT_EQUAL_INT32(NUM(-511), num_from_int(INT32_MIN));
    /* The last ones that fit are not counted. */
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, num_add(INT32_MAX - 1, 1, &saturations));
    TEST_ASSERT_EQUAL_INT32(-INT32_MAX, num_subtract(-INT32_MAX, 0, &saturations));
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, num_narrow((int64_t)INT32_MAX * 4194304, &saturations));
    TEST_ASSERT_EQUAL(counted, saturations);
#else
    TEST_ASSERT_TRUE(num_mul(1e30f, 1e30f, &saturations) == INFINITY);
    TEST_ASSERT_TRUE(num_div(-3.0f, 0.0f, &saturations) == -INFINITY);
    TEST_ASSERT_EQUAL(0, saturations);
#endif
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_literal_is_the_nearest_number);
    RUN_TEST(test_size_minimum_and_maximum);
    RUN_TEST(test_products_and_quotients_are_rounded_once);
    RUN_TEST(test_a_sum_of_products_is_rounded_once_in_fixed_point);
    RUN_TEST(test_the_largest_sum_of_products_fits);
    RUN_TEST(test_a_root_is_the_nearest_over_the_whole_range);
    RUN_TEST(test_a_number_over_a_root_keeps_its_bound);
    RUN_TEST(test_sine_and_cosine_keep_their_bound_for_every_angle);
    RUN_TEST(test_sine_and_cosine_stay_in_range_for_any_bits);
    RUN_TEST(test_only_numbers_are_finite);
    RUN_TEST(test_a_rotation_makes_two_columns_orthogonal);
    RUN_TEST(test_orthogonal_columns_need_no_rotation);
    RUN_TEST(test_headroom_and_back);
    RUN_TEST(test_what_does_not_fit_saturates_and_is_counted);
    return UNITY_END();
}
