/* Averages of a fit's estimates at one point: linear_model_pool. */
#include "optimizer/fit/linear/linear_model.h"
#include "optimizer/fit/objective/objective.h"
#include "tests/support/tracer/fake_estimator.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

static const double mid_range[FAKE_N_PARAM] = {0.15, 0.08, 0.05, 0.9, 0.6, 0.4, 5.0, 15.0, 20.0};

/* A history of exact estimates at several points. Pooling returns the value at the reference point, exactly to second
 * order. */
static void test_pool(void **state)
{
    (void)state;
    struct fake_cloth f;
    struct observation_set o;
    struct coordinate k[FAKE_N_PARAM];
    struct linear_history h;
    struct linear_model m;
    double truth[FAKE_N_PARAM], x[FAKE_N_PARAM], param[FAKE_N_PARAM];
    struct estimate a[FAKE_N_FIT], exact[FAKE_N_FIT];
    size_t n_path[FAKE_N_FIT];
    fake_cloth_init(&f, 3, FAKE_N_FIT);
    f.noise = 0.0;
    f.share_paths = true;
    struct estimator e = fake_estimator(&f);
    fake_param_set(mid_range, truth);
    observation_set_init(&o);
    assert_int_equal(fake_observe(&f, truth, 0.0, 1, &o), STATUS_OK);
    for (size_t i = 0; i < FAKE_N_FIT; i++) n_path[i] = 4096;
    for (size_t p = 0; p < FAKE_N_PARAM; p++)
        coordinate_init(&k[p], &fake_param[p], fake_param[p].lower, fake_param[p].upper);
    linear_history_init(&h, &o, k, FAKE_N_PARAM);
    assert_int_equal(linear_model_init(&m, 3 * FAKE_N_FIT, FAKE_N_PARAM, NULL), STATUS_OK);
    double wall_s;
    for (int step = -1; step <= 1; step++) {
        for (size_t p = 0; p < FAKE_N_PARAM; p++) {
            x[p] = coordinate_from_param(&k[p], truth[p]) + 0.02 * step;
            param[p] = coordinate_to_param(&k[p], x[p]);
        }
        struct estimator_call call = {param, n_path, 0, 0, true};
        assert_int_equal(e.run(e.context, &call, NULL, a, &wall_s, NULL), STATUS_OK);
        for (size_t i = 0; i < FAKE_N_FIT; i++)
            for (int c = 0; c < 3; c++) a[i].var[c] = a[i].mean[c] * a[i].mean[c] * 25.0 / 4096.0;
        if (step == 0) memcpy(exact, a, sizeof a);
        assert_int_equal(linear_history_append(&h, x, a, a, NULL), STATUS_OK);
    }
    for (size_t p = 0; p < FAKE_N_PARAM; p++) x[p] = coordinate_from_param(&k[p], truth[p]);
    assert_int_equal(linear_model_pool(&m, &h, x, NULL), STATUS_OK);
    assert_int_equal(m.n_pair, FAKE_N_FIT / 2);
    for (size_t i = 0; i < m.n_pair; i++)
        assert_true(m.pair[i].i == 2 * i + 1 && m.pair[i].j == 2 * i && m.pair[i].correlation == 1.0);
    assert_true(m.n_effective > 1.5 * 4096 && m.n_effective <= 3.0 * 4096.5);
    for (size_t row = 0; row < m.n_row; row++) {
        assert_true(fabs(m.r[0][row]) < 2e-3);
        for (size_t p = 0; p < FAKE_N_PARAM; p++) {
            double want = sqrt(objective_weight(&o.item[row / 3])) * exact[row / 3].jac[(row % 3) * FAKE_N_PARAM + p] *
                          coordinate_slope(&k[p], truth[p]);
            assert_true(fabs(m.j[0][row * FAKE_N_PARAM + p] - want) < 0.03 * fabs(want) + 0.002);
        }
    }
    linear_model_release(&m);
    linear_history_release(&h);
    observation_set_release(&o);
}

/* One photograph of radiance 1 and one parameter, x = ln(p). */
struct one_row {
    struct coordinate k;
    struct observation_set o;
    struct linear_history h;
    struct linear_model m;
    double weight; /* objective_weight */
};

static void one_row_init(struct one_row *r)
{
    const struct param_info info = {.lower = 0.1, .upper = 10.0, .start = 1.0, .coordinate = PARAM_LOG};
    const struct observation item = {.mean_rgb = {1.0, 1.0, 1.0}, .weight = 1.0};
    coordinate_init(&r->k, &info, info.lower, info.upper);
    observation_set_init(&r->o);
    assert_int_equal(observation_set_append(&r->o, &item, NULL), STATUS_OK);
    linear_history_init(&r->h, &r->o, &r->k, 1);
    assert_int_equal(linear_model_init(&r->m, 3, 1, NULL), STATUS_OK);
    r->weight = objective_weight(&item);
}

static void one_row_release(struct one_row *r)
{
    linear_model_release(&r->m);
    linear_history_release(&r->h);
    observation_set_release(&r->o);
}

