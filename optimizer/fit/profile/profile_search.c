#include "optimizer/fit/profile/profile_search.h"
#include "optimizer/fit/descent/bounded_quadratic.h"
#include "optimizer/fit/descent/descent_methods.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N = PROFILE_MAX_UNKNOWN };

/* Decrease of f, over f, below which another step is not worth its evaluation: f is about the number of values, and
 * the errors of the unknowns change it by 1. */
static const double least_decrease = 1e-5;
static const double scale_step = 2.0, scale_range = 30.0; /* of ln of the scale */
static const double turn_step = 0.35;                     /* rad */
enum { N_TURN = 60 };                                     /* of a scan, 3 degrees apart */

static const struct scattering_model *model_of(const struct profile_search *s) { return s->target->problem->model; }

void profile_search_set_misfit(struct profile_search *s, double misfit)
{
    const struct fiber_profile *p = s->target->problem->profile;
    for (size_t i = 0; i < s->target->n_value; i++) {
        const double se = p->row[i / p->n_channel].se[i % p->n_channel], left = misfit * s->target->base[i];
        s->error[i] = sqrt(se * se + left * left);
    }
}

/* f of a point from its values. */
static double sum_of(const struct profile_search *s, const struct profile_point *p)
{
    double f = 0.0;
    for (size_t i = 0; i < s->target->n_value; i++) {
        const double r = (p->value[i] - s->target->measured[i]) / s->error[i];
        f += r * r;
    }
    for (size_t u = 0; u < s->target->layout.n_unknown; u++) {
        const double d = p->x[u] - s->target->layout.prior[u].mean;
        f += s->target->layout.prior[u].precision * d * d;
    }
    return f;
}

static void unknowns_of(const struct profile_target *t, const double *x, double *unknown)
{
    for (size_t u = 0; u < t->layout.n_unknown; u++)
        unknown[u] = t->fixed[u] ? t->layout.parameter[u].start : coordinate_to_param(&t->coordinate[u], x[u]);
}

/* Values and derivatives of a model of scale 1 become those by the fit coordinates. */
static void chain(const struct profile_search *s, struct profile_point *p, const double *unknown)
{
    const struct profile_target *t = s->target;
    const size_t n = t->n_unknown, n_param = model_of(s)->n_param;
    const double scale = exp(p->x[t->i_scale]);
    double slope[FIT_MAX_PARAM];
    for (size_t q = 0; q < n_param; q++) {
        const size_t u = t->layout.owner[q];
        slope[q] = scale * t->layout.ratio[q] * coordinate_slope(&t->coordinate[u], unknown[u]);
    }
    for (size_t i = 0; i < t->n_value; i++) {
        double *row = p->jac + i * n;
        memset(row, 0, n * sizeof *row);
        for (size_t q = 0; q < n_param; q++)
            if (!t->fixed[t->layout.owner[q]]) row[t->layout.owner[q]] += slope[q] * s->by_param[i * n_param + q];
        p->value[i] *= scale;
        if (!t->fixed[t->i_turn]) row[t->i_turn] = scale * s->by_turn[i];
        if (!t->fixed[t->i_scale]) row[t->i_scale] = p->value[i];
    }
}

static status evaluate(struct profile_search *s, struct profile_point *p, struct error *err)
{
    double unknown[FIT_MAX_PARAM], full[FIT_MAX_PARAM];
    unknowns_of(s->target, p->x, unknown);
    fit_layout_full(&s->target->layout, unknown, full);
    s->n_evaluation++;
    const struct profile_work work = {.pool = s->pool,
                                      .progress = s->target->problem->progress,
                                      .turn_rad = p->x[s->target->i_turn],
                                      .mode = s->target->mode,
                                      .by_turn = s->by_turn};
    status code =
        profile_model_predict(model_of(s), full, s->target->problem->profile, &work, p->value, s->by_param, err);
    if (code != STATUS_OK) return code;
    chain(s, p, unknown);
    p->f = sum_of(s, p);
    return STATUS_OK;
}

/* The scale that fits the values of scale 1 best. */
static double best_scale(const struct profile_search *s, const double *value)
{
    double lm = 0.0, ll = 0.0;
    for (size_t i = 0; i < s->target->n_value; i++) {
        const double w = 1.0 / (s->error[i] * s->error[i]);
        lm += w * value[i] * s->target->measured[i];
        ll += w * value[i] * value[i];
    }
    return ll > 0.0 && lm > 0.0 ? lm / ll : 1.0;
}

/* ---- the turn where a search begins ---- */

/* The sum of squares at each turn of a scan, with the best scale there. */
struct turn_scan {
    const struct profile_search *search;
    double f[N_TURN];
};

