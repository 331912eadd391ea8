/* Fits to profiles that a model itself made, with known noise: what is found, the standard errors, ties of a grey
 * profile, the scale, priors, and profiles with too few rows. */
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

enum { N_THETA = 11, N_PHI = 24, N_SEED = 40 };

struct fit_case {
    const struct scattering_model *model;
    double truth[SCATTERING_MAX_PARAM];
    struct fit_parameter parameter[SCATTERING_MAX_PARAM];
    struct fit_option option;
    struct fiber_profile profile;
    struct profile_problem problem;
};

static void begin(struct fit_case *f, const char *id, size_t n_channel, double scale)
{
    memset(f, 0, sizeof *f);
    f->model = scattering_find(id);
    fit_option_init(&f->option);
    for (size_t p = 0; p < f->model->n_param; p++) {
        const struct param_info *info = &f->model->param[p];
        f->parameter[p] = (struct fit_parameter){info->lower, info->upper, info->start, false};
        f->truth[p] = info->start + 0.2 * (info->upper - info->start);
        if (info->channel > 0 && n_channel == 1) f->truth[p] = f->truth[p - 1];
        if (info->channel == 1 && n_channel == 3) f->truth[p] = info->start;
    }
    f->profile = (struct fiber_profile){.n = N_THETA * N_PHI, .n_channel = n_channel, .has_se = true, .last_line = 9};
    f->profile.row = calloc(f->profile.n, sizeof *f->profile.row);
    assert_non_null(f->profile.row);
    for (int i = 0; i < N_THETA * N_PHI; i++)
        f->profile.row[i] = (struct profile_row){.theta_i_rad = -40 * RAD_PER_DEG,
                                                 .theta_o_rad = (20 + 4 * (i / N_PHI)) * RAD_PER_DEG,
                                                 .phi_rad = (-20 + 10 * (i % N_PHI)) * RAD_PER_DEG};
    f->problem = (struct profile_problem){
        .model = f->model, .profile = &f->profile, .parameter = f->parameter, .option = &f->option, .scale = scale};
}

/* Radiances of the truth times the scale, with noise of 3 % and of 1 % of the brightest. */
static void measure(struct fit_case *f, double scale, uint64_t seed)
{
    const size_t n_channel = f->profile.n_channel, n = f->profile.n * n_channel;
    double *value = calloc(n, sizeof *value), most = 0;
    struct error err = {0};
    assert_non_null(value);
    assert_int_equal(
        profile_model_predict(f->model, f->truth, &f->profile, &(struct profile_work){0}, value, NULL, &err),
        STATUS_OK);
    for (size_t i = 0; i < n; i++) most = fmax(most, scale * value[i]);
    for (size_t i = 0; i < n; i++) {
        struct rng r;
        double u[2];
        rng_start(&r, &(struct rng_key){.seed = seed}, (uint32_t)i, 0);
        rng_normal_pair(&r, u);
        struct profile_row *row = &f->profile.row[i / n_channel];
        row->se[i % n_channel] = 0.03 * scale * value[i] + 0.01 * most;
        row->radiance[i % n_channel] = scale * value[i] + u[0] * row->se[i % n_channel];
    }
    free(value);
}

static void run(struct fit_case *f, struct profile_fit *fit)
{
    struct error err = {0};
    if (profile_fit_run(&f->problem, "p.csv", fit, &err) != STATUS_OK) fail_msg("%s", err.text);
}

static void end(struct fit_case *f) { fiber_profile_release(&f->profile); }

/* Over many noises the squared errors of each parameter, in stated variances, are those of a chi-square variable. The
 * stated error is the larger of two estimates, of which one has the relative standard deviation sqrt(2 / 24) / 2, so
 * the mean may be smaller by a fifth. Limits: probability 1e-4 on either side for 40 noises, 0.42 times 0.8 and 1.98.
 */