/* The radiance is 1 + x / 2 + x^2. */
static void append_parabola(struct linear_history *h, double x, uint64_t n_path)
{
    struct estimate e = {.n_path = n_path, .n_bounce = n_path};
    for (size_t c = 0; c < 3; c++) {
        e.mean[c] = 1.0 + 0.5 * x + x * x;
        e.var[c] = 1.0 / (double)n_path;
        e.jac[c] = (0.5 + 2.0 * x) / coordinate_slope(h->coordinate, coordinate_to_param(h->coordinate, x));
    }
    assert_int_equal(linear_history_append(h, &x, &e, &e, NULL), STATUS_OK);
}

/* An estimate at x = 0 is extrapolated to 0.1 by the derivative at 0.05, which comes from a second estimate of one
 * path, whose own mean has no weight. This is exact for a parabola; the derivative at 0 would give an error of 0.01. */
static void test_carried_to_second_order(void **state)
{
    (void)state;
    struct one_row r;
    double x = 0.1;
    one_row_init(&r);
    append_parabola(&r.h, 0.0, 1000000);
    append_parabola(&r.h, 0.05, 1);
    assert_int_equal(linear_model_pool(&r.m, &r.h, &x, NULL), STATUS_OK);
    double want = sqrt(r.weight) * (0.5 * x + x * x);
    for (size_t c = 0; c < 3; c++) assert_true(fabs(r.m.r[0][c] - want) < 1e-4 && fabs(r.m.r[1][c] - want) < 1e-4);
    one_row_release(&r);
}

/* One estimate that is extrapolated by its own derivative has its own variance plus dx^2 times that of the
 * derivative. */
static void test_noise_of_carrying(void **state)
{
    (void)state;
    struct one_row r;
    struct estimate e = {.n_path = 4096};
    double x = 0.2, dx = -0.3;
    one_row_init(&r);
    for (size_t c = 0; c < 3; c++) {
        e.mean[c] = e.jac[c] = 1.0;
        e.var[c] = 1e-4 * (double)(c + 1);
        e.jac_var[c] = 0.02 * (double)(c + 1);
    }
    assert_int_equal(linear_history_append(&r.h, &x, &e, &e, NULL), STATUS_OK);
    double slope = coordinate_slope(&r.k, coordinate_to_param(&r.k, x));
    for (int moved = 0; moved < 2; moved++) {
        double at = x + moved * dx, way = moved * dx * slope;
        assert_int_equal(linear_model_pool(&r.m, &r.h, &at, NULL), STATUS_OK);
        for (size_t c = 0; c < 3; c++) {
            double want = r.weight * (e.var[c] + way * way * e.jac_var[c]);
            assert_true(fabs(r.m.r_var[0][c] / want - 1.0) < 1e-9 && fabs(r.m.r_var[1][c] / want - 1.0) < 1e-9);
        }
    }
    one_row_release(&r);
}

/* However noisy the steps are, their weights add up to 1: equal estimates are pooled to the same residual. */
static void test_noisy_steps(void **state)
{
    (void)state;
    static const double noise[] = {1e-6, 1.0, 1e6};
    for (size_t k = 0; k < 3; k++) {
        struct one_row r;
        struct estimate e = {.n_path = 64};
        double x = 0.2;
        one_row_init(&r);
        for (size_t c = 0; c < 3; c++) {
            e.mean[c] = 1.5;
            e.var[c] = noise[k];
        }
        for (int n = 0; n < 2; n++) assert_int_equal(linear_history_append(&r.h, &x, &e, &e, NULL), STATUS_OK);
        assert_int_equal(linear_model_pool(&r.m, &r.h, &x, NULL), STATUS_OK);
        for (size_t c = 0; c < 3; c++)
            for (int q = 0; q < 2; q++) assert_true(fabs(r.m.r[q][c] / (0.5 * sqrt(r.weight)) - 1.0) < 1e-9);
        one_row_release(&r);
    }
}

/* No row beyond the last one counts. */
static void test_weighted_objective(void **state)
{
    enum { N_ROW = 6 };
    struct linear_model m;
    double want = 0.0;
    (void)state;
    assert_int_equal(linear_model_init(&m, N_ROW, 1, NULL), STATUS_OK);
    for (size_t row = 0; row < N_ROW; row++) {
        m.weight[row] = (double)(row + 1);
        m.r[0][row] = 2.0;
        m.r[1][row] = 0.5 * (double)(row + 3);
    }
    for (m.n_row = 0; m.n_row < N_ROW; m.n_row++) {
        assert_true(fabs(linear_model_weighted_objective(&m) - want) < 1e-12);
        want += (double)(m.n_row + 1) * (double)(m.n_row + 3);
    }
    linear_model_release(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_pool), cmocka_unit_test(test_carried_to_second_order),
                                       cmocka_unit_test(test_noise_of_carrying), cmocka_unit_test(test_noisy_steps),
                                       cmocka_unit_test(test_weighted_objective)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