static void note_turn(void *context, size_t k, const double *value)
{
    struct turn_scan *scan = context;
    const struct profile_search *s = scan->search;
    const double scale =
        s->target->fixed[s->target->i_scale] ? exp(s->here.x[s->target->i_scale]) : best_scale(s, value);
    scan->f[k] = 0.0;
    for (size_t i = 0; i < s->target->n_value; i++) {
        const double r = (scale * value[i] - s->target->measured[i]) / s->error[i];
        scan->f[k] += r * r;
    }
}

/* The turn of the least sum; with `second` the least one of the other minima, if there is another. */
static double best_turn(const double f[N_TURN], bool second)
{
    size_t best = N_TURN, next = N_TURN;
    for (size_t k = 0; k < N_TURN; k++) {
        if (f[k] > f[(k + 1) % N_TURN] || f[k] > f[(k + N_TURN - 1) % N_TURN]) continue;
        if (best == N_TURN || f[k] < f[best]) {
            next = best;
            best = k;
        } else if (next == N_TURN || f[k] < f[next])
            next = k;
    }
    return M_PI * (double)(second && next != N_TURN ? next : best) / N_TURN;
}

static status begin_turn(struct profile_search *s, bool second, struct error *err)
{
    double unknown[FIT_MAX_PARAM], full[FIT_MAX_PARAM];
    struct turn_scan found = {.search = s};
    unknowns_of(s->target, s->here.x, unknown);
    fit_layout_full(&s->target->layout, unknown, full);
    const struct profile_work work = {
        .pool = s->pool, .progress = s->target->problem->progress, .mode = s->target->mode};
    const struct profile_scan scan = {N_TURN, s->here.value, note_turn, &found};
    status code = profile_model_scan(model_of(s), full, s->target->problem->profile, &work, &scan, err);
    if (code == STATUS_OK) s->here.x[s->target->i_turn] = best_turn(found.f, second);
    return code;
}

static status new_point(struct profile_point *p, const struct profile_target *t, struct error *err)
{
    p->value = calloc(t->n_value, sizeof *p->value);
    p->jac = calloc(t->n_value * t->n_unknown, sizeof *p->jac);
    if (p->value != NULL && p->jac != NULL) return STATUS_OK;
    return error_set(err, STATUS_NO_MEMORY, "cannot fit a profile: out of memory");
}

status profile_search_begin(struct profile_search *s, const struct profile_target *target, struct thread_pool *pool,
                            const struct profile_start *start, struct error *err)
{
    const size_t n = target->n_unknown;
    *s = (struct profile_search){.target = target, .pool = pool};
    s->error = calloc(target->n_value, sizeof *s->error);
    s->by_param = calloc(target->n_value * target->problem->model->n_param, sizeof *s->by_param);
    if (!target->fixed[target->i_turn]) s->by_turn = calloc(target->n_value, sizeof *s->by_turn);
    if (s->error == NULL || s->by_param == NULL || (!target->fixed[target->i_turn] && s->by_turn == NULL))
        return error_set(err, STATUS_NO_MEMORY, "cannot fit a profile: out of memory");
    status code = new_point(&s->here, target, err);
    if (code == STATUS_OK) code = new_point(&s->next, target, err);
    if (code != STATUS_OK) return code;
    profile_search_set_misfit(s, start->misfit);
    for (size_t u = 0; u < target->layout.n_unknown; u++)
        s->here.x[u] = coordinate_from_param(&target->coordinate[u], start->unknown[u]);
    s->here.x[target->i_turn] = isnan(target->problem->turn_rad) ? 0.0 : target->problem->turn_rad;
    s->here.x[target->i_scale] = target->fixed[target->i_scale] ? log(target->problem->scale) : 0.0;
    if (!target->fixed[target->i_turn]) code = begin_turn(s, start->second, err);
    if (code == STATUS_OK) code = evaluate(s, &s->here, err);
    if (code != STATUS_OK || target->fixed[target->i_scale]) return code;
    const double scale = best_scale(s, s->here.value);
    s->here.x[target->i_scale] = log(scale);
    for (size_t i = 0; i < target->n_value * n; i++) s->here.jac[i] *= scale;
    for (size_t i = 0; i < target->n_value; i++) s->here.value[i] *= scale;
    s->here.f = sum_of(s, &s->here);
    return STATUS_OK;
}

size_t profile_search_bytes(const struct fiber_profile *profile, size_t n_param)
{
    const size_t n_jac = n_param + 2, of_value = 2 + n_param + 2 * (1 + n_jac); /* see profile_search_begin */
    return sizeof(double) * profile->n * profile->n_channel * of_value;
}

