/* Profiles with the azimuth of the light: the turn of a flat section and its errors, the ratio of an elliptical section
 * beside it, single modes, and profiles without these azimuths, which keep their meaning. */
#include "base/angle.h"
#include "base/option_id.h"
#include "base/rng.h"
#include "optimizer/fit/profile/profile_fit.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_PHI_I = 12, N_PHI = 24, N_ROW = N_PHI_I * N_PHI, N_SEED = 24, RATIO = 4, N_ELLIPTICAL = 8 };
static const double turn_rad = 37 * RAD_PER_DEG;

struct turn_case {
    const struct scattering_model *model;
    double truth[SCATTERING_MAX_PARAM];
    struct fit_parameter parameter[SCATTERING_MAX_PARAM];
    struct fit_option option;
    struct profile_row row[N_ROW];
    struct fiber_profile profile;
    struct profile_problem problem;
};

/* All parameters are held at their truth; a fit frees some of them. */
static void begin(struct turn_case *f, const char *id)
{
    memset(f, 0, sizeof *f);
    f->model = scattering_find(id);
    fit_option_init(&f->option);
    for (size_t p = 0; p < f->model->n_param; p++) {
        const struct param_info *info = &f->model->param[p];
        f->truth[p] = info->start;
        f->parameter[p] = (struct fit_parameter){info->lower, info->upper, info->start, true};
    }
    f->profile = (struct fiber_profile){
        .n = N_ROW, .n_channel = 1, .has_se = true, .has_phi_i = true, .last_line = 9, .row = f->row};
    for (int i = 0; i < N_ROW; i++)
        f->row[i] = (struct profile_row){.theta_i_rad = -30 * RAD_PER_DEG,
                                         .theta_o_rad = 30 * RAD_PER_DEG,
                                         .phi_i_rad = 30.0 * (i / N_PHI) * RAD_PER_DEG,
                                         .phi_rad = (15.0 * (i % N_PHI) + 5) * RAD_PER_DEG};
    f->problem = (struct profile_problem){.model = f->model,
                                          .profile = &f->profile,
                                          .parameter = f->parameter,
                                          .option = &f->option,
                                          .scale = NAN,
                                          .turn_rad = NAN};
}

static void predict(const struct turn_case *f, const struct profile_work *work, double *value, double *jac)
{
    struct error err = {0};
    if (profile_model_predict(f->model, f->truth, &f->profile, work, value, jac, &err) != STATUS_OK)
        fail_msg("%s", err.text);
}

/* Radiances of the truth with noise of 3 % and of 1 % of the brightest. */
static void measure(struct turn_case *f, const double *value, uint64_t seed)
{
    double most = 0;
    for (int i = 0; i < N_ROW; i++) most = fmax(most, value[i]);
    for (int i = 0; i < N_ROW; i++) {
        struct rng r;
        double u[2];
        rng_start(&r, &(struct rng_key){.seed = seed}, (uint32_t)i, 0);
        rng_normal_pair(&r, u);
        f->row[i].se[0] = 0.03 * value[i] + 0.01 * most;
        f->row[i].radiance[0] = value[i] + u[0] * f->row[i].se[0];
    }
}

static void run(const struct turn_case *f, struct profile_fit *fit)
{
    struct error err = {0};
    if (profile_fit_run(&f->problem, "p.csv", fit, &err) != STATUS_OK) fail_msg("%s", err.text);
}

static size_t index_of(const struct turn_case *f, const char *name)
{
    const int p = scattering_param_index(f->model, name);
    assert_true(p >= 0);
    return (size_t)p;
}

/* Over many noises the squared errors of the turn, in stated variances, are chi-square distributed, as in
 * test_profile_fit.c. Limits: probability 1e-4 on either side for 24 noises, 0.30 times 0.8 and 2.4. */
