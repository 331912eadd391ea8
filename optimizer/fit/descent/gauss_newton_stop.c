/* When gauss_newton.v1 ends.
 *
 * It has arrived when the decrease of the objective that several undamped steps could bring (far_decrease, by the
 * curvature without the noise of J) is within the noise, or below arrived_share of the weighted objective, under which
 * the curvature of the model does not determine it, or good enough: below target_share of the weighted objective or
 * target_rel_rms. One step would not do for that test: where a model does not fit, steps are short and each brings
 * little, so such fits would end on their way.
 *
 * The fit ends when it has arrived, there is no regularization any more, and the noise is good enough too: below
 * target_share of the plain objective or target_rel_rms, or, where neither a budget nor a goal of precision was asked
 * for, below photograph_share of the variance of a residual by the photographs' own errors, or where the job states a
 * goal of precision, when that is reached. A fit whose paths or iterations are used up before that has converged if it
 * had arrived. */
#include "optimizer/fit/descent/gauss_newton.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Excess of the relative RMS error through noise in the parameters that is good enough whatever the misfit is, and
 * the share of the objective that is. */
static const double target_rel_rms = 0.0007, target_share = 0.002;
/* Variance of a residual by tracing, in units of the variance by the photographs' stated errors, that ends a fit with
 * the default budget: its errors are then sqrt(1 + photograph_share) times the errors with exact renderings. The pooled
 * means must have least_effective paths each, because their derivatives are several times noisier than they are. */
static const double photograph_share = 0.6, least_effective = 120000.0;
/* Share of the objective below which the curvature of the model does not determine a predicted decrease. */
static const double arrived_share = 0.02;

/* Where misfit makes the residuals: the share of the weighted objective that the noise of the parameters may add to it
 * when the regularization ends and at the end (5 % of it are 2.5 % of the relative RMS error), the share that shows a
 * place where paths are too noisy, the share by which f must fall for an iteration to count as progress, and the
 * iterations without progress that end the fit. The steps of Gauss-Newton promise too much where residuals are large,
 * because the curvature of the renderings is not in J'J. */
static const double end_noise_share = 0.05, trap_noise_share = 0.15, progress_share = 0.02;
enum { MOST_STALLED = 3 };

double gauss_newton_noise(const struct gauss_newton *g) { return 2.0 * (double)g->n_free * g->noise; }

/* Decrease of the objective f below which another step is not worth its paths. */
static double good_enough(const struct gauss_newton *g, double f)
{
    return fmax(target_share * f, target_rel_rms * target_rel_rms * (double)g->model.n_row);
}

/* Uses the mean noise over all rows, because f weighs them equally. The rows that determine the fit are less noisy,
 * so this test is conservative. */
bool gauss_newton_precise(const struct gauss_newton *g, double f, double se)
{
    return 2.0 * (double)g->n_free * linear_model_mean_noise(&g->model) <= good_enough(g, f - 2.0 * se);
}

/* Variance of a residual by tracing over that by the photographs' stated errors; infinite where they state none. */
static double noise_ratio(const struct gauss_newton *g)
{
    double photograph = 0.0;
    for (size_t row = 0; row < g->model.n_row; row++) photograph += g->model.weight[row] * g->model.photograph_var[row];
    return g->noise * (double)g->model.n_row / photograph;
}

/* Error of the fitted means through the noise of tracing over that through the photographs' stated errors; infinite
 * where they state none. Both are sums of squares over the rows: for tracing the part of the weighted objective by
 * noise in the parameters, and for the photographs their mean variance for each free parameter. */
static double error_ratio(const struct gauss_newton *g)
{
    double photograph = 0.0;
    for (size_t row = 0; row < g->model.n_row; row++) photograph += g->model.weight[row] * g->model.photograph_var[row];
    return sqrt(g->noise_decrease * (double)g->model.n_row / (photograph * (double)g->n_free));
}

bool gauss_newton_as_precise_as_asked(const struct gauss_newton *g)
{
    return g->run.problem->precision > 0.0 && error_ratio(g) <= g->run.problem->precision;
}

double gauss_newton_paths_to_grow(const struct gauss_newton *g, double f, double se)
{
    double precise =
        2.0 * (double)g->n_free * linear_model_mean_noise(&g->model) / good_enough(g, fmax(0.0, f - 2.0 * se));
    if (g->run.problem->precision > 0.0) {
        const double ratio = error_ratio(g) / g->run.problem->precision;
        return fmin(precise, ratio * ratio);
    }
    if (g->run.problem->path_budget > 0) return precise;
    return fmin(precise, fmax(noise_ratio(g) / photograph_share, least_effective / g->model.n_effective));
}

double gauss_newton_paths_to_misfit(const struct gauss_newton *g)
{
    const struct linear_model *m = &g->model;
    const bool stalled = !g->regularized && g->n_stalled > 0;
    double photograph = 0.0, left = linear_model_weighted_objective(m) - (stalled ? 0.0 : g->far_decrease);
    for (size_t row = 0; row < m->n_row; row++) photograph += m->weight[row] * m->photograph_var[row];
    return left > photograph ? g->noise_decrease / (end_noise_share * left) : INFINITY;
}

bool gauss_newton_as_good_as_photographs(const struct gauss_newton *g)
{
    return g->run.problem->path_budget == 0 && !(g->run.problem->precision > 0.0) &&
           g->model.n_effective >= least_effective && noise_ratio(g) <= photograph_share;
}

bool gauss_newton_arrived(const struct gauss_newton *g)
{
    double weighted = linear_model_weighted_objective(&g->model); /* the decreases refer to it */
    return g->far_decrease <= fmax(gauss_newton_noise(g), fmax(arrived_share * weighted, good_enough(g, weighted)));
}

