/* The step of gauss_newton.v1: the minimum of the pooled quadratic model in the fit coordinates, inside the bounds and
 * the step limits.
 *   rows       have weights by noise and misfit (linear_model_weigh);
 *   gradient   is the mirrored product of the replicas, which has no bias;
 *   curvature  is 2 J'J of the averaged replicas. It is too large by the noise of J, a damping that fades as paths
 *              add up;
 *   damping    adds 2 c noise / limit^2: a move by the whole step limit must lower the objective by more than c times
 *              one residual's Monte-Carlo variance. c falls from early_caution to 1 as paths add up;
 *   regularization  acts while paths are few, towards the start and wide lobes, like a prior of regularization_sd
 *              step limits.
 */
#include "base/small_matrix.h"
#include "optimizer/fit/descent/bounded_quadratic.h"
#include "optimizer/fit/descent/gauss_newton.h"

#include <math.h>
#include <string.h>

/* Early noise would drive weakly determined parameters along a valley, to places from which fits did not come back
 * (narrow lobes, whose noise is four times as large). A strong damping prevents that, but makes the way along a
 * valley long. A regularization as a prior does not, and it ends while most paths are still to come. The numbers were
 * chosen by trial on analytic cloth. */
static const double early_caution = 4.0, cautious_until = 10000.0; /* effective paths */
static const double regularization_sd = 1.0;                       /* step limits */
static const double wide_share = 0.8; /* of the way from the narrowest lobe to the widest, in the logarithm */
static const double far_reach = 6.0;  /* step limits within which far_decrease is computed */

/* Indices of the free parameters; returns their number. */
static size_t free_index(const struct gauss_newton *g, size_t index[N])
{
    size_t n = 0;
    for (size_t p = 0; p < g->model.n_param; p++)
        if (!g->run.fixed[p]) index[n++] = p;
    return n;
}

/* The pooled quadratic model of the free parameters in units of the step limits, so that all unknowns are of order
 * one. */
struct scaled_model {
    size_t n, index[N];
    double h[N * N], g[N], trace;
};

/* Writes the coordinate to which the regularization draws parameter p: its start. A lobe width that starts at the
 * model's start value is drawn towards wide lobes, for which radiance is smooth and few paths determine it; narrow
 * lobes are noisy. Returns false for parameters without it: fixed ones, and other positive quantities (density, the
 * flakes' gamma), which may be off by powers of ten. */
static bool regularization_target(const struct gauss_newton *g, size_t p, double *x)
{
    const struct coordinate *k = &g->run.coordinate[p];
    const struct param_info *info = &g->run.problem->info[p];
    double start = g->run.problem->parameter[p].start;
    bool width = info->kind == PARAM_LOBE_WIDTH;
    *x = coordinate_from_param(k, start);
    if (width && start == info->start) *x = fmax(*x, k->lower + wide_share * (k->upper - k->lower));
    return !g->run.fixed[p] && (width || k->kind != PARAM_LOG);
}

/* Adds the regularization, which is as strong as a prior of regularization_sd step limits. */
static void add_regularization(const struct gauss_newton *g, struct scaled_model *m)
{
    double curvature = 2.0 * g->model.row_var / (regularization_sd * regularization_sd), x;
    for (size_t a = 0; a < m->n; a++) {
        size_t p = m->index[a];
        if (!regularization_target(g, p, &x)) continue;
        m->h[a * m->n + a] += curvature;
        m->g[a] += curvature * (g->model.x_ref[p] - x) / g->run.coordinate[p].step_limit;
    }
}

double gauss_newton_regularization(const struct gauss_newton *g, const double *x)
{
    double sum = 0.0, target;
    for (size_t p = 0; p < g->model.n_param && g->regularized; p++) {
        if (!regularization_target(g, p, &target)) continue;
        double off = (x[p] - target) / (regularization_sd * g->run.coordinate[p].step_limit);
        sum += off * off;
    }
    return g->model.row_var * sum;
}

/* cross: takes the curvature without the noise of J, which would hide by how much a parameter with a noisy derivative
 * can still lower the objective. */
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
    if (g->regularized) add_regularization(g, m);
}

/* Finds the minimum y of the model inside the bounds and `reach` times the step limits, with `damping` added to the
 * diagonal, and the decrease of the objective there. */
static status lowest(const struct gauss_newton *g, const struct scaled_model *m, double reach, double damping,
                     double y[N], double *decrease, struct error *err)
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
    *decrease = 0.0;
    for (size_t a = 0; s == STATUS_OK && a < m->n; a++) {
        double hy = 0.0;
        for (size_t b = 0; b < m->n; b++) hy += h[a * m->n + b] * y[b];
        *decrease -= y[a] * (m->g[a] + 0.5 * hy);
    }
    return s;
}

status gauss_newton_step(struct gauss_newton *g, double *dx, struct error *err)
{
    struct scaled_model m;
    double y[N];
    g->noise = linear_model_noise(&g->model);
    g->noise_decrease = uncertainty_noise_decrease(&g->model, g->run.coordinate, g->run.fixed);
    g->damping = 2.0 * g->noise * fmax(1.0, early_caution * fmin(1.0, cautious_until / g->model.n_effective));
    scale_model(g, true, &m);
    status s = lowest(g, &m, far_reach, 0.0, y, &g->far_decrease, err);
    scale_model(g, false, &m);
    if (s == STATUS_OK) s = lowest(g, &m, g->limit_scale, g->damping, y, &g->decrease, err);
    if (s != STATUS_OK) return s;
    memset(dx, 0, g->model.n_param * sizeof *dx);
    g->largest_step = 0.0;
    for (size_t a = 0; a < m.n; a++) {
        g->largest_step = fmax(g->largest_step, fabs(y[a]));
        dx[m.index[a]] = y[a] * g->run.coordinate[m.index[a]].step_limit;
    }
    return STATUS_OK;
}
