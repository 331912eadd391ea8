/* The error of a color matrix is one error for all photographs. Errors of the parameters that the fit states are
 * compared with the scatter of fits of photographs whose matrix differs from draw to draw. */
#include "base/rng.h"
#include "optimizer/fit/objective/objective.h"
#include "optimizer/photographs/camera/chart_fit.h"
#include "tests/support/fit_fixture.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

enum { N_DRAW = 60 };

/* Covariance of each row of a matrix near to one: 2 % of its own channel, 1 % of the others, correlated. */
static const double row_cov[3][9] = {
    {4e-4, -8e-5, 0, -8e-5, 1e-4, 2e-5, 0, 2e-5, 1e-4},
    {1e-4, 5e-5, 0, 5e-5, 4e-4, -6e-5, 0, -6e-5, 1e-4},
    {1e-4, 0, 3e-5, 0, 1e-4, 5e-5, 3e-5, 5e-5, 4e-4},
};

/* States the errors of the matrix, and changes the radiances by one draw of them. */
static void apply_draw(struct observation_set *o, struct rng *rng)
{
    double z[3][4], cov[81] = {0}, all[3][COLOR_MATRIX_CAUSES];
    for (size_t c = 0; c < 3; c++) {
        rng_normal_pair(rng, z[c]);
        rng_normal_pair(rng, z[c] + 2);
    }
    for (size_t k = 0; k < 27; k++) cov[9 * (k / 9 * 3 + k % 9 / 3) + k / 9 * 3 + k % 3] = row_cov[k / 9][k % 9];
    for (size_t i = 0; i < o->n; i++) {
        double truth[3];
        memcpy(truth, o->item[i].mean_rgb, sizeof truth);
        color_matrix_error(cov, truth, all);
        for (size_t c = 0; c < 3; c++) {
            double *error = o->item[i].photograph.color_error[c];
            memcpy(error, all[c], sizeof all[c]);
            for (size_t cause = 0; cause < 9; cause++) o->item[i].mean_rgb[c] += z[cause / 3][cause % 3] * error[cause];
            o->item[i].se_rgb[c] = hypot(o->item[i].se_rgb[c], photograph_color_se(&o->item[i].photograph, c));
        }
    }
}

/* Fits one draw. value: the parameters. stated: adds the variances that the fit states to their mean over the draws. */
static void fit_draw(uint64_t draw, double value[FAKE_N_PARAM], double stated[FAKE_N_PARAM])
{
    struct fit_fixture x;
    struct fit_result r;
    struct rng rng;
    fit_fixture_init(&x, fit_fixture_mid_range, 1, true, 0.001);
    rng_start(&rng, &(struct rng_key){.seed = 500 + draw}, 0, 0);
    apply_draw(&x.observation, &rng);
    fit_fixture_run(&x, &r);
    for (size_t p = 0; p < FAKE_N_PARAM; p++) {
        value[p] = r.param[p];
        stated[p] += r.uncertainty.se_param[p] * r.uncertainty.se_param[p] / N_DRAW;
    }
    fit_fixture_release(&x);
}

/* Errors that counted as independent between rows would be 4 times too large for a colour, 16 times for beta_TT, and
 * 17 % too small for another colour. What the parameters cannot follow of the matrix's error counts as misfit, too, so
 * the stated errors are larger than the scatter, most of all that of beta_TT, which hardly depends on colors. */
static void test_stated_errors_are_those_of_the_matrix(void **state)
{
    (void)state;
    double mean[FAKE_N_PARAM] = {0}, square[FAKE_N_PARAM] = {0}, stated[FAKE_N_PARAM] = {0};
    for (uint64_t draw = 0; draw < N_DRAW; draw++) {
        double value[FAKE_N_PARAM];
        fit_draw(draw, value, stated);
        for (size_t p = 0; p < FAKE_N_PARAM; p++) {
            mean[p] += value[p] / N_DRAW;
            square[p] += value[p] * value[p] / N_DRAW;
        }
    }
    for (size_t p = 0; p < FAKE_N_PARAM; p++) {
        double ratio = sqrt(stated[p] / ((square[p] - mean[p] * mean[p]) * N_DRAW / (N_DRAW - 1.0)));
        print_message("%s: stated error over scatter %.2f\n", fake_param[p].name, ratio);
        assert_true(ratio > 0.9 && ratio < (strcmp(fake_param[p].name, "beta_TT") == 0 ? 3.5 : 1.7));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_stated_errors_are_those_of_the_matrix),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
