/* gauss_newton.v1: bounded, damped Gauss-Newton on the Monte-Carlo Jacobian.
 *
 * Each iteration traces new paths (two replicas) at the present point, adds them to the history, and pools the whole
 * history at that point (linear_model.h). gauss_newton_step.c finds the next step from the pooled quadratic model, and
 * gauss_newton_stop.c decides when the fit ends.
 *
 * A step after which the objective is higher beyond doubt halves the step limits and is taken back. A step that lowered
 * the objective by clearly less than predicted halves them only. The number of paths is small at first. It grows by a
 * factor of 1.3 when the predicted decrease of the objective is no longer clear of the noise. Configurations share the
 * paths in proportion to the standard deviation of a path (Neyman allocation).
 */
#include "optimizer/fit/descent/gauss_newton.h"
#include "optimizer/fit/descent/descent_methods.h"
#include "renderer/estimate/estimate.h"

#include <math.h>
#include <string.h>

enum {
    BLOCK = 256,
    MIN_PATH = 1024,
    FIRST_PATH = 2048,
    PATH_PER_CELL = 16, /* least paths per cell of a contrast, whose noise falls with the square of their number */
    LEAST_ITERATION = 12
};

/* No iteration takes more than this share of the budget, so that several large ones see the end point. */
static const double largest_share = 0.1;
static const double least_limit = 1.0 / 32.0; /* smallest factor of the step limits */

/* Parameters in internal units at the fit coordinates x. */
static void param_of(const struct gauss_newton *g, const double *x, double *param)
{
    for (size_t p = 0; p < g->model.n_param; p++)
        param[p] =
            g->run.fixed[p] ? g->run.problem->parameter[p].start : coordinate_to_param(&g->run.coordinate[p], x[p]);
}

/* Paths of each configuration for the next estimate, in proportion to the standard deviation of one path, between a
 * quarter and four times the mean. */
static void spread_paths(struct gauss_newton *g)
{
    size_t n = g->run.problem->observation->n;
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) sum += sqrt(linear_history_path_variance(&g->history, i));
    for (size_t i = 0; i < n; i++) {
        double share = sum > 0.0 ? (double)n * sqrt(linear_history_path_variance(&g->history, i)) / sum : 1.0;
        double paths = fmax(MIN_PATH, g->n_path_mean * fmin(fmax(share, 0.25), 4.0));
        double side = g->run.problem->observation->item[i].configuration.contrast_cells;
        paths = fmax(paths, PATH_PER_CELL * side * side);
        g->run.n_path[i] = ((size_t)ceil(paths / BLOCK)) * BLOCK;
    }
}

static status estimate_here(struct gauss_newton *g, struct error *err)
{
    double param[N];
    param_of(g, g->x, param);
    spread_paths(g);
    status s = descent_estimate(&g->run, param, (uint32_t)g->run.n_step, true, err);
    return s == STATUS_OK ? linear_history_append(&g->history, g->x, g->run.replica[0], g->run.replica[1], err) : s;
}

static status report_here(struct gauss_newton *g, const char *note, struct error *err)
{
    double param[N];
    struct uncertainty u;
    struct fit_step step = {
        .phase = "gauss_newton", .param = param, .damping = g->damping, .noise = g->noise, .note = note};
    step.step_length = g->largest_step;
    step.step_limit = g->limit_scale;
    step.decrease = g->predicted;
    param_of(g, g->x, param);
    uncertainty_compute(&g->model, g->run.coordinate, g->run.fixed, &u);
    step.param_se = u.se_param;
    return descent_report(&g->run, &step, err);
}

/* Compares the decrease by the last step with the predicted one. If the objective is higher beyond doubt, *failed is
 * set and the fit goes back to the best point. If the decrease is clearly smaller than predicted, because a fit with
 * large residuals overshoots from side to side, the step limits are halved; otherwise they grow again. */
