/* gauss_newton.v1: bounded, damped Gauss-Newton on the Monte-Carlo Jacobian.
 *
 * Each iteration traces new paths (two replicas) at the present point, adds them to the history, and pools all of it
 * there (linear_model.h). The step minimises the pooled quadratic model in logit / log coordinates inside the bounds
 * and the step limits:
 *   rows       weighted by what noise and misfit leave of them (linear_model_weigh);
 *   gradient   mirrored product of the replicas, without bias;
 *   curvature  2 J'J of the averaged replicas: too large by the noise of J, a damping that fades as paths add up;
 *   damping    plus 2 c noise / limit^2: moving by the whole step limit must gain more than c times one residual's
 *              Monte-Carlo variance; c falls from early_caution to 1 as paths add up;
 *   pull       while paths are few, towards the start and wide lobes, like a prior of pull_sd step limits; gone well
 *              before the end.
 * A step after which the objective is higher beyond doubt halves the limits and is taken back; one that gained clearly
 * less than it promised halves them. Paths: few at first; 1.3 times as many when the predicted gain is no longer clear
 * of the noise; spread over configurations by the standard deviation of a path (Neyman allocation).
 *
 * Arrived: what several undamped steps could gain (far_gain, by the curvature without the noise of J) is within the
 * noise, or below arrived_share of the weighted objective, which the model's curvature does not tell, or good enough: below
 * target_share of that or target_rel_rms. (Where a model does not fit, steps are short and each gains little: one step's
 * gain would end such fits on their way.) The fit ends when it has arrived, the pull is gone and the noise, too, is good
 * enough: below target_share of the plain objective or target_rel_rms, or,
 * where no budget was asked for, photograph_share of what the photographs' own errors make of a residual.
 * Where the paths or iterations are used up before, it has converged if it had arrived.
 */
#include "base/small_matrix.h"
#include "optimizer/fit/descent/descent_methods.h"
#include "renderer/transport/estimate/estimate.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum {
    N = SCATTERING_MAX_PARAM,
    BLOCK = 256,
    MIN_PATH = 1024,
    FIRST_PATH = 2048,
    PATH_PER_CELL = 16, /* of a contrast, at least: its noise falls with the square of these */
    LEAST_ITERATION = 12
};

/* Excess of the relative RMS error through noise in the parameters that is good enough whatever the misfit is; share of
 * the objective that is. */
static const double target_rel_rms = 0.0007, target_share = 0.002;
/* Variance of a residual by tracing, in units of that by the photographs' stated errors, that ends a fit whose budget is
 * the default one: its errors are then sqrt(1 + photograph_share) times what exact renderings would leave. Not before
 * the pooled means have least_effective paths each: their derivatives are several times noisier than they are. */
static const double photograph_share = 0.6, least_effective = 120000.0;
/* Share of the objective below which a promised gain is not told from the model's curvature any more. */
static const double arrived_share = 0.02;
/* No iteration takes more than this share of the budget, so several large ones see the end point. */
static const double largest_share = 0.1;
/* Early noise would drive weakly determined parameters along a valley, to where fits did not come back from (narrow lobes,
 * whose noise is four times as large). A strong damping prevents that and makes the way along a valley long; a pull as of
 * a prior does not, and lets go while most paths are still to come. Numbers chosen by trial on analytic cloth. */
static const double early_caution = 4.0, cautious_until = 10000.0; /* effective paths */
static const double pull_sd = 1.0, pull_until = 40000.0;           /* step limits; effective paths */
static const double wide_share = 0.8;         /* of the way from the narrowest lobe to the widest, in the logarithm */
static const double least_limit = 1.0 / 32.0; /* of the step limits */
static const double far_reach = 6.0;          /* step limits within which far_gain looks */

struct gauss_newton {
    struct descent_run run;
    struct linear_history history;
    struct linear_model model;
    double x[N];            /* where the next estimate is made */
    double best_x[N];       /* last point that was accepted */
    double best_f, best_se; /* objective there, by the pooled model */
    double limit_scale;     /* of the step limits, 1 or less */
    double n_path_mean;     /* a configuration and replica, of the next iteration */
    double promised;        /* fall of f by the last step, as the model saw it */
    double gain, far_gain, noise, damping, largest_step;
    bool pulls; /* towards pull_target */
    size_t n_free;
};

