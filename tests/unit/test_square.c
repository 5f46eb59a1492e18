#include "square.h"

#include "core_fixture.h"

#define UNIT IF_FIXED(17592186044416.0, 1.0) /* of an inner product: 2^44 */

void setUp(void) {}
void tearDown(void) {}

static num_wide_t wide_of(double x) {
    return (num_wide_t)(x * UNIT);
}

static double square_value(square_t square) {
#ifdef TAUPERP_FIXED
    return ldexp((double)square.mantissa, (int)square.bits - 31) / UNIT;
#else
    return (double)square;
#endif
}

static double unit_value(num_unit_t unit) {
    return (double)unit / IF_FIXED(1073741824.0, 1.0);
}

static void test_a_square_keeps_its_highest_bits(void) {
    random_start(71);
    for (int i = 0; i < DRAWS(10000); ++i) {
        const double value = pow(2.0, random_in(-30.0, 17.9));
        const double kept = square_value(square_of(wide_of(value)));
        ASSERT_CLOSE(value, kept, value * 1e-9 + 1.0 / UNIT + value * IF_FIXED(0.0, 1e-7));
    }
    TEST_ASSERT_TRUE(square_value(square_of(wide_of(0.0))) == 0.0);
    TEST_ASSERT_TRUE(square_size(square_of(wide_of(0.0))) == 0);
}

static void test_sizes_and_lengths_compare_as_the_squares_do(void) {
    const square_t small = square_of(wide_of(3.0)), equal = square_of(wide_of(3.0)), large = square_of(wide_of(3.001));
    TEST_ASSERT_TRUE(square_is_longer(large, small));
    TEST_ASSERT_FALSE(square_is_longer(small, large));
    TEST_ASSERT_FALSE(square_is_longer(small, equal));
    TEST_ASSERT_TRUE(square_is_longer(square_of(wide_of(4.0)), large));
    TEST_ASSERT_FALSE(square_is_longer(large, square_of(wide_of(4.0))));
    /* A share of 2^-10 of a square is as large as a square of 1/1024. */
    TEST_ASSERT_TRUE(square_share(square_size(square_of(wide_of(1024.0))), 10u) ==
                     square_size(square_of(wide_of(1.0))));
    TEST_ASSERT_TRUE(square_share(square_size(small), 62u) < square_size(square_of(wide_of(1e-9))));
}

/* Both sides of |along| = 2^-10 sqrt(first second), for squares of every size and for unequal ones. */
static void test_orthogonal_within_a_share_of_the_lengths(void) {
    for (int exponent = -20; exponent <= 16; ++exponent) {
        for (int shorter = 0; shorter <= 8; shorter += 4) {
            const double first = 1.01 * pow(2.0, exponent), second = 1.01 * pow(2.0, exponent - shorter);
            const double bound = sqrt(first * second) / 1024.0;
            for (int sign = -1; sign <= 1; sign += 2) {
                const square_t a = square_of(wide_of(first)), b = square_of(wide_of(second));
                const num_wide_t within = wide_of(sign * bound * IF_FIXED(0.24, 0.99));
                const num_wide_t beyond = wide_of(sign * bound * 1.01);
                TEST_ASSERT_TRUE(square_is_orthogonal(within, a, b, 10u));
                TEST_ASSERT_TRUE(square_is_orthogonal(within, b, a, 10u));
                TEST_ASSERT_FALSE(square_is_orthogonal(beyond, a, b, 10u));
                TEST_ASSERT_FALSE(square_is_orthogonal(beyond, b, a, 10u));
            }
        }
    }
    TEST_ASSERT_TRUE(square_is_orthogonal(wide_of(0.0), square_of(wide_of(1.0)), square_of(wide_of(1.0)), 21u));
    TEST_ASSERT_FALSE(square_is_orthogonal(wide_of(1.1), square_of(wide_of(1.0)), square_of(wide_of(1.0)), 0u));
#ifndef TAUPERP_FIXED
    TEST_ASSERT_TRUE(square_is_orthogonal(-0.0009765625f, 1.0f, 1.0f, 10u)); /* at most 2^-10 */
#endif
}

/* Of two parallel vectors one is too short to have a direction. */
static void test_a_square_without_an_exact_product_is_orthogonal_to_every_other(void) {
#ifdef TAUPERP_FIXED
    TEST_PASS_MESSAGE("every square has an exact product here");
#else
    TEST_ASSERT_TRUE(square_is_orthogonal(3e-7f, 9e-17f, 1e3f, 10u));
    TEST_ASSERT_TRUE(square_is_orthogonal(3e-7f, 1e3f, 9e-17f, 10u));
    TEST_ASSERT_FALSE(square_is_orthogonal(3e-7f, 2e-16f, 1e3f, 10u));
    TEST_ASSERT_FALSE(square_is_orthogonal(3e-7f, 1e3f, 2e-16f, 10u));
#endif
}