static void errors_are_as_stated(void **unused)
{
    double sum[SCATTERING_MAX_PARAM] = {0}, of_scale = 0, chi_square = 0;
    struct fit_case f;
    (void)unused;
    begin(&f, "two_lobe.v1", 1, NAN);
    f.parameter[0].fixed = f.parameter[1].fixed = f.parameter[2].fixed = true; /* C_R: the scale is fitted */
    for (size_t p = 0; p < 3; p++) f.parameter[p].start = f.truth[p];
    for (uint64_t seed = 1; seed <= N_SEED; seed++) {
        struct profile_fit fit;
        measure(&f, 2.5, seed);
        run(&f, &fit);
        assert_true(fit.converged && fit.n_start == PROFILE_LEAST_START && fit.n_free == 5);
        for (size_t p = 3; p < f.model->n_param; p++) {
            const double pull = (fit.param[p] - f.truth[p]) / fit.se_param[p];
            assert_true(fit.determined[p] && fit.se_param[p] > 0);
            sum[p] += pull * pull / N_SEED;
        }
        of_scale += pow((fit.scale - 2.5) / fit.scale_se, 2) / N_SEED;
        chi_square += fit.chi_square / N_SEED;
        assert_true(fit.param[3] == fit.param[4] && fit.param[3] == fit.param[5]);
        profile_fit_release(&fit);
    }
    for (size_t p = 3; p < f.model->n_param; p++)
        if (!(sum[p] > 0.42 * 0.8 && sum[p] < 1.98)) fail_msg("%s: %.3g", f.model->param[p].name, sum[p]);
    assert_true(of_scale > 0.42 * 0.8 && of_scale < 1.98);
    assert_true(fabs(chi_square - 1) < 4 * sqrt(2.0 / (N_SEED * (N_THETA * N_PHI - 5))));
    end(&f);
}

/* Three channels, a stated scale, and a near field: all within 4.5 standard errors. */
static void colors_and_near_field(void **unused)
{
    static const char *const id[] = {"dielectric.v1", "chiang.v1"};
    (void)unused;
    for (size_t k = 0; k < sizeof id / sizeof *id; k++) {
        struct fit_case f;
        struct profile_fit fit;
        begin(&f, id[k], 3, 1);
        measure(&f, 1, 7 + k);
        run(&f, &fit);
        assert_true(fit.scale == 1 && !(fit.scale_se > 0) && fit.n_free == f.model->n_param);
        for (size_t p = 0; p < f.model->n_param; p++)
            if (!(fabs(fit.param[p] - f.truth[p]) < 4.5 * fit.se_param[p]))
                fail_msg("%s %s: %g is not %g +- %g", id[k], f.model->param[p].name, fit.param[p], f.truth[p],
                         fit.se_param[p]);
        assert_true(fit.param[1] < fit.param[0] - 4 * fit.se_param[0]);
        profile_fit_release(&fit);
        end(&f);
    }
}

/* The residual as the fit weighs it, for each radiance less unknown: a share of m + 0.02 mean of m. */
static double weighted_residual(const struct fit_case *f, const struct profile_fit *fit)
{
    double mean = 0, square = 0;
    for (size_t i = 0; i < f->profile.n; i++) mean += f->profile.row[i].radiance[0] / (double)f->profile.n;
    for (size_t i = 0; i < f->profile.n; i++) {
        const double m = f->profile.row[i].radiance[0];
        square += pow((fit->value[i] - m) / (fmax(m, 0) + 0.02 * mean), 2);
    }
    return sqrt(square / (double)(f->profile.n - fit->n_free));
}

/* Without stated errors, and by a model that does not describe the fiber: what is left is misfit, and the errors that
 * contain it are larger than those of the noise. */
static void misfit(void **unused)
{
    struct fit_case f, other;
    struct profile_fit own, wrong, unstated;
    (void)unused;
    begin(&f, "two_lobe.v1", 1, 1);
    measure(&f, 1, 3);
    run(&f, &own);
    begin(&other, "isotropic.v1", 1, NAN);
    other.problem.profile = &f.profile;
    run(&other, &wrong);
    assert_true(wrong.nrmse > 2 * own.nrmse && wrong.misfit > own.misfit && wrong.chi_square > 2);
    f.profile.has_se = false;
    for (size_t i = 0; i < f.profile.n; i++) f.profile.row[i].se[0] = 0;
    run(&f, &unstated);
    assert_true(isnan(unstated.chi_square) && unstated.misfit > 0);
    assert_true(fabs(unstated.misfit / weighted_residual(&f, &unstated) - 1) <
                0.02); /* where the weights count as settled */
    for (size_t p = 0; p < f.model->n_param; p++)
        assert_true(fabs(unstated.param[p] - f.truth[p]) < 5 * unstated.se_param[p]);
    profile_fit_release(&own);
    profile_fit_release(&wrong);
    profile_fit_release(&unstated);
    end(&f);
    end(&other);
}

/* Dark rows whose stated errors are above all radiances do not choose the model, though they make its relative
 * residual: the rows of the highlight read 0, which the model without a highlight comes closer to. */
static void rows_of_large_errors_do_not_choose(void **unused)
{
    struct fit_case f, other;
    struct profile_fit own, wrong;
    double most = 0;
    (void)unused;
    begin(&f, "two_lobe.v1", 1, 1);
    measure(&f, 1, 3);
    for (size_t i = 0; i < f.profile.n; i++) most = fmax(most, f.profile.row[i].radiance[0]);
    for (size_t i = 5 * N_PHI; i < 6 * N_PHI; i++) {
        f.profile.row[i].radiance[0] = 0;
        f.profile.row[i].se[0] = 3 * most;
    }
    run(&f, &own);
    begin(&other, "isotropic.v1", 1, 1);
    fiber_profile_release(&other.profile);
    other.problem.profile = &f.profile;
    run(&other, &wrong);
    assert_true(own.rel_rms > wrong.rel_rms && own.bic < wrong.bic - 100);
    profile_fit_release(&own);
    profile_fit_release(&wrong);
    end(&f);
}