static void param_of(const struct gauss_newton *g, const double *x, double *param)
{
    for (size_t p = 0; p < g->model.n_param; p++)
        param[p] = g->run.fixed[p] ? g->run.problem->param[p].start : coordinate_to_param(&g->run.coordinate[p], x[p]);
}

/* n_i ~ standard deviation of a path, between a quarter and four times the mean. */
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

/* The part of a matrix or vector that belongs to the free parameters. */
static size_t free_index(const struct gauss_newton *g, size_t index[N])
{
    size_t n = 0;
    for (size_t p = 0; p < g->model.n_param; p++)
        if (!g->run.fixed[p]) index[n++] = p;
    return n;
}

/* The pooled quadratic model of the free parameters, scaled by the step limits, so that all unknowns are of order one. */
struct scaled_model {
    size_t n, index[N];
    double h[N * N], g[N], trace;
};

/* Where parameter p is pulled to: the start, but lobe widths that start where the model says towards wide lobes. There
 * radiance is smooth and known from few paths; a fit that comes from narrow lobes finds its noise in its way. Other
 * positive quantities (density, the flakes' gamma) may be decades off: no pull, false. */
static bool pull_target(const struct gauss_newton *g, size_t p, double *x)
{
    const struct coordinate *k = &g->run.coordinate[p];
    const struct param_info *info = &g->run.problem->info[p];
    double start = g->run.problem->param[p].start;
    bool width = info->kind == PARAM_LOBE_WIDTH;
    *x = coordinate_from_param(k, start);
    if (width && start == info->start) *x = fmax(*x, k->lower + wide_share * (k->upper - k->lower));
    return !g->run.fixed[p] && (width || k->kind != PARAM_LOG);
}

/* As strong as a prior of pull_sd step limits. */
static void add_pull(const struct gauss_newton *g, struct scaled_model *m)
{
    double curvature = 2.0 * g->model.row_var / (pull_sd * pull_sd), x;
    for (size_t a = 0; a < m->n; a++) {
        size_t p = m->index[a];
        if (!pull_target(g, p, &x)) continue;
        m->h[a * m->n + a] += curvature;
        m->g[a] += curvature * (g->model.x_ref[p] - x) / g->run.coordinate[p].step_limit;
    }
}

static double pull_penalty(const struct gauss_newton *g, const double *x)
{
    double sum = 0.0, target;
    for (size_t p = 0; p < g->model.n_param && g->pulls; p++) {
        if (!pull_target(g, p, &target)) continue;
        double off = (x[p] - target) / (pull_sd * g->run.coordinate[p].step_limit);
        sum += off * off;
    }
    return g->model.row_var * sum;
}

/* cross: curvature without the noise of J, which would hide what a parameter with a noisy derivative has to gain. */
static void scale_model(const struct gauss_newton *g, bool cross, struct scaled_model *m)
{
    double h[N * N], gradient[N];
    size_t n_param = g->model.n_param;
    m->n = free_index(g, m->index);
    m->trace = 0.0;
    linear_model_hessian(&g->model, cross, h);
    linear_model_gradient(&g->model, gradient);
    for (size_t a = 0; a < m->n; a++) {
        double limit = g->run.coordinate[m->index[a]].step_limit;
        for (size_t b = 0; b < m->n; b++)
            m->h[a * m->n + b] =
                h[m->index[a] * n_param + m->index[b]] * limit * g->run.coordinate[m->index[b]].step_limit;
        m->g[a] = gradient[m->index[a]] * limit;
        m->trace += m->h[a * m->n + a];
    }
    if (cross) small_clip_eigenvalues(m->h, m->n, 2.0 * linear_model_noise(&g->model));
    if (g->pulls) add_pull(g, m);
}

/* Its minimum inside the bounds and reach times the step limits, with `damping` on the diagonal: where it is, and by how
 * much it lies below zero. */
