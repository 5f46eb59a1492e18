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
        sum += num_wide(NUM(511), NUM(63.9)); /* the sanitizer checks for overflow */
    }
    (void)num_narrow(sum, &saturations);
    TEST_ASSERT_EQUAL(IF_FIXED(1, 0), saturations);
}

/* Every float exponent; in fixed point every size of square, from one bit up. */
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

/* Angles of the wire and far beyond, and the neighbourhood of every 2^-10 of a revolution. */
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
        for (int i = -2000; i <= 2000; ++i) { /* where the quarter turn changes */
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

static double unit_of(num_unit_t x) {
    return IF_FIXED((double)x / 1073741824.0, (double)x);
}

/* Pairs of every size and angle; in float from the smallest that is rotated. */
static void test_a_rotation_turns_a_pair_onto_the_first_axis(void) {
    random_start(57);
    for (int i = 0; i < DRAWS(200000); ++i) {
        const double size = exp2(random_in(IF_FIXED(-21.0, -49.0), 8.4)), angle = 3.1415926 * random_one();
        const num_t x = num_of(size * cos(angle)), y = num_of(size * sin(angle));
        const num_rotation_t turn = num_rotation(x, y, &saturations);
        const double c = unit_of(turn.cos), s = unit_of(turn.sin), length = hypot(value_of(x), value_of(y));
        ASSERT_CLOSE(1.0, c * c + s * s, IF_FIXED(1.2e-8, 4e-7));
        ASSERT_CLOSE(length, value_of(turn.length), IF_FIXED(0.51 * STEP + 6e-9 * length, 3e-7 * length));
        ASSERT_CLOSE(0.0, c * value_of(y) - s * value_of(x), IF_FIXED(2e-9, 3e-7) * length);
    }
    const num_rotation_t none = num_rotation(NUM(0), NUM(0), &saturations);
    TEST_ASSERT_TRUE((unit_of(none.cos) == 1.0) && (unit_of(none.sin) == 0.0) && (none.length == NUM(0)));
    TEST_ASSERT_EQUAL(0, saturations);
}

/* Of symmetric matrices as in the projection: squares of entries up to 40. */
static void test_the_smaller_eigenvalue_is_within_a_millionth_of_the_larger(void) {
    random_start(59);
    for (int i = 0; i < DRAWS(200000); ++i) {
        const double scale = exp2(random_in(-12.0, 0.0));
        num_t a = num_of(40.0 * random_one()), b = num_of(40.0 * scale * random_one());
        const num_t c = num_of(40.0 * scale * random_one());
        num_wide_t first = num_wide(a, a), last = num_wide(b, b) + num_wide(c, c);
        const num_wide_t inner = num_wide(a, b);
        if (i % 2 == 0) {
            const num_wide_t kept = first;
            first = last;
            last = kept;
        }
        const double unit = IF_FIXED(17592186044416.0, 1.0);
        const double p = (double)first / unit, q = (double)last / unit, r = (double)inner / unit;
        const double expected = 0.5 * (p + q) - hypot(0.5 * (p - q), r);
        ASSERT_CLOSE(expected, (double)num_smaller_eigenvalue(first, last, inner) / unit, 1e-6 * (p + q));
    }
    const num_wide_t two = num_widen(NUM(2)), three = num_widen(NUM(3)), none = num_widen(NUM(0));
    TEST_ASSERT_TRUE(num_smaller_eigenvalue(three, two, none) == two);
    TEST_ASSERT_TRUE(num_smaller_eigenvalue(two, three, none) == two);
    TEST_ASSERT_TRUE(num_smaller_eigenvalue(two, two, none) == two);
}

static void test_a_shifted_rotation_uses_the_square_minus_the_shift(void) {
    random_start(60);
    for (int i = 0; i < DRAWS(200000); ++i) {
        const double scale = exp2(random_in(-12.0, 0.0));
        const num_t first = num_of(40.0 * scale * random_in(0.01, 1.0)), second = num_of(40.0 * scale * random_one());
        const num_t root = num_of(40.0 * scale * random_one());
        const double x = value_of(first), z = x * value_of(second), y = x * x - value_of(root) * value_of(root);
        if (hypot(y, z) < 1e-3 * (x * x + fabs(z))) {
            continue; /* the difference is dominated by the rounding of its terms */
        }
        const num_rotation_t turn = num_shifted_rotation(first, second, num_wide(root, root), &saturations);
        const double sign = (x < 0.0) ? -1.0 : 1.0;
        ASSERT_CLOSE(sign * y / hypot(y, z), unit_of(turn.cos), 5e-4);
        ASSERT_CLOSE(sign * z / hypot(y, z), unit_of(turn.sin), 5e-4);
    }
    /* Of (0, 0.5) only the shift is left: no turn, or half of one. */
    const num_rotation_t turn = num_shifted_rotation(NUM(0), NUM(0.5), num_wide(NUM(2), NUM(2)), &saturations);
    ASSERT_CLOSE(1.0, fabs(unit_of(turn.cos)), 1e-7);
    ASSERT_CLOSE(0.0, unit_of(turn.sin), 1e-7);
    TEST_ASSERT_EQUAL(0, saturations);
}

/* A vector scaled by its headroom has its largest size from 16 to 32, and the inverse shift restores it. In float
 * nothing changes. */
static void test_headroom_is_undone_by_the_inverse_shift(void) {
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

/* A result that does not fit saturates and is counted. In float nothing is counted. */
static void test_results_that_do_not_fit_saturate_and_are_counted(void) {
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
        {num_add(-INT32_MAX, -1, &saturations), -INT32_MAX},
        {num_subtract(-INT32_MAX, 1, &saturations), -INT32_MAX},
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
    TEST_ASSERT_EQUAL_INT32(NUM(511), num_from_int(512));
    TEST_ASSERT_EQUAL_INT32(NUM(-511), num_from_int(-512));
    TEST_ASSERT_EQUAL_INT32(NUM(510), num_from_int(510));
    TEST_ASSERT_EQUAL_INT32(NUM(-510), num_from_int(-510));
    /* The last results that fit are not counted. */
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, num_add(INT32_MAX - 1, 1, &saturations));
    TEST_ASSERT_EQUAL_INT32(-INT32_MAX, num_add(-INT32_MAX, 0, &saturations));
    TEST_ASSERT_EQUAL_INT32(-INT32_MAX, num_subtract(-INT32_MAX, 0, &saturations));
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, num_narrow((int64_t)INT32_MAX * 4194304, &saturations));
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, num_div(INT32_MAX, NUM(1), &saturations));
    TEST_ASSERT_EQUAL_INT32(-INT32_MAX, num_div(-INT32_MAX, NUM(1), &saturations));
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, num_shift(INT32_MAX, 0, &saturations));
    TEST_ASSERT_EQUAL_INT32(-INT32_MAX, num_shift(-INT32_MAX, 0, &saturations));
    TEST_ASSERT_EQUAL(counted, saturations);