void profile_search_end(struct profile_search *s)
{
    free(s->error);
    free(s->by_param);
    free(s->by_turn);
    free(s->here.value);
    free(s->here.jac);
    free(s->next.value);
    free(s->next.jac);
    memset(s, 0, sizeof *s);
}

void profile_search_normal(const struct profile_search *s, double *hessian, double *gradient)
{
    const struct profile_target *t = s->target;
    const size_t n = t->n_unknown;
    memset(hessian, 0, n * n * sizeof *hessian);
    memset(gradient, 0, n * sizeof *gradient);
    for (size_t i = 0; i < t->n_value; i++) {
        const double *row = s->here.jac + i * n, w = 1.0 / (s->error[i] * s->error[i]);
        const double r = s->here.value[i] - t->measured[i];
        for (size_t u = 0; u < n; u++) {
            gradient[u] += w * row[u] * r;
            for (size_t v = 0; v <= u; v++) hessian[u * n + v] += w * row[u] * row[v];
        }
    }
    for (size_t u = 0; u < n; u++) {
        for (size_t v = 0; v < u; v++) hessian[v * n + u] = hessian[u * n + v];
        if (u >= t->layout.n_unknown) continue;
        hessian[u * n + u] += t->layout.prior[u].precision;
        gradient[u] += t->layout.prior[u].precision * (s->here.x[u] - t->layout.prior[u].mean);
    }
}

/* A damped step of the free unknowns inside bounds and step limits, to next.x. Returns the expected decrease of f. */
static status step(struct profile_search *s, double damping, double *expected, struct error *err)
{
    const struct profile_target *t = s->target;
    const size_t n = t->n_unknown;
    double full[N * N], slope[N], h[N * N], g[N], lower[N], upper[N], dx[N];
    size_t index[N], m = 0;
    profile_search_normal(s, full, slope);
    for (size_t u = 0; u < n; u++)
        if (!t->fixed[u]) index[m++] = u;
    for (size_t a = 0; a < m; a++) {
        const size_t u = index[a];
        const bool of_model = u < t->layout.n_unknown;
        const double x = s->here.x[u], limit = of_model         ? 2.0 * t->coordinate[u].step_limit
                                               : u == t->i_turn ? turn_step
                                                                : scale_step;
        lower[a] = fmax(-limit, (of_model ? t->coordinate[u].lower : x - scale_range) - x);
        upper[a] = fmin(limit, (of_model ? t->coordinate[u].upper : x + scale_range) - x);
        g[a] = slope[u];
        for (size_t b = 0; b < m; b++) h[a * m + b] = full[u * n + index[b]];
        h[a * m + a] += damping * h[a * m + a] + 1e-6 * s->here.f / (limit * limit);
    }
    status code = bounded_quadratic(h, g, lower, upper, m, dx, err);
    if (code != STATUS_OK) return code;
    memcpy(s->next.x, s->here.x, sizeof s->next.x);
    *expected = 0.0;
    for (size_t a = 0; a < m; a++) {
        s->next.x[index[a]] += dx[a];
        double along = 0.0;
        for (size_t b = 0; b < m; b++) along += full[index[a] * n + index[b]] * dx[b];
        *expected -= dx[a] * (2.0 * g[a] + along);
    }
    return STATUS_OK;
}

status profile_search_run(struct profile_search *s, size_t max_iteration, struct error *err)
{
    double damping = 0.01, expected;
    s->converged = false;
    s->here.f = sum_of(s, &s->here);
    for (size_t i = 0; i < max_iteration; i++) {
        if (progress_cancelled(s->target->problem->progress)) return error_set(err, STATUS_CANCELLED, "cancelled");
        progress_report(&s->progress, (double)i / (double)max_iteration);
        status code = step(s, damping, &expected, err);
        if (code == STATUS_OK && expected <= least_decrease * s->here.f) {
            s->converged = true;
            return STATUS_OK;
        }
        if (code == STATUS_OK) code = evaluate(s, &s->next, err);
        if (code != STATUS_OK) return code;
        const double decrease = s->here.f - s->next.f;
        if (decrease > 0.0) {
            const struct profile_point before = s->here;
            s->here = s->next;
            s->next = before;
        }
        s->converged = decrease > 0.0 && decrease <= least_decrease * s->here.f;
        if (s->converged) return STATUS_OK;
        damping = decrease > 0.75 * expected ? 0.2 * damping : decrease > 0.25 * expected ? damping : 5.0 * damping;
        damping = fmin(fmax(damping, 1e-6), 1e6);
    }
    return STATUS_OK;
}