/* A profile that is dark but for a few radiances, with stated errors of 1 % of the brightest: what a measurement allows
 * and what is left are shares of 2 % of the brightest at least, so the former is
 * below 1/2, where shares of 2 % of the mean, 0.0007 of the brightest, are about 14. */
static void dark_profiles_are_judged_by_their_highlights(void **unused)
{
    enum { N_BRIGHT = 8 };
    struct fit_case f;
    struct profile_fit fit;
    double square = 0, stated = 0;
    (void)unused;
    begin(&f, "isotropic.v1", 1, 1);
    for (size_t i = 0; i < f.profile.n; i++) {
        f.profile.row[i].radiance[0] = i < N_BRIGHT ? 1 : i % 2 == 0 ? 0.01 : 0;
        f.profile.row[i].se[0] = 0.01;
    }
    run(&f, &fit);
    const double n = (double)f.profile.n, mean = (N_BRIGHT + 0.005 * (n - N_BRIGHT)) / n;
    for (size_t i = 0; i < f.profile.n; i++) {
        const double m = f.profile.row[i].radiance[0], base = fmax(m + 0.02 * mean, 0.02);
        square += pow((fit.value[i] - m) / base, 2) / n;
        stated += pow(f.profile.row[i].se[0] / base, 2) / n;
    }
    assert_true(fabs(fit.stated_rms / sqrt(stated) - 1) < 1e-9 && fabs(fit.rel_rms / sqrt(square) - 1) < 1e-9);
    assert_true(fit.stated_rms < 0.5);
    profile_fit_release(&fit);
    end(&f);
}

/* A sharp prior keeps a parameter where it says, bounds are kept, and what is held stays. */
static void priors_and_bounds(void **unused)
{
    struct fit_case f;
    struct profile_fit fit;
    (void)unused;
    begin(&f, "two_lobe.v1", 1, 1);
    measure(&f, 1, 5);
    const size_t beta_r = 6, beta_tt = 7, gamma_tt = 8;
    f.option.prior_mean[beta_r] = 0.5 * f.truth[beta_r];
    f.option.prior_se[beta_r] = 1e-5;
    f.parameter[beta_tt].upper = 0.9 * f.truth[beta_tt];
    f.parameter[beta_tt].start = fmin(f.parameter[beta_tt].start, f.parameter[beta_tt].upper);
    f.parameter[gamma_tt].fixed = true;
    run(&f, &fit);
    assert_true(fabs(fit.param[beta_r] / (0.5 * f.truth[beta_r]) - 1) < 1e-2);
    assert_true(fit.param[beta_tt] <= f.parameter[beta_tt].upper && fit.at_bound[beta_tt]);
    assert_true(fit.param[gamma_tt] == f.parameter[gamma_tt].start && !(fit.se_param[gamma_tt] > 0));
    profile_fit_release(&fit);
    end(&f);
}

/* Ties of the job hold in a grey profile too, where the channels of each color are tied besides. */
static void ties_of_a_grey_profile(void **unused)
{
    struct fit_case f;
    struct profile_fit fit;
    (void)unused;
    begin(&f, "two_lobe.v1", 1, 1);
    measure(&f, 1, 11);
    f.option.leader[1] = 4; /* C_R.g is half of C_TT.g */
    f.option.ratio[1] = 0.5;
    run(&f, &fit);
    assert_true(fabs(fit.param[1] / (0.5 * fit.param[4]) - 1) < 1e-12);
    assert_true(fit.param[0] == fit.param[2] && fit.param[3] == fit.param[4] && fit.param[3] == fit.param[5]);
    profile_fit_release(&fit);
    f.option.leader[1] = 1;
    f.option.leader[0] = 1; /* C_R.r is half of C_R.g */
    f.option.ratio[1] = 1;
    f.option.ratio[0] = 0.5;
    run(&f, &fit);
    assert_true(fabs(fit.param[0] / (0.5 * fit.param[1]) - 1) < 1e-12);
    profile_fit_release(&fit);
    end(&f);
}

/* The model of a fit that is cancelled after so many evaluations, and how many follow. */
static const struct scattering_model *cancelled_model;
static atomic_bool cancel;
static size_t n_before_cancel, n_after_cancel;