#else
    TEST_ASSERT_TRUE(num_mul(1e30f, 1e30f, &saturations) == INFINITY);
    TEST_ASSERT_TRUE(num_div(-3.0f, 0.0f, &saturations) == -INFINITY);
    TEST_ASSERT_EQUAL(0, saturations);
#endif
}

static void test_a_wide_number_is_the_number(void) {
    static const num_t numbers[] = {NUM(0), NUM(1), NUM(-1), NUM(3), NUM(511), NUM(-511)};
    for (uint32_t i = 0; i < sizeof(numbers) / sizeof(numbers[0]); ++i) {
        TEST_ASSERT_TRUE(num_widen(numbers[i]) == num_wide(numbers[i], NUM(1)));
        TEST_ASSERT_TRUE(num_narrow(num_widen(numbers[i]), &saturations) == numbers[i]);
    }
    TEST_ASSERT_EQUAL(0, saturations);
}

/* In float every sum of these sizes fits. */
static void test_the_first_results_that_do_not_fit_saturate(void) {
#ifdef TAUPERP_FIXED
    const num_wide_t last = (num_wide_t)INT32_MAX * 4194304;
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, num_narrow(last + 1, &saturations));
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, num_narrow(last + 2097152, &saturations));
    TEST_ASSERT_EQUAL_INT32(-INT32_MAX, num_narrow(-last - 1, &saturations));
    TEST_ASSERT_EQUAL_INT32(-INT32_MAX, num_narrow(-last - 2097153, &saturations));
    TEST_ASSERT_EQUAL(4, saturations);
    TEST_ASSERT_EQUAL_INT32(-INT32_MAX, num_narrow(-last, &saturations));
    TEST_ASSERT_EQUAL(4, saturations);
    TEST_ASSERT_EQUAL_INT32(4194304, num_times(1, num_inverse_root(0), &saturations)); /* 0 counts as 2^-44 */
    TEST_ASSERT_EQUAL_INT32(4194304, num_times(1, num_inverse_root(1), &saturations));
    TEST_ASSERT_EQUAL(26, num_headroom(1));
#else
    TEST_ASSERT_TRUE(num_narrow(NUM(1e30), &saturations) == NUM(1e30));
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
    RUN_TEST(test_a_rotation_turns_a_pair_onto_the_first_axis);
    RUN_TEST(test_the_smaller_eigenvalue_is_within_a_millionth_of_the_larger);
    RUN_TEST(test_a_shifted_rotation_uses_the_square_minus_the_shift);
    RUN_TEST(test_headroom_is_undone_by_the_inverse_shift);
    RUN_TEST(test_results_that_do_not_fit_saturate_and_are_counted);
    RUN_TEST(test_a_wide_number_is_the_number);
    RUN_TEST(test_the_first_results_that_do_not_fit_saturate);
    return UNITY_END();
}
