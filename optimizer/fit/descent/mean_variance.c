/* mean_variance.v1: microflakes fitted as the fabric thesis fits them (5.7.1), after Zhao et al. 2011, "Building
 * volumetric appearance models of fabric using micro CT imaging", section 6: albedo and width of the flakes by
 * bisection, so that mean and variance of the renderings are the measured ones.
 *
 * The width is halved on a logarithmic scale: too large a variance means too narrow a distribution. For each width the
 * albedo of every channel is bisected on the logit scale, which a brighter mean moves down. All renderings of the
 * bisections use the same random numbers, so that means and variances are smooth functions of the parameters.
 *
 * Differs: the thesis takes mean and variance over the pixels of all photographs put together, this method over the
 * means of the rows, because a table has no pixels: without the texture inside of a photograph. Variances are relative
 * to the squared mean, summed over the channels, and those of renderings are products of two replicas, without the
 * noise of tracing. 27 iterations are printed without their division; here there are 9 halvings of the width with 9 of
 * the albedo each. The two grazing rows that the thesis leaves out have the weight 0 where a job says so. Errors come
 * from 4 more estimates (descent_end.h).
 */
#include "optimizer/fit/descent/descent_end.h"
#include "renderer/estimate/estimate.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LEAST_PATHS = 256 };

struct moments {
    double mean[3], variance; /* variance: sum over channels, each relative to its squared mean */
};

struct mean_variance {
    struct descent_run run;
    double param[FIT_MAX_PARAM];
    size_t colour[3], width;
    bool finds_colour, finds_width; /* false: fixed */
    size_t n_halving;
    struct moments wanted, found;
};

/* Moments of measured rows (a = b = NULL), or of two replicas of renderings. */
static void take_moments(const struct observation_set *o, const struct estimate *a, const struct estimate *b,
                         struct moments *m)
{
    double n = 0.0;
    for (size_t i = 0; i < o->n; i++) n += o->item[i].weight > 0.0;
    m->variance = 0.0;
    for (int c = 0; c < 3; c++) {
        double first = 0.0, second = 0.0, product = 0.0;
        for (size_t i = 0; i < o->n; i++) {
            if (!(o->item[i].weight > 0.0)) continue;
            const double x = a != NULL ? a[i].mean[c] : o->item[i].mean_rgb[c];
            const double y = b != NULL ? b[i].mean[c] : o->item[i].mean_rgb[c];
            first += x / n;
            second += y / n;
            product += x * y / n;
        }
        m->mean[c] = 0.5 * (first + second);
        m->variance += (product - first * second) / fmax(m->mean[c] * m->mean[c], 1e-12);
    }
}

/* Finds the three parameters of the only color and the only other free one. */
static status find_parameters(struct mean_variance *v, struct error *err)
{
    const struct fit_problem *problem = v->run.problem;
    size_t n_colour = 0, n_width = 0;
    for (size_t p = 0; p < problem->n_param; p++) {
        const struct param_info *info = &problem->info[p];
        if (info->channel >= 0 && n_colour < 3)
            v->colour[n_colour++] = p;
        else if (info->channel < 0 && info->kind != PARAM_DENSITY && n_width == 0)
            v->width = p, n_width = 1;
        else if (!v->run.fixed[p])
            n_width = 2;
    }
    if (n_colour != 3 || n_width != 1)
        return error_set(err, STATUS_INVALID,
                         "cannot fit by mean and variance: the model must have one color and one other free parameter, "
                         "as '%s' has",
                         method_mean_variance.only_model);
    v->finds_colour = !v->run.fixed[v->colour[0]] || !v->run.fixed[v->colour[1]] || !v->run.fixed[v->colour[2]];
    v->finds_width = !v->run.fixed[v->width];
    return STATUS_OK;
}

/* Renders at v->param with the same random numbers each time. */
static status render(struct mean_variance *v, const char *phase, struct error *err)
{
    struct fit_step step = {.phase = phase, .param = v->param};
    status s = descent_estimate(&v->run, v->param, 0, false, err);
    if (s == STATUS_OK) s = descent_report(&v->run, &step, err);
    if (s == STATUS_OK) take_moments(v->run.problem->observation, v->run.replica[0], v->run.replica[1], &v->found);
    return s;
}

static double middle(const struct coordinate *k, const double bound[2])
{
    return coordinate_to_param(k, 0.5 * (bound[0] + bound[1]));
}