static status lowest(const struct gauss_newton *g, const struct scaled_model *m, double reach, double damping,
                     double y[N], double *gain, struct error *err)
{
    double h[N * N], lower[N], upper[N];
    memcpy(h, m->h, m->n * m->n * sizeof *h);
    for (size_t a = 0; a < m->n; a++) {
        const struct coordinate *k = &g->run.coordinate[m->index[a]];
        double at = g->model.x_ref[m->index[a]];
        lower[a] = fmax(-reach, (k->lower - at) / k->step_limit);
        upper[a] = fmin(reach, (k->upper - at) / k->step_limit);
        h[a * m->n + a] += damping + 1e-9 * m->trace;
    }
    status s = bounded_quadratic(h, m->g, lower, upper, m->n, y, err);
    *gain = 0.0;
    for (size_t a = 0; s == STATUS_OK && a < m->n; a++) {
        double hy = 0.0;
        for (size_t b = 0; b < m->n; b++) hy += h[a * m->n + b] * y[b];
        *gain -= y[a] * (m->g[a] + 0.5 * hy);
    }
    return s;
}

/* Best step from the pooled model; and what several such steps would gain (far_gain), which tells a fit that has arrived
 * from one that moves along a valley in steps too short to show. */
static status solve_step(struct gauss_newton *g, double *dx, struct error *err)
{
    struct scaled_model m;
    double y[N];
    g->noise = linear_model_noise(&g->model);
    g->damping = 2.0 * g->noise * fmax(1.0, early_caution * fmin(1.0, cautious_until / g->model.n_effective));
    scale_model(g, true, &m);
    status s = lowest(g, &m, far_reach, 0.0, y, &g->far_gain, err);
    scale_model(g, false, &m);
    if (s == STATUS_OK) s = lowest(g, &m, g->limit_scale, g->damping, y, &g->gain, err);
    if (s != STATUS_OK) return s;
    memset(dx, 0, g->model.n_param * sizeof *dx);
    g->largest_step = 0.0;
    for (size_t a = 0; a < m.n; a++) {
        g->largest_step = fmax(g->largest_step, fabs(y[a]));
        dx[m.index[a]] = y[a] * g->run.coordinate[m.index[a]].step_limit;
    }
    return STATUS_OK;
}

/* Gain that pure noise would promise: for f = r.r the noise variance of a residual for each free direction, one to
 * three times that because the three channels of a configuration share their paths. */
static double noise_gain(const struct gauss_newton *g) { return 2.0 * (double)g->n_free * g->noise; }

/* What of the objective f need not be won any more. */
static double good_enough(const struct gauss_newton *g, double f)
{
    return fmax(target_share * f, target_rel_rms * target_rel_rms * (double)g->model.n_row);
}

/* By the noise of all rows alike, as f counts them: that of the rows that the fit leans on is smaller. */
static bool precise_enough(const struct gauss_newton *g, double f, double se)
{
    return 2.0 * (double)g->n_free * linear_model_mean_noise(&g->model) <= good_enough(g, f - 2.0 * se);
}

/* Tracing noise against the photographs' own; infinite where they state none. */
static double noise_ratio(const struct gauss_newton *g)
{
    double photograph = 0.0;
    for (size_t row = 0; row < g->model.n_row; row++) photograph += g->model.weight[row] * g->model.photograph_var[row];
    return g->noise * (double)g->model.n_row / photograph;
}

static bool as_good_as_photographs(const struct gauss_newton *g)
{
    return g->run.problem->path_budget == 0 && g->model.n_effective >= least_effective &&
           noise_ratio(g) <= photograph_share;
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
    step.gain = g->promised;
    param_of(g, g->x, param);
    uncertainty_compute(&g->model, g->run.coordinate, g->run.fixed, &u);
    step.param_se = u.se_param;
    return descent_report(&g->run, &step, err);
}

/* What the last step has done against what it promised. Worse beyond doubt: `failed`, back to the best point. Clearly
 * less than promised (a fit with large residuals overshoots from side to side): half the limits; otherwise they grow
 * again. */