static void errors_of_the_turn_are_as_stated(void **unused)
{
    (void)unused;
    struct turn_case f;
    double value[N_ROW], sum = 0;
    begin(&f, "textile.v3");
    f.truth[index_of(&f, "f")] = f.parameter[index_of(&f, "f")].start = 0.4;
    predict(&f, &(struct profile_work){.turn_rad = turn_rad}, value, NULL);
    for (uint64_t seed = 1; seed <= N_SEED; seed++) {
        struct profile_fit fit;
        measure(&f, value, seed);
        run(&f, &fit);
        assert_true(fit.has_turn && fit.turn_determined && fit.n_free == 2 && fit.turn_se_rad > 0);
        sum += pow((fit.turn_rad - turn_rad) / fit.turn_se_rad, 2) / N_SEED;
        assert_true(fabs(fit.chi_square - 1) < 5 * sqrt(2.0 / (N_ROW - 2)));
        profile_fit_release(&fit);
    }
    print_message("squared errors of the turn over stated variances: %.3g\n", sum);
    assert_true(sum > 0.30 * 0.8 && sum < 2.4);
}

/* The ratio and the turn of an elliptical section, from starts at another ratio. */
static void ratio_and_turn(void **unused)
{
    (void)unused;
    struct turn_case f;
    struct profile_fit fit;
    double value[N_ROW];
    begin(&f, "elliptical_oriented.v1");
    f.truth[RATIO] = 1.6;
    f.parameter[RATIO].fixed = false;
    predict(&f, &(struct profile_work){.turn_rad = turn_rad}, value, NULL);
    measure(&f, value, 5);
    f.problem.max_iteration = 12;
    run(&f, &fit);
    print_message("ratio %.4f +- %.4f, turn %.2f +- %.2f degrees, %zu of %zu starts, %.1f s\n", fit.param[RATIO],
                  fit.se_param[RATIO], angle_to_deg(fit.turn_rad), angle_to_deg(fit.turn_se_rad), fit.n_agree,
                  fit.n_start, fit.wall_s);
    assert_true(fit.se_param[RATIO] < 0.05 && fit.turn_se_rad < 2 * RAD_PER_DEG && fit.n_free == 3);
    assert_true(fabs(fit.param[RATIO] - 1.6) < 4 * fit.se_param[RATIO]);
    assert_true(fabs(fit.turn_rad - turn_rad) < 4 * fit.turn_se_rad);
    profile_fit_release(&fit);
}

/* Modes alone add up to all of them but for the scales that balance the modes, which are at most 6 % from 1 in each
 * direction. The derivative of R, which has a closed form, by the ratio is that of its values: a difference over 0.01
 * misses it by their third derivative, (0.005 / 1.4)^2. The derivative by the turn is that of the values: the two
 * differences, over 0.5 and 1 degree on each side, differ by what lobes of 3.5 degrees bend, 4 % of the largest. */
static void modes_and_derivatives(void **unused)
{
    (void)unused;
    struct turn_case f;
    static double all[N_ROW], one[N_ROW], part[N_ROW * N_ELLIPTICAL], sum[N_ROW], by_turn[N_ROW], moved[2][N_ROW];
    double top = 0, steepest = 0, top_slope = 0;
    begin(&f, "elliptical_oriented.v1");
    f.truth[RATIO] = 1.4;
    predict(&f, &(struct profile_work){.turn_rad = turn_rad, .by_turn = by_turn}, all, NULL);
    for (size_t k = 0; f.model->mode[k] != NULL; k++) {
        predict(&f, &(struct profile_work){.turn_rad = turn_rad, .mode = k + 1}, one, NULL);
        for (int i = 0; i < N_ROW; i++) sum[i] += one[i];
    }
    for (int k = 0; k < 2; k++)
        predict(&f, &(struct profile_work){.turn_rad = turn_rad + (2 * k - 1) * RAD_PER_DEG}, moved[k], NULL);
    for (int i = 0; i < N_ROW; i++) top = fmax(top, all[i]), steepest = fmax(steepest, fabs(by_turn[i]));
    for (int i = 0; i < N_ROW; i++) {
        assert_true(fabs(sum[i] - all[i]) < 0.12 * all[i]);
        assert_true(fabs((moved[1][i] - moved[0][i]) / (2 * RAD_PER_DEG) - by_turn[i]) < 0.04 * steepest);
    }
    predict(&f, &(struct profile_work){.turn_rad = turn_rad + M_PI}, one, NULL);
    for (int i = 0; i < N_ROW; i++) assert_true(fabs(one[i] - all[i]) < 1e-4 * top);
    predict(&f, &(struct profile_work){.turn_rad = turn_rad, .mode = 1}, one, part);
    for (int k = 0; k < 2; k++) {
        f.truth[RATIO] = 1.4 + 0.01 * (k - 0.5);
        predict(&f, &(struct profile_work){.turn_rad = turn_rad, .mode = 1}, moved[k], NULL);
    }
    for (int i = 0; i < N_ROW; i++) top_slope = fmax(top_slope, fabs(part[i * N_ELLIPTICAL + RATIO]));
    for (int i = 0; i < N_ROW; i++)
        assert_true(fabs((moved[1][i] - moved[0][i]) / 0.01 - part[i * N_ELLIPTICAL + RATIO]) < 1e-3 * top_slope);
}