static void eval_and_cancel(const struct scattering_state *s, const float wi[3], const float wo[3], float s_rgb[3],
                            float *score)
{
    if (n_before_cancel > 0 && --n_before_cancel == 0) atomic_store(&cancel, true);
    n_after_cancel += atomic_load(&cancel);
    cancelled_model->eval(s, wi, wo, s_rgb, score);
}

/* A fit ends within the rows of one task, in the first evaluation of a start as in the last ones. */
static void cancelled_soon(void **unused)
{
    enum { VIEWS_OF_TASK = 32 * 128 };
    const size_t when[] = {1, 5000, 100000};
    (void)unused;
    for (size_t k = 0; k < sizeof when / sizeof *when; k++) {
        struct fit_case f;
        struct profile_fit fit;
        struct error err = {0};
        const struct progress progress = {.cancel = &cancel};
        begin(&f, "chiang.v1", 1, NAN);
        measure(&f, 1, 3);
        struct scattering_model m = *f.model;
        cancelled_model = f.model;
        m.eval = eval_and_cancel;
        f.problem.model = &m;
        f.problem.progress = &progress;
        atomic_store(&cancel, false);
        n_before_cancel = when[k];
        n_after_cancel = 0;
        assert_int_equal(profile_fit_run(&f.problem, "p.csv", &fit, &err), STATUS_CANCELLED);
        assert_true(n_after_cancel > 0 && n_after_cancel <= VIEWS_OF_TASK);
        profile_fit_release(&fit);
        end(&f);
    }
}

/* A turned elliptical section, each turn weighted by the width that it shows, is elliptical.v1 up to one factor: within
 * 1 % of the peak, as test_elliptical_oriented.c explains. The derivative by the ratio includes that of the width. */
static void turns_count_by_their_width(void **unused)
{
    (void)unused;
    enum { N = N_THETA * N_PHI, RATIO = 4 };
    const struct scattering_model *turned_at_random = scattering_find("elliptical.v1");
    static double turned[N], mean[N], jac[N * 8], moved[2][N];
    struct fit_case f;
    struct error err = {0};
    const struct profile_work alone = {0};
    const double h = 1e-4;
    double top[2] = {0, 0}, most = 0;
    begin(&f, "elliptical_oriented.v1", 1, NAN);
    f.truth[RATIO] = 1.8;
    assert_int_equal(profile_model_predict(f.model, f.truth, &f.profile, &alone, turned, jac, &err), STATUS_OK);
    assert_int_equal(profile_model_predict(turned_at_random, f.truth, &f.profile, &alone, mean, NULL, &err), STATUS_OK);
    for (int k = 0; k < 2; k++) {
        f.truth[RATIO] = 1.8 + (k == 0 ? -h : h);
        assert_int_equal(profile_model_predict(f.model, f.truth, &f.profile, &alone, moved[k], NULL, &err), STATUS_OK);
    }
    for (int i = 0; i < N; i++) {
        top[0] = fmax(top[0], turned[i]);
        top[1] = fmax(top[1], mean[i]);
        most = fmax(most, fabs(jac[i * 8 + RATIO]));
    }
    for (int i = 0; i < N; i++) {
        const double difference = (moved[1][i] - moved[0][i]) / (2 * h);
        assert_true(fabs(turned[i] / top[0] - mean[i] / top[1]) < 0.01);
        assert_true(fabs(difference - jac[i * 8 + RATIO]) < 0.01 * most);
    }
    end(&f);
}

static void too_few_rows(void **unused)
{
    struct fit_case f;
    struct profile_fit fit;
    struct error err = {0};
    (void)unused;
    begin(&f, "two_lobe.v1", 1, NAN);
    measure(&f, 1, 1);
    f.profile.n = 6; /* two colours, three widths and the scale */
    assert_int_equal(profile_fit_run(&f.problem, "p.csv", &fit, &err), STATUS_INVALID);
    assert_string_equal(err.field, OPTION_PROFILE_FILE);
    assert_non_null(strstr(err.text, "line 9"));
    assert_non_null(strstr(err.text, "6 unknowns with the scale"));
    f.profile.n = N_THETA * N_PHI;
    end(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(errors_are_as_stated),
                                       cmocka_unit_test(colors_and_near_field),
                                       cmocka_unit_test(misfit),
                                       cmocka_unit_test(priors_and_bounds),
                                       cmocka_unit_test(rows_of_large_errors_do_not_choose),
                                       cmocka_unit_test(dark_profiles_are_judged_by_their_highlights),
                                       cmocka_unit_test(ties_of_a_grey_profile),
                                       cmocka_unit_test(cancelled_soon),
                                       cmocka_unit_test(turns_count_by_their_width),
                                       cmocka_unit_test(too_few_rows)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
