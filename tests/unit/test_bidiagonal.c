#include "bidiagonal.h"

#include "core_fixture.h"

#define ROWS BIDIAGONAL_MAX_ROWS

static bidiagonal_t b, before;
static bidiagonal_path_t path;
static uint32_t saturations;

void setUp(void) {
    memset(&b, 0, sizeof(b));
    memset(&path, 0, sizeof(path));
    saturations = 0;
}
void tearDown(void) {
    TEST_ASSERT_EQUAL(0, saturations);
}

static void diagonalise(double tolerance, bool all) {
    before = b;
    bidiagonal_diagonalise(&b, num_of(tolerance), all, &path, &saturations);
}

/* Entries up to 20, the range after headroom in fixed point. Every third matrix also has entries that are decades
 * smaller. */
static void random_bidiagonal(uint32_t rows, int round) {
    b.rows = rows;
    for (uint32_t i = 0; i < rows; ++i) {
        const double scale = (round % 3 == 0) ? pow(10.0, 2.0 * random_one() - 2.0) : 1.0;
        b.diagonal[i] = num_of(20.0 * scale * random_one());
        b.above[i] = (i + 1u < rows) ? num_of(20.0 * random_one()) : NUM(0);
    }
}

static double square_of(const bidiagonal_t *matrix) {
    double sum = 0.0;
    for (uint32_t i = 0; i < matrix->rows; ++i) {
        sum += value_of(matrix->diagonal[i]) * value_of(matrix->diagonal[i]);
        sum += value_of(matrix->above[i]) * value_of(matrix->above[i]);
    }
    return sum;
}

/* direction^T B, by columns. */
static void row_of(const num_t direction[], double row[ROWS + 1u]) {
    memset(row, 0, (ROWS + 1u) * sizeof(row[0]));
    for (uint32_t i = 0; i < before.rows; ++i) {
        row[i] += value_of(direction[i]) * value_of(before.diagonal[i]);
        row[i + 1u] += value_of(direction[i]) * value_of(before.above[i]);
    }
}

static void test_two_rows_have_the_singular_values_of_the_closed_form(void) {
    b = (bidiagonal_t){.diagonal = {NUM(3), NUM(2)}, .above = {NUM(1)}, .rows = 2};
    diagonalise(0.005, true);
    TEST_ASSERT_TRUE(path.done);
    TEST_ASSERT_EQUAL(0, path.open_rows);
    /* of [3 1; 0 2]: squares 7 +- sqrt(13) */
    const double first = fabs(value_of(b.diagonal[0])), second = fabs(value_of(b.diagonal[1]));
    ASSERT_CLOSE(sqrt(7.0 + sqrt(13.0)), fmax(first, second), 2e-6);
    ASSERT_CLOSE(sqrt(7.0 - sqrt(13.0)), fmin(first, second), 2e-6);
}

static void test_the_rows_of_the_directions_are_orthogonal_with_the_singular_values_as_lengths(void) {
    uint32_t unfinished = 0; /* small rows between large ones, in steps of 2^-22 */
    random_start(101);
    for (int round = 0; round < DRAWS(20000); ++round) {
        const uint32_t rows = 1u + (uint32_t)round % ROWS;
        num_t direction[ROWS][ROWS] = {{0}};
        double image[ROWS][ROWS + 1u];
        random_bidiagonal(rows, round);
        diagonalise(0.0001, true);
        if (!path.done) {
            ++unfinished;
            continue;
        }
        for (uint32_t i = 0; i < rows; ++i) {
            direction[i][i] = NUM(1);
        }
        bidiagonal_rotate_back(&path, rows, direction);
        for (uint32_t i = 0; i < rows; ++i) {
            row_of(direction[i], image[i]);
        }
        for (uint32_t i = 0; i < rows; ++i) {
            for (uint32_t j = 0; j <= i; ++j) {
                double inner = 0.0, unit = 0.0;
                for (uint32_t c = 0; c <= rows; ++c) {
                    inner += image[i][c] * image[j][c];
                }
                for (uint32_t c = 0; c < rows; ++c) {
                    unit += value_of(direction[i][c]) * value_of(direction[j][c]);
                }
                const double singular = value_of(b.diagonal[i]);
                ASSERT_CLOSE((i == j) ? 1.0 : 0.0, unit, 5e-6);
                ASSERT_CLOSE((i == j) ? (singular * singular) : 0.0, inner,
                             IF_FIXED(3e-5, 4e-6) * square_of(&before)); /* twice the rounding of 60 rotations */
            }
        }
    }
    printf("%u of %u wanted more sweeps\n", (unsigned)unfinished, (unsigned)DRAWS(20000));
    TEST_ASSERT_TRUE(unfinished <= IF_FIXED(10u, 0u));
}