/* Whether misfit, not noise, makes the residuals: it is larger than the photographs' own variance, and the noise of the
 * parameters adds next to nothing to the objective. */
static bool misfit_rules(const struct gauss_newton *g)
{
    const struct linear_model *m = &g->model;
    double photograph = 0.0, n = 0.0;
    for (size_t row = 0; row < m->n_row; row++) {
        if (!(m->extra[row] > 0.0)) continue;
        photograph += m->photograph_var[row] / m->extra[row];
        n += 1.0;
    }
    return n > 0.0 && linear_model_misfit(m, g->n_free) > photograph / n &&
           g->noise_decrease <= end_noise_share * linear_model_weighted_objective(m);
}

/* Whether further steps promise no more than those that follow noise alone, or next to nothing. */
static bool arrived_at_misfit(const struct gauss_newton *g)
{
    return g->far_decrease <= g->noise_decrease + arrived_share * linear_model_weighted_objective(&g->model);
}

bool gauss_newton_regularized_at_misfit(const struct gauss_newton *g)
{
    return g->regularized && arrived_at_misfit(g) && misfit_rules(g);
}

bool gauss_newton_in_noise_trap(const struct gauss_newton *g)
{
    double noise = uncertainty_noise_decrease(&g->model, g->run.coordinate, g->run.fixed);
    return g->at_misfit && noise > trap_noise_share * linear_model_weighted_objective(&g->model);
}

void gauss_newton_judge_progress(struct gauss_newton *g, double f, double se)
{
    const bool first = !g->judged, lower = first || f < g->lowest_f;
    const bool progress = first || f < g->lowest_f - fmax(progress_share * g->lowest_f, se);
    g->n_stalled = progress ? 0 : g->n_stalled + 1;
    g->judged = true;
    if (!lower) return;
    g->lowest_f = f;
    memcpy(g->lowest_x, g->model.x_ref, sizeof g->lowest_x);
}

bool gauss_newton_ends_at_misfit(const struct gauss_newton *g)
{
    return !g->regularized && misfit_rules(g) && (arrived_at_misfit(g) || g->n_stalled >= MOST_STALLED);
}

/* Share of the weighted objective, in percent, that further steps are predicted to remove, rounded to two digits. The
 * prediction is of first order, so it is cut at 100. */
static double promised_percent(const struct gauss_newton *g)
{
    double weighted = linear_model_weighted_objective(&g->model);
    double percent = weighted > 0.0 ? fmin(100.0, 100.0 * g->far_decrease / weighted) : 100.0;
    double digit = percent > 0.0 ? pow(10.0, floor(log10(percent)) - 1.0) : 1.0;
    return digit * round(percent / digit);
}

void gauss_newton_explain_end(const struct gauss_newton *g, bool precise, double f, double se,
                              struct fit_result *result)
{
    char *text = result->reason;
    size_t n = sizeof result->reason;
    const double ratio = g->run.problem->precision > 0.0 ? error_ratio(g) : 0.0;
    result->stop = precise ? STOP_ARRIVED : STOP_ARRIVED_WITHIN_PHOTOGRAPHS;
    if (precise)
        snprintf(text, n,
                 "further steps promise to lower the sum of squared errors, %.3g with a noise of %.1g, by %g %%", f, se,
                 promised_percent(g));
    else if (ratio > 0.0)
        snprintf(text, n,
                 "further steps promise to lower the sum of squared errors by %g %%, and the noise of tracing makes "
                 "%.2g times the "
                 "error of the fitted means that the photographs' own errors make",
                 promised_percent(g), ratio);
    else
        snprintf(text, n,
                 "further steps promise to lower the sum of squared errors by %g %%, and tracing adds %.1f times the "
                 "photographs' own "
                 "variance; exact renderings would narrow the errors by some %.0f %%",
                 promised_percent(g), noise_ratio(g), 100.0 * (1.0 - 1.0 / sqrt(1.0 + noise_ratio(g))));
}

void gauss_newton_explain_misfit(const struct gauss_newton *g, double f, double se, struct fit_result *result)
{
    result->stop = STOP_MISFIT;
    snprintf(result->reason, sizeof result->reason,
             "what is left is a difference between model and measurements of about %.2g %%, more paths from this start "
             "will not lower it: the sum of squared errors is %.3g with a noise of %.1g",
             100.0 * sqrt(linear_model_misfit(&g->model, g->n_free)), f, se);
}

void gauss_newton_explain_early_end(const struct gauss_newton *g, const struct gauss_newton_end *end,
                                    struct fit_result *result)
{
    const double f = end->objective, se = end->objective_se;
    const char *used = end->used_up == STOP_ITERATIONS ? "the iterations" : "the path budget";
    char *text = result->reason;
    size_t n = sizeof result->reason;
    bool explained = result->converged || !(end->failed || end->arrived);
    result->stop = explained ? end->used_up : end->failed ? STOP_STEP_TAKEN_BACK : STOP_TOO_FEW_STEPS;
    if (result->converged)
        snprintf(text, n,
                 "%s ended when further steps promised to lower the sum of squared errors, %.3g with a noise of %.1g, "
                 "by %g %%; "
                 "more paths "
                 "would narrow the errors",
                 used, f, se, promised_percent(g));
    else if (end->failed)
        snprintf(text, n, "%s ended with a step that made the sum of squared errors worse and was taken back", used);
    else if (end->arrived)
        snprintf(text, n, "%s ended after %zu steps: too few to tell whether the fit has arrived", used,
                 g->history.n_step);
    else
        snprintf(text, n,
                 "%s ended while further steps still promised to lower the sum of squared errors, %.3g with a noise of "
                 "%.1g, by about "
                 "%.0f %%",
                 used, f, se, promised_percent(g));
}