/* Vectors of lengths over four decades, at angles from a right one to 2^-14 beside it, and nearly parallel ones. */
static void test_the_rotation_makes_two_vectors_orthogonal(void) {
    double worst_left = 0.0, worst_length = 0.0, worst_square = 0.0;
    random_start(72);
    for (int i = 0; i < DRAWS(200000); ++i) {
        const double p = pow(10.0, random_in(-2.0, 1.5)), q = pow(10.0, random_in(-2.0, 1.5));
        const double cosine = ((i % 2 == 0) ? 1.0 : -1.0) * ((i % 3 == 0) ? 0.9999 : pow(2.0, random_in(-14.0, 0.0)));
        const double along = p * q * cosine;
        square_t longer = square_of(wide_of(fmax(p, q) * fmax(p, q)));
        square_t shorter = square_of(wide_of(fmin(p, q) * fmin(p, q)));
        const double a = fmax(p, q) * fmax(p, q), b = fmin(p, q) * fmin(p, q);
        const num_rotation_t by = square_orthogonalise(&longer, &shorter, wide_of(along));
        const double c = unit_value(by.cos), s = unit_value(by.sin);
        const double left = (c * c - s * s) * along - c * s * (a - b); /* their inner product after the rotation */
        TEST_ASSERT_TRUE(fabs(s) <= (c + 1e-8));
        TEST_ASSERT_TRUE(by.length == 0);
        TEST_ASSERT_TRUE((along > 0.0) == (s > 0.0));
        worst_left = fmax(worst_left, (fabs(left) - 4e-9 * a) / fabs(along));
        worst_length = fmax(worst_length, fabs(c * c + s * s - 1.0));
        worst_square =
            fmax(worst_square, fabs(square_value(longer) - (c * c * a + s * s * b + 2.0 * c * s * along)) / a);
        worst_square =
            fmax(worst_square, fabs(square_value(shorter) - (s * s * a + c * c * b - 2.0 * c * s * along)) / a);
    }
    printf("left %.2g of the inner product; lengths %.2g; squares %.2g\n", worst_left, worst_length, worst_square);
    TEST_ASSERT_TRUE(worst_left < 6e-4);
    TEST_ASSERT_TRUE(worst_length < IF_FIXED(8e-9, 4e-7));
    TEST_ASSERT_TRUE(worst_square < IF_FIXED(3e-4, 1e-6));
}

static void test_vectors_at_right_angles_need_no_rotation(void) {
    square_t longer = square_of(wide_of(5.0)), shorter = square_of(wide_of(3.0));
    const num_rotation_t by = square_orthogonalise(&longer, &shorter, wide_of(0.0));
    TEST_ASSERT_TRUE(by.cos == IF_FIXED(1073741824, 1.0f));
    TEST_ASSERT_TRUE(by.sin == 0);
    ASSERT_CLOSE(5.0, square_value(longer), 1e-6);
    ASSERT_CLOSE(3.0, square_value(shorter), 1e-6);
}

/* An eighth of a turn: one becomes zero, the other the diagonal. */
static void test_two_equal_vectors_become_one(void) {
    for (double size = 1.0; size < 4.0; size *= 1.01) {
        for (int sign = -1; sign <= 1; sign += 2) {
            square_t longer = square_of(wide_of(size)), shorter = square_of(wide_of(size));
            const num_rotation_t by = square_orthogonalise(&longer, &shorter, wide_of(size * sign));
            ASSERT_CLOSE(sqrt(0.5), unit_value(by.cos), 1e-7);
            ASSERT_CLOSE(sign * sqrt(0.5), unit_value(by.sin), 1e-7);
            ASSERT_CLOSE(2.0 * size, square_value(longer), 4e-6);
            ASSERT_CLOSE(0.0, square_value(shorter), 4e-6);
        }
    }
}

/* The shorter one becomes zero, to the accuracy of a square, and never a large number by an underflow. */
static void test_of_two_parallel_vectors_one_is_left(void) {
    for (double a = 1.0; a < 4.0; a *= 1.07) {
        for (double b = a; b > 1e-4; b *= 0.8) {
            square_t longer = square_of(wide_of(a)), shorter = square_of(wide_of(b));
            (void)square_orthogonalise(&longer, &shorter, wide_of(sqrt(a * b)));
            ASSERT_CLOSE(a + b, square_value(longer), 3e-4 * a);
            ASSERT_CLOSE(0.0, square_value(shorter), 3e-4 * a);
        }
    }
}

