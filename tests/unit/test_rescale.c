/* The published rescaling curves: the table of appendix B.1, the curve's definition, and the piecewise linear map. */
#include "optimizer/descent/rescale.h"
#include "tests/support/fake_estimator.h"

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
    struct param_info alpha = {"alpha.r", "alpha", "", 0, 0.001, 0.999, 0.85};
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

/* Channels of one colour with bounds of their own are not held to those of the first. */
static void test_bounds_of_one_channel(void **state)
{
    (void)state;
    struct fake_cloth f;
    struct observation_set o;
    struct fit_parameter parameter[FAKE_N_PARAM];
    struct coordinate k[FAKE_N_PARAM];
    struct rescale_curve curve[FAKE_N_PARAM];
    size_t n_path[FAKE_N_FIT];
    double start[FAKE_N_PARAM], wall_s = 0.0;
    uint64_t used = 0;
    fake_cloth_init(&f, 1, FAKE_N_FIT);
    struct estimator e = fake_estimator(&f);
    for (size_t p = 0; p < FAKE_N_PARAM; p++) {
        double upper = p == 3 ? 0.86 : fake_param[p].upper;
        start[p] = fake_param[p].start;
        parameter[p] = (struct fit_parameter){fake_param[p].lower, upper, start[p], false};
        coordinate_init(&k[p], &fake_param[p], fake_param[p].lower, upper);
    }
    for (size_t i = 0; i < FAKE_N_FIT; i++) n_path[i] = 256;
    observation_set_init(&o);
    assert_int_equal(fake_observe(&f, start, 0.0, 1, &o), STATUS_OK);
    struct fit_problem problem = {
        .n_param = FAKE_N_PARAM, .info = fake_param, .param = parameter, .observation = &o, .estimator = &e};
    assert_int_equal(rescale_measure(&problem, k, n_path, curve, &used, &wall_s, NULL), STATUS_OK);
    for (size_t p = 0; p < FAKE_N_PARAM; p++) {
        assert_true(curve[p].c[curve[p].n - 1] == parameter[p].upper);
        assert_true(rescale_backward(&curve[p], 1e9) == parameter[p].upper);
    }
    assert_true(curve[3].r[1] == curve[4].r[1] && curve[4].r[1] == curve[5].r[1]); /* a third of the colour's each */
    observation_set_release(&o);
}

/* An estimator that a fit may not ask for anything beyond the bounds of its parameters. */
struct strict {
    struct estimator inner;
    const struct coordinate *k;
};

static status run_strict(void *context, const struct estimator_call *call, const struct progress *progress, struct estimate *out,
                         double *wall_s, struct error *err)
{
    const struct strict *s = context;
    for (size_t p = 0; p < FAKE_N_PARAM; p++) assert_true(call->param[p] >= s->k[p].param_lower && call->param[p] <= s->k[p].param_upper);
    return s->inner.run(s->inner.context, call, progress, out, wall_s, err);
}

/* The leader of a tie in proportion may not go as far as the channels beside it: what follows it would leave the model's range. */
static void test_channels_stay_within_their_own_bounds(void **state)
{
    (void)state;
    struct fake_cloth f;
    struct observation_set o;
    struct fit_parameter parameter[FAKE_N_PARAM];
    struct coordinate k[FAKE_N_PARAM];
    struct rescale_curve curve[FAKE_N_PARAM];
    size_t n_path[FAKE_N_FIT];
    double start[FAKE_N_PARAM], wall_s = 0.0;
    uint64_t used = 0;
    fake_cloth_init(&f, 1, FAKE_N_FIT);
    struct strict strict = {fake_estimator(&f), k};
    struct estimator e = strict.inner;
    e.context = &strict;
    e.run = run_strict;
    for (size_t p = 0; p < FAKE_N_PARAM; p++) {
        double upper = p == 0 ? 0.4995 : fake_param[p].upper;
        start[p] = fake_param[p].start;
        parameter[p] = (struct fit_parameter){fake_param[p].lower, upper, start[p], false};
        coordinate_init(&k[p], &fake_param[p], fake_param[p].lower, upper);
    }
    for (size_t i = 0; i < FAKE_N_FIT; i++) n_path[i] = 256;
    observation_set_init(&o);
    assert_int_equal(fake_observe(&f, start, 0.0, 1, &o), STATUS_OK);
    const struct fit_problem problem = {
        .n_param = FAKE_N_PARAM, .info = fake_param, .param = parameter, .observation = &o, .estimator = &e};
    assert_int_equal(rescale_measure(&problem, k, n_path, curve, &used, &wall_s, NULL), STATUS_OK);
    assert_true(curve[1].c[curve[1].n - 1] == fake_param[1].upper && curve[0].c[curve[0].n - 1] == 0.4995);
    observation_set_release(&o);
}

