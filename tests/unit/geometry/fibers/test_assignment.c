/* The assignment between ends at a seam: against all assignments of small problems. */
#include "geometry/fibers/seam/assignment.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

enum { N = 6 };

/* Least cost of rows from `row` on, where used columns are taken. cost: infinite where a pair is not allowed. */
static double best(double cost[N][N], double alone, int row, unsigned used)
{
    if (row == N) return 0.0;
    double least = alone + best(cost, alone, row + 1, used);
    for (int j = 0; j < N; j++)
        if ((used >> j & 1u) == 0 && isfinite(cost[row][j]))
            least = fmin(least, cost[row][j] + best(cost, alone, row + 1, used | 1u << j));
    return least;
}

static void test_against_all(void **state)
{
    (void)state;
    srand(7);
    for (int trial = 0; trial < 300; trial++) {
        struct allowed_pair pair[N * N];
        double cost[N][N], sum = 0.0;
        const double alone = 0.2 + 0.002 * trial;
        size_t n = 0, partner[N];
        bool taken[N] = {false};
        for (size_t i = 0; i < N; i++)
            for (size_t j = 0; j < N; j++) {
                cost[i][j] = rand() % 3 == 0 ? INFINITY : (double)(rand() % 1000) / 1000.0;
                if (isfinite(cost[i][j])) pair[n++] = (struct allowed_pair){i, j, cost[i][j]};
            }
        assert_int_equal(assignment_find(pair, n, N, N, alone, partner, NULL), STATUS_OK);
        for (size_t i = 0; i < N; i++) {
            if (partner[i] == SIZE_MAX) {
                sum += alone;
                continue;
            }
            assert_true(partner[i] < N && !taken[partner[i]] && isfinite(cost[i][partner[i]]));
            taken[partner[i]] = true;
            sum += cost[i][partner[i]];
        }
        assert_true(fabs(sum - best(cost, alone, 0, 0)) < 1e-9);
    }
}

/* The nearest pair would leave two ends that do not reach each other. */
static void test_not_greedy(void **state)
{
    (void)state;
    const struct allowed_pair pair[] = {{0, 0, 1.0}, {0, 1, 4.0}, {1, 0, 2.0}};
    size_t partner[2];
    assert_int_equal(assignment_find(pair, 3, 2, 2, 10.0, partner, NULL), STATUS_OK);
    assert_true(partner[0] == 1 && partner[1] == 0);
    assert_int_equal(assignment_find(pair, 3, 2, 2, 4.0, partner, NULL), STATUS_OK); /* 1 + 4 is less than 2 + 4 */
    assert_true(partner[0] == 0 && partner[1] == SIZE_MAX);
    assert_int_equal(assignment_find(NULL, 0, 2, 0, 1.0, partner, NULL), STATUS_OK);
    assert_true(partner[0] == SIZE_MAX && partner[1] == SIZE_MAX);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_against_all), cmocka_unit_test(test_not_greedy)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