static void test_two_vectors_without_length_are_left_alone(void) {
    square_t longer = square_of(wide_of(0.0)), shorter = square_of(wide_of(0.0));
    const num_rotation_t by = square_orthogonalise(&longer, &shorter, wide_of(0.0));
    TEST_ASSERT_TRUE(by.cos == IF_FIXED(1073741824, 1.0f));
    TEST_ASSERT_TRUE(by.sin == 0);
    TEST_ASSERT_TRUE(by.length == 0);
}

static void test_an_inner_product_larger_than_its_vectors_counts_as_a_parallel_one(void) {
#ifdef TAUPERP_FIXED
    square_t longer = square_of(wide_of(2.0)), shorter = square_of(wide_of(2.0));
    const num_rotation_t by = square_orthogonalise(&longer, &shorter, wide_of(2.0001));
    ASSERT_CLOSE(sqrt(0.5), unit_value(by.sin), 1e-7);
    TEST_ASSERT_TRUE(by.sin <= by.cos);
    square_t largest = {.mantissa = UINT32_MAX / 2u, .bits = 63u};
    shorter = largest;
    (void)square_orthogonalise(&largest, &shorter, INT64_MAX);
    TEST_ASSERT_EQUAL(63, largest.bits); /* and not a shift by more than a word has */
#else
    TEST_PASS_MESSAGE("a float has no limit here");
#endif
}

/* Of two equal odd squares the last bit remains, and nothing of even ones. */
static void test_the_rest_of_two_equal_squares_is_at_most_one_bit(void) {
#ifdef TAUPERP_FIXED
    const uint32_t odd = (1u << 30) + 1u;
    square_t longer = {.mantissa = odd, .bits = 40u}, shorter = longer;
    (void)square_orthogonalise(&longer, &shorter, (num_wide_t)odd << 9);
    TEST_ASSERT_EQUAL_UINT32(1u << 30, shorter.mantissa);
    TEST_ASSERT_EQUAL(10, shorter.bits);
    longer = shorter = (square_t){.mantissa = 1u << 30, .bits = 40u};
    (void)square_orthogonalise(&longer, &shorter, (num_wide_t)1 << 39);
    TEST_ASSERT_EQUAL(0, shorter.mantissa);
    TEST_ASSERT_EQUAL(0, shorter.bits);
#else
    TEST_PASS_MESSAGE("a square of float32 is one number, without a rest to round");
#endif
}

/* 3 and 2 steps of 2^-44, at an angle of 35 degrees: the rest of the shorter one is less than a step. */
static void test_a_square_below_one_step_is_zero(void) {
#ifdef TAUPERP_FIXED
    square_t longer = square_of(3), shorter = square_of(2);
    (void)square_orthogonalise(&longer, &shorter, 2);
    TEST_ASSERT_EQUAL(0, shorter.mantissa);
    TEST_ASSERT_EQUAL(0, shorter.bits);
    longer = square_of(3), shorter = square_of(2);
    (void)square_orthogonalise(&longer, &shorter, 1);
    TEST_ASSERT_EQUAL(1, shorter.bits); /* one step and 0.38 */
    ASSERT_CLOSE(1.382, square_value(shorter) * UNIT, 0.001);
#else
    TEST_PASS_MESSAGE("a float has no limit here");
#endif
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_square_keeps_its_highest_bits);
    RUN_TEST(test_sizes_and_lengths_compare_as_the_squares_do);
    RUN_TEST(test_orthogonal_within_a_share_of_the_lengths);
    RUN_TEST(test_a_square_without_an_exact_product_is_orthogonal_to_every_other);
    RUN_TEST(test_the_rotation_makes_two_vectors_orthogonal);
    RUN_TEST(test_vectors_at_right_angles_need_no_rotation);
    RUN_TEST(test_two_equal_vectors_become_one);
    RUN_TEST(test_of_two_parallel_vectors_one_is_left);
    RUN_TEST(test_two_vectors_without_length_are_left_alone);
    RUN_TEST(test_an_inner_product_larger_than_its_vectors_counts_as_a_parallel_one);
    RUN_TEST(test_the_rest_of_two_equal_squares_is_at_most_one_bit);
    RUN_TEST(test_a_square_below_one_step_is_zero);
    return UNITY_END();
}