/* Bisects the albedo of each channel; leaves the moments at the last one. */
static status find_colour(struct mean_variance *v, struct error *err)
{
    double bound[3][2];
    for (int c = 0; c < 3; c++) {
        bound[c][0] = v->run.coordinate[v->colour[c]].lower;
        bound[c][1] = v->run.coordinate[v->colour[c]].upper;
    }
    for (size_t i = 0; i < (v->finds_colour ? v->n_halving : 1); i++) {
        for (int c = 0; c < 3; c++)
            if (!v->run.fixed[v->colour[c]])
                v->param[v->colour[c]] = middle(&v->run.coordinate[v->colour[c]], bound[c]);
        status s = render(v, "albedo", err);
        if (s != STATUS_OK) return s;
        for (int c = 0; c < 3; c++)
            bound[c][v->found.mean[c] < v->wanted.mean[c] ? 0 : 1] = 0.5 * (bound[c][0] + bound[c][1]);
    }
    return STATUS_OK;
}

static status find_both(struct mean_variance *v, struct error *err)
{
    const struct coordinate *k = &v->run.coordinate[v->width];
    double bound[2] = {k->lower, k->upper};
    for (size_t i = 0; i < (v->finds_width ? v->n_halving : 1); i++) {
        if (v->finds_width) v->param[v->width] = middle(k, bound);
        status s = find_colour(v, err);
        if (s != STATUS_OK) return s;
        bound[v->found.variance > v->wanted.variance ? 0 : 1] = 0.5 * (bound[0] + bound[1]);
    }
    return STATUS_OK;
}

/* The schedule is at its end; it has converged where no parameter was driven to a bound. */
static void judge(const struct mean_variance *v, struct fit_result *result)
{
    double off = 0.0;
    for (int c = 0; c < 3; c++) off = fmax(off, fabs(v->found.mean[c] / fmax(v->wanted.mean[c], 1e-12) - 1.0));
    const double spread = sqrt(fmax(0.0, v->found.variance) / fmax(v->wanted.variance, 1e-12));
    result->converged = off < 0.1 && fabs(spread - 1.0) < 0.2;
    result->stop = result->converged ? STOP_SCHEDULE : STOP_END_OF_BRACKET;
    snprintf(result->reason, sizeof result->reason,
             "after %zu halvings the means of the channels differ by at most %.2g %% from the measured ones, and their "
             "standard deviation over the rows is %.3g of the measured one",
             v->n_halving, 100.0 * off, spread);
}

static double n_rendering(size_t n_halving) { return 2.0 * (double)(n_halving * n_halving + DESCENT_N_END); }

static uint64_t least_rendering(const struct observation_set *o)
{
    uint64_t sum = 0;
    for (size_t i = 0; i < o->n; i++) sum += estimate_n_path(&o->item[i].configuration, LEAST_PATHS);
    return sum;
}

static size_t n_halving_of(const struct fit_problem *problem)
{
    return problem->max_iteration > 0 ? problem->max_iteration : method_mean_variance.default_max_iteration;
}

static uint64_t least_budget(const struct fit_problem *problem)
{
    return (uint64_t)n_rendering(n_halving_of(problem)) * least_rendering(problem->observation);
}

static status run_mean_variance(const struct fit_problem *problem, struct fit_result *result, struct error *err)
{
    struct mean_variance *v = calloc(1, sizeof *v);
    struct rest_check end = {0};
    memset(result, 0, sizeof *result);
    if (v == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot start a fit: out of memory");
    status s = descent_run_init(&v->run, problem, &descent_mean_variance, err);
    if (s == STATUS_OK) s = find_parameters(v, err);
    if (s != STATUS_OK) goto out;
    v->n_halving = n_halving_of(problem);
    const double budget =
        problem->path_budget > 0 ? (double)problem->path_budget : (double)method_mean_variance.default_path_budget;
    const double each = budget / (n_rendering(v->n_halving) * (double)problem->observation->n);
    for (size_t i = 0; i < problem->observation->n; i++) v->run.n_path[i] = (size_t)fmax(LEAST_PATHS, floor(each));
    for (size_t p = 0; p < problem->n_param; p++) v->param[p] = problem->parameter[p].start;
    take_moments(problem->observation, NULL, NULL, &v->wanted);
    s = find_both(v, err);
    if (s == STATUS_OK) s = descent_end(&v->run, v->param, 1, result, &end, err);
    if (s == STATUS_OK) judge(v, result);
out:
    descent_run_release(&v->run);
    free(v);
    return s;
}

const struct descent_method descent_mean_variance = {
    .info = &method_mean_variance,
    .run = run_mean_variance,
    .least_budget = least_budget,
};