/* Without noise the measured curve is eq. 5.14 word for word, and colours get a third of it. */
static void test_measured_curve(void **state)
{
    (void)state;
    struct fake_cloth f;
    struct observation_set o;
    struct fit_parameter parameter[FAKE_N_PARAM];
    struct coordinate k[FAKE_N_PARAM];
    struct rescale_curve curve[FAKE_N_PARAM];
    size_t n_path[FAKE_N_FIT];
    double truth[FAKE_N_PARAM] = {0}, wall_s = 0.0;
    uint64_t used = 0;
    fake_cloth_init(&f, 1, FAKE_N_FIT);
    f.noise = 0.0;
    struct estimator e = fake_estimator(&f);
    for (size_t p = 0; p < FAKE_N_PARAM; p++) {
        truth[p] = fake_param[p].start;
        parameter[p] = (struct fit_parameter){fake_param[p].lower, fake_param[p].upper, fake_param[p].start, false};
        coordinate_init(&k[p], &fake_param[p], fake_param[p].lower, fake_param[p].upper);
    }
    for (size_t i = 0; i < FAKE_N_FIT; i++) n_path[i] = 256;
    observation_set_init(&o);
    assert_int_equal(fake_observe(&f, truth, 0.0, 1, &o), STATUS_OK);
    struct fit_problem problem = {
        .n_param = FAKE_N_PARAM, .info = fake_param, .param = parameter, .observation = &o, .estimator = &e};
    assert_int_equal(rescale_measure(&problem, k, n_path, curve, &used, &wall_s, NULL), STATUS_OK);
    for (size_t p = 0; p < FAKE_N_PARAM; p += p < 6 ? 3 : 1) {
        double r = 0.0, low[FAKE_N_PARAM], high[FAKE_N_PARAM];
        for (size_t j = 0; j + 1 < curve[p].n; j++) {
            memcpy(low, truth, sizeof low);
            memcpy(high, truth, sizeof high);
            for (size_t s = 0; s < (p < 6 ? 3u : 1u); s++) {
                low[p + s] = curve[p].c[j];
                high[p + s] = curve[p].c[j + 1];
            }
            for (size_t i = 0; i < o.n; i++) {
                double x[3], y[3];
                fake_radiance(&f.configuration[i], low, x, NULL);
                fake_radiance(&f.configuration[i], high, y, NULL);
                r += objective_weight(&o.item[i]) * sqrt(objective_image_difference(x, y));
            }
            assert_true(fabs(curve[p].r[j + 1] - r / (p < 6 ? 3.0 : 1.0)) < 1e-6 * r + 1e-6);
        }
        if (p < 6) assert_memory_equal(&curve[p], &curve[p + 2], sizeof curve[p]);
    }
    assert_true(used > 0 && wall_s > 0.0);
    observation_set_release(&o);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_published_table),
                                       cmocka_unit_test(test_points_within_bounds), cmocka_unit_test(test_map),
                                       cmocka_unit_test(test_bounds_of_one_channel),
        cmocka_unit_test(test_channels_stay_within_their_own_bounds),
                                       cmocka_unit_test(test_measured_curve)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