/* Nearly diagonal, and far from the tolerance: nothing changes. */
static void test_rows_with_a_small_inverse_stay_unchanged(void) {
    b = (bidiagonal_t){.diagonal = {NUM(2), NUM(-1), NUM(0.5)}, .above = {NUM(0.2), NUM(0.1)}, .rows = 3};
    diagonalise(0.2, false);
    TEST_ASSERT_TRUE(path.done);
    TEST_ASSERT_EQUAL(3, path.open_rows);
    TEST_ASSERT_EQUAL(0, path.rotations);
    TEST_ASSERT_EQUAL(0, path.sweeps);
    TEST_ASSERT_EQUAL_MEMORY(&before, &b, sizeof(b));
    /* |B^-1|_F of this matrix, times the tolerance */
    const double c = 1.0 / 0.5, second[] = {-1.0, 0.2}, first[] = {0.5, 0.1, -0.02};
    const double sum = c * c + second[0] * second[0] + second[1] * second[1] + first[0] * first[0] +
                       first[1] * first[1] + first[2] * first[2];
    ASSERT_CLOSE(0.2 * sqrt(sum), value_of(path.ratio), 1e-5);
    diagonalise(0.45, false); /* still below the smallest singular value, but the bound does not show it */
    TEST_ASSERT_TRUE(path.sweeps > 0u);
}

static void test_the_remaining_rows_have_no_singular_value_below_the_tolerance(void) {
    random_start(102);
    for (int round = 0; round < DRAWS(20000); ++round) {
        const double tolerance = pow(10.0, random_in(-3.0, 1.0));
        random_bidiagonal(1u + (uint32_t)round % ROWS, round);
        diagonalise(tolerance, false);
        TEST_ASSERT_TRUE(path.done);
        bidiagonal_t rest = b;
        rest.rows = path.open_rows;
        if (rest.rows > 0u) {
            rest.above[rest.rows - 1u] = NUM(0);
        }
        bidiagonal_diagonalise(&rest, num_of(tolerance), true, &path, &saturations);
        for (uint32_t i = 0; i < rest.rows; ++i) {
            TEST_ASSERT_TRUE(fabs(value_of(rest.diagonal[i])) >= tolerance * (1.0 - 1e-3));
        }
    }
}

static void test_a_row_with_one_more_column_is_rotated_into_the_diagonal(void) {
    random_start(103);
    for (int round = 0; round < DRAWS(20000); ++round) {
        random_bidiagonal(1u + (uint32_t)round % ROWS, round);
        b.above[b.rows - 1u] = num_of(20.0 * random_one());
        const double square = square_of(&b);
        bidiagonal_square(&b, &saturations);
        TEST_ASSERT_TRUE(b.above[b.rows - 1u] == NUM(0));
        ASSERT_CLOSE(square, square_of(&b), 1e-6 * square + IF_FIXED(2e-6 * sqrt(square), 0.0));
    }
}

static void test_zeros_on_the_diagonal_give_zero_singular_values(void) {
    random_start(104);
    for (int round = 0; round < DRAWS(5000); ++round) {
        const uint32_t zeros = 1u + (uint32_t)round % 3u;
        uint32_t found = 0;
        random_bidiagonal(ROWS, 1);
        for (uint32_t z = 0; z < zeros; ++z) {
            b.diagonal[2u * z] = NUM(0);
            b.above[2u * z] = NUM(0); /* the whole row */
        }
        diagonalise(0.001, true);
        TEST_ASSERT_TRUE(path.done);
        for (uint32_t i = 0; i < ROWS; ++i) {
            found += (fabs(value_of(b.diagonal[i])) < 1e-4) ? 1u : 0u;
        }
        TEST_ASSERT_TRUE(found >= zeros);
    }
}

static void test_a_matrix_without_rows_needs_no_sweep(void) {
    diagonalise(0.005, false);
    TEST_ASSERT_TRUE(path.done);
    TEST_ASSERT_EQUAL(0, path.open_rows);
    TEST_ASSERT_TRUE(path.ratio == NUM(0));
}

/* Signed overflow would end the test: in fixed point the sum of these squares is beyond 64 bits. */
static void test_entries_at_the_end_of_the_range_leave_a_path_within_its_room(void) {
    for (uint32_t rows = 1; rows <= ROWS; ++rows) {
        b.rows = rows;
        for (uint32_t i = 0; i < rows; ++i) {
            b.diagonal[i] = num_of(((i % 2u) == 0u) ? -511.9999997 : 511.9999997);
            b.above[i] = num_of(511.9999997);
        }
        bidiagonal_square(&b, &saturations);
        diagonalise(0.005, true);
        TEST_ASSERT_LESS_OR_EQUAL(BIDIAGONAL_MAX_SWEEPS * (rows - 1u), path.rotations);
        TEST_ASSERT_LESS_OR_EQUAL(rows, path.open_rows);
    }
    saturations = 0;
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_two_rows_have_the_singular_values_of_the_closed_form);
    RUN_TEST(test_the_rows_of_the_directions_are_orthogonal_with_the_singular_values_as_lengths);
    RUN_TEST(test_rows_with_a_small_inverse_stay_unchanged);
    RUN_TEST(test_the_remaining_rows_have_no_singular_value_below_the_tolerance);
    RUN_TEST(test_a_row_with_one_more_column_is_rotated_into_the_diagonal);
    RUN_TEST(test_entries_at_the_end_of_the_range_leave_a_path_within_its_room);
    RUN_TEST(test_zeros_on_the_diagonal_give_zero_singular_values);
    RUN_TEST(test_a_matrix_without_rows_needs_no_sweep);
    return UNITY_END();
}
