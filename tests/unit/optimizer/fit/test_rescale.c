/* The published rescaling curves: the table of appendix B.1, the curve's definition, and the piecewise linear map. */
#include "optimizer/fit/descent/rescale.h"
#include "tests/support/tracer/fake_estimator.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void check_points(const char *symbol, const double want[9])
{
    double c[RESCALE_POINTS];
    assert_true(rescale_published_points(symbol, c));
    for (int i = 0; i < 9; i++)
        if (fabs(c[i] - want[i]) > 1e-5 * fmax(1.0, want[i]))
            fail_msg("%s: c_%d is %.7g, published %.7g", symbol, i + 1, c[i], want[i]);
}

static void test_published_table(void **state)
{
    (void)state;
    check_points("C_R", (double[]){0.001, 0.026722, 0.053566, 0.094913, 0.158599, 0.256696, 0.407794, 0.640530, 0.999});
    check_points("beta_R", (double[]){1, 1.8, 2.68, 3.648, 4.7128, 5.88408, 7.172488, 8.589737, 10});
    check_points("C_TT",
                 (double[]){0.001, 0.359470, 0.592206, 0.743304, 0.841401, 0.905087, 0.946434, 0.973278, 0.999});
    check_points("beta_TT", (double[]){1, 1.94, 3.365, 5.5025, 8.70875, 13.518125, 20.732187, 31.553281, 45});
    check_points("gamma_TT", (double[]){1, 1.94, 3.365, 5.5025, 8.70875, 13.518125, 20.732187, 31.553281, 45});
    double c[RESCALE_POINTS];
    assert_false(rescale_published_points("alpha", c));
}

static void test_points_within_bounds(void **state)
{
    (void)state;
    for (size_t p = 0; p < FAKE_N_PARAM; p++) {
        struct coordinate k;
        struct rescale_curve curve;
        coordinate_init(&k, &fake_param[p], fake_param[p].lower, fake_param[p].upper);
        rescale_points(&fake_param[p], &k, &curve);
        assert_true(curve.n >= 2 && curve.n <= RESCALE_POINTS);
        assert_true(curve.c[0] == fake_param[p].lower && curve.c[curve.n - 1] == fake_param[p].upper);
        for (size_t i = 1; i < curve.n; i++) assert_true(curve.c[i] > curve.c[i - 1]);
    }
    struct param_info alpha = {
        .symbol = "alpha", .lower = 0.001, .upper = 0.999, .start = 0.85, .coordinate = PARAM_LOGIT};
    struct coordinate k;
    struct rescale_curve curve;
    coordinate_init(&k, &alpha, alpha.lower, alpha.upper);
    rescale_points(&alpha, &k, &curve);
    assert_int_equal(curve.n, RESCALE_POINTS);
}

static void test_map(void **state)
{
    (void)state;
    const struct rescale_curve curve = {.n = 3, .c = {1.0, 2.0, 4.0}, .r = {0.0, 5.0, 6.0}};
    assert_true(rescale_forward(&curve, 1.5) == 2.5 && rescale_forward(&curve, 3.0) == 5.5 &&
                rescale_forward(&curve, 0.0) == 0.0);
    assert_true(rescale_backward(&curve, 2.5) == 1.5 && rescale_backward(&curve, 99.0) == 4.0 &&
                rescale_backward(&curve, -1.0) == 1.0);
    assert_true(rescale_slope(&curve, 1.5) == 0.2 && rescale_slope(&curve, 3.0) == 2.0);
    for (double p = 1.0; p <= 4.0; p += 0.01)
        assert_true(fabs(rescale_backward(&curve, rescale_forward(&curve, p)) - p) < 1e-12);
}

/* The analytic cloth, seen at the models' starts, and the curves measured on it. */
struct fixture {
    struct fake_cloth cloth;
    struct estimator estimator;
    struct observation_set observation;
    struct fit_parameter parameter[FAKE_N_PARAM];
    struct coordinate k[FAKE_N_PARAM];
    struct rescale_curve curve[FAKE_N_PARAM];
    double start[FAKE_N_PARAM], wall_s;
    uint64_t n_path;
};

/* tight: index of a parameter whose upper bound is `upper`, below that of its model. */
static void setup(struct fixture *x, size_t tight, double upper)
{
    memset(x, 0, sizeof *x);
    fake_cloth_init(&x->cloth, 1, FAKE_N_FIT);
    x->estimator = fake_estimator(&x->cloth);
    for (size_t p = 0; p < FAKE_N_PARAM; p++) {
        x->start[p] = fake_param[p].start;
        x->parameter[p] =
            (struct fit_parameter){fake_param[p].lower, p == tight ? upper : fake_param[p].upper, x->start[p], false};
        coordinate_init(&x->k[p], &fake_param[p], x->parameter[p].lower, x->parameter[p].upper);
    }
    observation_set_init(&x->observation);
    assert_int_equal(fake_observe(&x->cloth, x->start, 0.0, 1, &x->observation), STATUS_OK);
}