static status judge_step(struct gauss_newton *g, bool *failed, struct error *err)
{
    double se, f = linear_model_objective(&g->model, &se), doubt = se + g->best_se;
    /* both points take priors and regularization in the unit (row_var) of the present model */
    double penalty = linear_model_penalty(&g->model, g->x) + gauss_newton_regularization(g, g->x);
    double best = g->best_f + linear_model_penalty(&g->model, g->best_x) + gauss_newton_regularization(g, g->best_x);
    bool first = g->history.n_step == 1;
    *failed = !first && f + penalty - best > 3.0 * doubt && f + penalty > 1.1 * best && g->limit_scale > least_limit;
    *failed = *failed || gauss_newton_in_noise_trap(g);
    bool fell_short = !first && best - f - penalty < 0.25 * g->predicted && g->predicted > 2.0 * doubt;
    if (*failed || fell_short)
        g->limit_scale = fmax(least_limit, 0.5 * g->limit_scale);
    else
        g->limit_scale = fmin(1.0, 1.5 * g->limit_scale);
    if (*failed) {
        g->n_stalled++;
        memcpy(g->x, g->best_x, sizeof g->x);
        status s = linear_model_pool(&g->model, &g->history, g->x, err);
        if (s == STATUS_OK) linear_model_weigh(&g->model, g->n_free);
        return s;
    }
    memcpy(g->best_x, g->x, sizeof g->x);
    g->best_f = f;
    g->best_se = se;
    if (!g->regularized) gauss_newton_judge_progress(g, f + penalty, se);
    return STATUS_OK;
}

/* Sets the mean number of paths of the next iteration. Returns false when the budget leaves too few for one. */
static bool plan_paths(struct gauss_newton *g, bool decrease_is_clear, size_t n_observation)
{
    double per_mean = 2.0 * (double)n_observation;
    if (!decrease_is_clear) g->n_path_mean *= 1.3;
    double left = (double)g->run.path_budget - (double)g->run.n_path_total;
    double share =
        fmax(largest_share * (double)g->run.path_budget, MIN_PATH * per_mean); /* small budgets: a few steps */
    double most = fmin(share, left) / per_mean;
    g->n_path_mean = fmin(g->n_path_mean, most);
    return most >= MIN_PATH && left >= 0.02 * (double)g->run.path_budget;
}

/* Ends the regularization when there are enough paths, when half of the paths or iterations are used up, or when no row
 * has a weight above 0. */
static void end_regularization(struct gauss_newton *g, size_t max_iteration)
{
    bool half = 2 * g->run.n_path_total >= g->run.path_budget || 2 * (g->run.n_step + 1) > max_iteration, silent = true;
    for (size_t row = 0; row < g->model.n_row; row++) silent = silent && !(g->model.weight[row] > 0.0);
    if (g->model.n_effective >= GAUSS_NEWTON_REGULARIZED_UNTIL || half || silent) g->regularized = false;
}

/* Ends the fit at the point with the lowest objective, because the last step has not been tried. */
static status end_at_misfit(struct gauss_newton *g, struct fit_result *result, struct error *err)
{
    double se;
    memcpy(g->x, g->lowest_x, sizeof g->x);
    status s = linear_model_pool(&g->model, &g->history, g->x, err);
    if (s != STATUS_OK) return s;
    linear_model_weigh(&g->model, g->n_free);
    double f = linear_model_objective(&g->model, &se);
    result->converged = true;
    gauss_newton_explain_misfit(g, f, se, result);
    return STATUS_OK;
}

static status iterate(struct gauss_newton *g, struct fit_result *result, struct error *err)
{
    const struct fit_problem *problem = g->run.problem;
    size_t max_iteration =
        problem->max_iteration > 0 ? problem->max_iteration : method_gauss_newton.default_max_iteration;
    double dx[N];
    for (;;) {
        status s = estimate_here(g, err);
        if (s != STATUS_OK) return s;
        s = linear_model_pool(&g->model, &g->history, g->x, err);
        if (s != STATUS_OK) return s;
        linear_model_weigh(&g->model, g->n_free);
        end_regularization(g, max_iteration);
        double se, f = linear_model_objective(&g->model, &se);
        s = report_here(g, NULL, err);
        if (s != STATUS_OK) return s;
        bool failed;
        s = judge_step(g, &failed, err);
        if (s == STATUS_OK) s = gauss_newton_step(g, dx, err);
        if (s != STATUS_OK) return s;
        g->predicted = g->decrease;
        for (size_t p = 0; p < g->model.n_param; p++) g->x[p] += dx[p];
        bool clear = g->decrease > 2.0 * gauss_newton_noise(g) && g->decrease > 0.005 * fabs(f) && !failed;
        bool arrived = gauss_newton_arrived(g);
        result->converged = arrived && !failed && g->history.n_step > 2;
        bool precise = gauss_newton_precise(g, f, se);
        bool fine = precise || gauss_newton_as_good_as_photographs(g) || gauss_newton_as_precise_as_asked(g);
        if (result->converged && fine && !g->regularized) {
            gauss_newton_explain_end(g, precise, f, se, result);
            return STATUS_OK;
        }
        if (gauss_newton_ends_at_misfit(g)) return end_at_misfit(g, result, err);
        g->at_misfit = g->at_misfit || (!failed && gauss_newton_regularized_at_misfit(g));
        if ((result->converged && precise) || g->at_misfit)
            g->regularized = false; /* the fit has arrived with regularization, and goes on without it */
        bool paths_left = plan_paths(g, clear, problem->observation->n);
        if (g->run.n_step < max_iteration && paths_left) {
            g->run.n_path_expected = gauss_newton_expected_paths(g, f, se, max_iteration - g->run.n_step);
            continue;
        }
        const struct gauss_newton_end at = {.used_up = paths_left ? STOP_ITERATIONS : STOP_PATH_BUDGET,
                                            .arrived = arrived,
                                            .failed = failed,
                                            .objective = f,
                                            .objective_se = se};
        gauss_newton_explain_early_end(g, &at, result);
        return STATUS_OK;
    }
}

