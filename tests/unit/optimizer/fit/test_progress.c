/* Progress of a fit by Gauss-Newton after its regularization has ended: where the objective is lowest, and for how many
 * points it has not fallen. */
#include "optimizer/fit/descent/gauss_newton.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static void accept(struct gauss_newton *g, double x, double f)
{
    g->model.x_ref[0] = x;
    gauss_newton_judge_progress(g, f, 1e-4);
}

static void test_progress(void **state)
{
    (void)state;
    struct gauss_newton g = {0};
    accept(&g, 1.0, 0.5);
    accept(&g, 2.0, 0.4);
    assert_true(g.n_stalled == 0 && g.lowest_f == 0.4 && g.lowest_x[0] == 2.0);
    accept(&g, 3.0, 0.399); /* lower, by less than a fiftieth */
    assert_true(g.n_stalled == 1 && g.lowest_f == 0.399 && g.lowest_x[0] == 3.0);
    accept(&g, 4.0, 0.45);
    assert_true(g.n_stalled == 2 && g.lowest_f == 0.399 && g.lowest_x[0] == 3.0);
}

/* Noise may bring the objective, a product of two replicas, below 0. Higher points after that are no progress. */
static void test_negative_objective(void **state)
{
    (void)state;
    struct gauss_newton g = {0};
    accept(&g, 1.0, -0.001);
    accept(&g, 2.0, 0.002);
    accept(&g, 3.0, 0.001);
    assert_true(g.n_stalled == 2 && g.lowest_f == -0.001 && g.lowest_x[0] == 1.0);
    accept(&g, 4.0, -0.002);
    assert_true(g.n_stalled == 0 && g.lowest_f == -0.002 && g.lowest_x[0] == 4.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_progress), cmocka_unit_test(test_negative_objective)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