static status judge_step(struct gauss_newton *g, bool *failed, struct error *err)
{
    double se, f = linear_model_objective(&g->model, &se), doubt = se + g->best_se;
    /* priors and the pull count in today's unit on both sides */
    double penalty = linear_model_penalty(&g->model, g->x) + pull_penalty(g, g->x);
    double best = g->best_f + linear_model_penalty(&g->model, g->best_x) + pull_penalty(g, g->best_x);
    bool first = g->history.n_step == 1;
    *failed = !first && f + penalty - best > 3.0 * doubt && f + penalty > 1.1 * best && g->limit_scale > least_limit;
    bool short_of_promise = !first && best - f - penalty < 0.25 * g->promised && g->promised > 2.0 * doubt;
    if (*failed || short_of_promise)
        g->limit_scale = fmax(least_limit, 0.5 * g->limit_scale);
    else
        g->limit_scale = fmin(1.0, 1.5 * g->limit_scale);
    if (*failed) {
        memcpy(g->x, g->best_x, sizeof g->x);
        status s = linear_model_pool(&g->model, &g->history, g->x, err);
        if (s == STATUS_OK) linear_model_weigh(&g->model, g->n_free);
        return s;
    }
    memcpy(g->best_x, g->x, sizeof g->x);
    g->best_f = f;
    g->best_se = se;
    return STATUS_OK;
}

/* Paths of the next iteration; false when the budget does not allow another one worth its name. */
static bool plan_paths(struct gauss_newton *g, bool gain_is_clear, size_t n_observation)
{
    double per_mean = 2.0 * (double)n_observation;
    if (!gain_is_clear) g->n_path_mean *= 1.3;
    double left = (double)g->run.path_budget - (double)g->run.n_path_total;
    double share =
        fmax(largest_share * (double)g->run.path_budget, MIN_PATH * per_mean); /* small budgets: a few steps */
    double most = fmin(share, left) / per_mean;
    g->n_path_mean = fmin(g->n_path_mean, most);
    return most >= MIN_PATH && left >= 0.02 * (double)g->run.path_budget;
}

/* What further steps could gain of the objective as the fit weighs rows, in percent, rounded to two digits ("%g" tells 100 as such).
 * It is told to first order: not more than all. */
static double promised_percent(const struct gauss_newton *g)
{
    double weighted = linear_model_weighted_objective(&g->model);
    double percent = weighted > 0.0 ? fmin(100.0, 100.0 * g->far_gain / weighted) : 100.0;
    double digit = percent > 0.0 ? pow(10.0, floor(log10(percent)) - 1.0) : 1.0;
    return digit * round(percent / digit);
}

static void explain_end(const struct gauss_newton *g, bool precise, double f, double se, struct fit_result *result)
{
    char *text = result->reason;
    size_t n = sizeof result->reason;
    result->stop = precise ? STOP_ARRIVED : STOP_ARRIVED_WITHIN_PHOTOGRAPHS;
    if (precise)
        snprintf(text, n, "further steps promise to lower the objective, %.3g with a noise of %.1g, by %g %%", f, se,
                 promised_percent(g));
    else
        snprintf(
            text, n,
            "further steps promise to lower the objective by %g %%, and tracing adds %.1f times the photographs' own "
            "variance; exact renderings would narrow the errors by some %.0f %%",
            promised_percent(g), noise_ratio(g), 100.0 * (1.0 - 1.0 / sqrt(1.0 + noise_ratio(g))));
}