static void measure(struct fixture *x, const struct estimator *e)
{
    size_t n_path[FAKE_N_FIT];
    for (size_t i = 0; i < FAKE_N_FIT; i++) n_path[i] = 256;
    const struct fit_problem problem = {.n_param = FAKE_N_PARAM,
                                        .info = fake_param,
                                        .parameter = x->parameter,
                                        .observation = &x->observation,
                                        .estimator = e};
    assert_int_equal(rescale_measure(&problem, x->k, n_path, x->curve, &x->n_path, &x->wall_s, NULL), STATUS_OK);
}

/* The bounds of the first channel of a colour do not limit the other channels, which have bounds of their own. */
static void test_bounds_of_one_channel(void **state)
{
    (void)state;
    struct fixture x;
    setup(&x, 3, 0.86);
    measure(&x, &x.estimator);
    for (size_t p = 0; p < FAKE_N_PARAM; p++) {
        assert_true(x.curve[p].c[x.curve[p].n - 1] == x.parameter[p].upper);
        assert_true(rescale_backward(&x.curve[p], 1e9) == x.parameter[p].upper);
    }
    assert_true(x.curve[3].r[1] == x.curve[4].r[1] &&
                x.curve[4].r[1] == x.curve[5].r[1]); /* a third of the colour's each */
    observation_set_release(&x.observation);
}

/* An estimator that fails the test when a parameter is outside of the bounds of the fit. */
static status run_strict(void *context, const struct estimator_call *call, const struct progress *progress,
                         struct estimate *out, double *wall_s, struct error *err)
{
    const struct fixture *x = context;
    for (size_t p = 0; p < FAKE_N_PARAM; p++)
        assert_true(call->param[p] >= x->k[p].param_lower && call->param[p] <= x->k[p].param_upper);
    return x->estimator.run(x->estimator.context, call, progress, out, wall_s, err);
}

/* The leader of a proportional tie has a narrower range than the other channels, because its follower must stay
 * inside the range of the model. */
static void test_channels_stay_within_their_own_bounds(void **state)
{
    (void)state;
    struct fixture x;
    setup(&x, 0, 0.4995);
    struct estimator strict = x.estimator;
    strict.context = &x;
    strict.run = run_strict;
    measure(&x, &strict);
    assert_true(x.curve[1].c[x.curve[1].n - 1] == fake_param[1].upper && x.curve[0].c[x.curve[0].n - 1] == 0.4995);
    observation_set_release(&x.observation);
}

/* Without noise the measured curve is exactly eq. 5.14, and each channel of a colour gets a third of it. */
static void test_measured_curve(void **state)
{
    (void)state;
    struct fixture x;
    setup(&x, FAKE_N_PARAM, 0.0);
    x.cloth.noise = 0.0;
    measure(&x, &x.estimator);
    for (size_t p = 0; p < FAKE_N_PARAM; p += p < 6 ? 3 : 1) {
        const struct rescale_curve *curve = &x.curve[p];
        double r = 0.0, low[FAKE_N_PARAM], high[FAKE_N_PARAM];
        for (size_t j = 0; j + 1 < curve->n; j++) {
            memcpy(low, x.start, sizeof low);
            memcpy(high, x.start, sizeof high);
            for (size_t s = 0; s < (p < 6 ? 3u : 1u); s++) {
                low[p + s] = curve->c[j];
                high[p + s] = curve->c[j + 1];
            }
            for (size_t i = 0; i < x.observation.n; i++) {
                double from[3], to[3];
                fake_radiance(&x.cloth.configuration[i], low, from, NULL);
                fake_radiance(&x.cloth.configuration[i], high, to, NULL);
                r += objective_weight(&x.observation.item[i]) * sqrt(objective_image_difference(from, to));
            }
            assert_true(fabs(curve->r[j + 1] - r / (p < 6 ? 3.0 : 1.0)) < 1e-6 * r + 1e-6);
        }
        if (p < 6) assert_memory_equal(curve, &x.curve[p + 2], sizeof *curve);
    }
    assert_true(x.n_path > 0 && x.wall_s > 0.0);
    observation_set_release(&x.observation);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_published_table),
                                       cmocka_unit_test(test_points_within_bounds),
                                       cmocka_unit_test(test_map),
                                       cmocka_unit_test(test_bounds_of_one_channel),
                                       cmocka_unit_test(test_channels_stay_within_their_own_bounds),
                                       cmocka_unit_test(test_measured_curve)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