static status finish(struct gauss_newton *g, struct fit_result *result, struct error *err)
{
    status s = linear_model_pool(&g->model, &g->history, g->x, err);
    if (s != STATUS_OK) return s;
    param_of(g, g->x, result->param);
    result->n_step = g->run.n_step;
    result->n_path = g->run.n_path_total;
    result->wall_s = g->run.wall_s;
    result->objective.value = linear_model_objective(&g->model, &result->objective.se);
    result->objective.rel_rms = sqrt(fmax(0.0, result->objective.value) / (double)g->model.n_row);
    result->prior_penalty = linear_model_penalty(&g->model, g->x);
    uncertainty_compute(&g->model, g->run.coordinate, g->run.fixed, &result->uncertainty);
    return cross_validation_compute(&g->model, g->run.problem->observation, g->run.coordinate, g->run.fixed,
                                    g->run.problem->discrepancy, &result->cross_validation, err);
}

/* Paths of one iteration with the fewest paths. */
static uint64_t least_budget(const struct fit_problem *problem)
{
    uint64_t sum = 0;
    for (size_t i = 0; i < problem->observation->n; i++) {
        const struct configuration *c = &problem->observation->item[i].configuration;
        size_t cells = (size_t)c->contrast_cells * c->contrast_cells;
        sum += 2 * estimate_n_path(c, PATH_PER_CELL * cells > MIN_PATH ? PATH_PER_CELL * cells : MIN_PATH);
    }
    return sum;
}

static status run_gauss_newton(const struct fit_problem *problem, struct fit_result *result, struct error *err)
{
    struct gauss_newton g = {.limit_scale = 1.0, .regularized = true};
    memset(result, 0, sizeof *result);
    status s = descent_run_init(&g.run, problem, &descent_gauss_newton, err);
    if (s != STATUS_OK) goto out;
    linear_history_init(&g.history, problem->observation, g.run.coordinate, problem->n_param);
    s = linear_model_init(&g.model, 3 * problem->observation->n, problem->n_param, err);
    if (s != STATUS_OK) goto out;
    g.model.prior = problem->prior;
    g.model.gain_sd = problem->gain_sd;
    for (size_t p = 0; p < problem->n_param; p++) g.n_free += !g.run.fixed[p];
    for (size_t p = 0; p < problem->n_param; p++)
        g.x[p] = coordinate_from_param(&g.run.coordinate[p], problem->parameter[p].start);
    if (problem->path_budget ==
        0) /* with many rows the default budget grows to LEAST_ITERATION iterations of the fewest paths */
        g.run.path_budget = (uint64_t)fmax((double)g.run.path_budget, LEAST_ITERATION * (double)least_budget(problem));
    /* small budgets begin with fewer paths, so that they allow several iterations */
    double first = (double)g.run.path_budget / (40.0 * 2.0 * (double)problem->observation->n);
    g.n_path_mean = fmax(MIN_PATH, fmin(FIRST_PATH, first));
    if (problem->first_path > 0) g.n_path_mean = fmax(MIN_PATH, (double)problem->first_path);
    s = iterate(&g, result, err);
    if (s == STATUS_OK) s = finish(&g, result, err);
out:
    linear_model_release(&g.model);
    linear_history_release(&g.history);
    descent_run_release(&g.run);
    return s;
}

const struct descent_method descent_gauss_newton = {
    .info = &method_gauss_newton,
    .run = run_gauss_newton,
    .least_budget = least_budget,
};