/* Why a fit whose budget or iterations are used up has converged or not. */
static void explain_early_end(const struct gauss_newton *g, enum stop_reason used_up, bool arrived, bool failed,
                              double f, double se, struct fit_result *result)
{
    const char *used = used_up == STOP_ITERATIONS ? "the iterations" : "the path budget";
    char *text = result->reason;
    size_t n = sizeof result->reason;
    bool explained = result->converged || !(failed || arrived);
    result->stop = explained ? used_up : failed ? STOP_STEP_TAKEN_BACK : STOP_TOO_FEW_STEPS;
    if (result->converged)
        snprintf(text, n,
                 "%s ended when further steps promised to lower the objective, %.3g with a noise of %.1g, by %g %%; "
                 "more paths "
                 "would narrow the errors",
                 used, f, se, promised_percent(g));
    else if (failed)
        snprintf(text, n, "%s ended with a step that made the objective worse and was taken back", used);
    else if (arrived)
        snprintf(text, n, "%s ended after %zu steps: too few to tell whether the fit has arrived", used,
                 g->history.n_step);
    else
        snprintf(
            text, n,
            "%s ended while further steps still promised to lower the objective, %.3g with a noise of %.1g, by about "
            "%.0f %%",
            used, f, se, promised_percent(g));
}

/* The pull ends with enough paths, or with half of what may be spent; where no row says anything there is none. */
static void let_go(struct gauss_newton *g, size_t max_iteration)
{
    bool half = 2 * g->run.n_path_total >= g->run.path_budget || 2 * (g->run.n_step + 1) > max_iteration, silent = true;
    for (size_t row = 0; row < g->model.n_row; row++) silent = silent && !(g->model.weight[row] > 0.0);
    if (g->model.n_effective >= pull_until || half || silent) g->pulls = false;
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
        let_go(g, max_iteration);
        double se, f = linear_model_objective(&g->model, &se);
        s = report_here(g, NULL, err);
        if (s != STATUS_OK) return s;
        bool failed;
        s = judge_step(g, &failed, err);
        if (s == STATUS_OK) s = solve_step(g, dx, err);
        if (s != STATUS_OK) return s;
        g->promised = g->gain;
        for (size_t p = 0; p < g->model.n_param; p++) g->x[p] += dx[p];
        bool clear = g->gain > 2.0 * noise_gain(g) && g->gain > 0.005 * fabs(f) && !failed;
        double weighted = linear_model_weighted_objective(&g->model); /* as the gains are */
        bool small = g->far_gain <= fmax(noise_gain(g), fmax(arrived_share * weighted, good_enough(g, weighted)));
        result->converged = small && !failed && g->history.n_step > 2;
        bool precise = precise_enough(g, f, se);
        if (result->converged && (precise || as_good_as_photographs(g)) && !g->pulls) {
            explain_end(g, precise, f, se, result);
            return STATUS_OK;
        }
        if (result->converged && precise) g->pulls = false; /* arrived with it: on without */
        bool paths_left = plan_paths(g, clear, problem->observation->n);
        if (g->run.n_step < max_iteration && paths_left) continue;
        explain_early_end(g, paths_left ? STOP_ITERATIONS : STOP_PATH_BUDGET, small, failed, f, se, result);
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
    return STATUS_OK;
}

/* One iteration. */
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
    struct gauss_newton g = {.limit_scale = 1.0, .pulls = true};
    memset(result, 0, sizeof *result);
    status s = descent_run_init(&g.run, problem, &descent_gauss_newton, err);
    if (s != STATUS_OK) goto out;
    linear_history_init(&g.history, problem->observation, g.run.coordinate, problem->n_param);
    s = linear_model_init(&g.model, 3 * problem->observation->n, problem->n_param, err);
    if (s != STATUS_OK) goto out;
    g.model.prior = problem->prior;
    g.model.gain_sd = problem->gain_sd;
    size_t index[N];
    g.n_free = free_index(&g, index);
    for (size_t p = 0; p < problem->n_param; p++)
        g.x[p] = coordinate_from_param(&g.run.coordinate[p], problem->param[p].start);
    if (problem->path_budget == 0) /* many rows: enough for so many of the smallest iterations */
        g.run.path_budget = (uint64_t)fmax((double)g.run.path_budget, LEAST_ITERATION * (double)least_budget(problem));
    /* small budgets start smaller, so that there are iterations to speak of */
    double first = (double)g.run.path_budget / (40.0 * 2.0 * (double)problem->observation->n);
    g.n_path_mean = fmax(MIN_PATH, fmin(FIRST_PATH, first));
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