static void note(void *context, size_t k, const double *value)
{
    double *found = context;
    found[k] = value[3];
}

/* A scan gives the values of each turn; without azimuths of the light it is the mean over all turns, whatever is
 * asked. */
static void scan_and_mean(void **unused)
{
    (void)unused;
    struct turn_case f;
    double value[N_ROW], mean[N_ROW], found[4];
    struct error err = {0};
    begin(&f, "textile.v3");
    f.truth[index_of(&f, "f")] = 0.4;
    const struct profile_scan scan = {4, value, note, found};
    assert_int_equal(profile_model_scan(f.model, f.truth, &f.profile, &(struct profile_work){0}, &scan, &err),
                     STATUS_OK);
    for (int k = 0; k < 4; k++) {
        predict(&f, &(struct profile_work){.turn_rad = M_PI_4 * k}, value, NULL);
        assert_true(fabs(value[3] - found[k]) <= 1e-9 * value[3]);
    }
    assert_true(fabs(found[0] / found[2] - 1) > 0.02);
    f.profile.has_phi_i = false;
    predict(&f, &(struct profile_work){0}, mean, NULL);
    predict(&f, &(struct profile_work){.turn_rad = 1}, value, NULL);
    for (int i = 0; i < N_ROW; i++) assert_true(fabs(value[i] - mean[i % N_PHI]) <= 1e-9 * mean[i % N_PHI]);
    measure(&f, value, 2);
    struct profile_fit fit;
    f.parameter[index_of(&f, "beta_R")].fixed = false;
    run(&f, &fit);
    assert_true(!fit.has_turn && fit.n_free == 2);
    profile_fit_release(&fit);
}

/* A turn that is given is kept, and a mode that a model does not have alone is refused. */
static void given_turn_and_modes(void **unused)
{
    (void)unused;
    struct turn_case f;
    struct profile_fit fit;
    struct error err = {0};
    double value[N_ROW];
    begin(&f, "textile.v3");
    predict(&f, &(struct profile_work){.turn_rad = turn_rad}, value, NULL);
    measure(&f, value, 1);
    f.problem.turn_rad = 200 * RAD_PER_DEG;
    run(&f, &fit);
    assert_true(fit.has_turn && fit.n_free == 1 && !(fit.turn_se_rad > 0));
    assert_true(fabs(fit.turn_rad - 20 * RAD_PER_DEG) < 1e-9);
    profile_fit_release(&fit);
    f.problem.mode = "TRT";
    assert_int_equal(profile_fit_run(&f.problem, "p.csv", &fit, &err), STATUS_INVALID);
    assert_string_equal(err.field, OPTION_PROFILE_MODE);
    assert_non_null(strstr(err.text, "textile.v3"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(errors_of_the_turn_are_as_stated),
                                       cmocka_unit_test(ratio_and_turn), cmocka_unit_test(modes_and_derivatives),
                                       cmocka_unit_test(scan_and_mean), cmocka_unit_test(given_turn_and_modes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
