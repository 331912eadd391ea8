#include "optimizer/fit/descent/fit_run.h"
#include "base/option_id.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { N = FIT_MAX_PARAM, KEY_STRIDE = 4096 }; /* iteration keys of one start, out of the 65536 of rng.h */

struct fit {
    const struct fit_problem *problem; /* in the model's parameters */
    const struct fit_option *option;
    struct fit_layout layout;
    struct estimate *buffer; /* estimates of the renderer */
    struct estimator_pair pair;
    size_t i_start, n_start; /* n_start: with the extra ones */
    size_t n_step;           /* steps of the starts before this one; the next two likewise */
    uint64_t n_path;
    double wall_s;
    uint64_t path_budget; /* of one start; 0: the method's own */
};

/* ---- between the method and the renderer ---- */

static status estimate(void *context, const struct estimator_call *call, const struct progress *progress,
                       struct estimate *out, double *wall_s, struct error *err)
{
    struct fit *f = context;
    const struct estimator *e = f->problem->estimator;
    double full[N];
    fit_layout_full(&f->layout, call->param, full);
    struct estimator_call inner = *call;
    inner.param = full;
    struct estimate *to = f->buffer;
    if (call->pair != NULL) inner.pair = &f->pair;
    inner.iteration += (uint32_t)(f->i_start * KEY_STRIDE);
    f->pair.ready = f->pair.ready && f->pair.iteration == inner.iteration && f->pair.replica == inner.replica;
    if (f->pair.ready) to = f->pair.next; /* the replica that was made with the one before */
    status s = e->run(e->context, &inner, progress, to, wall_s, err);
    if (to != f->buffer) f->pair.ready = false;
    struct fit_layout bare = f->layout; /* contrasts do not change with a gain */
    bare.i_gain = bare.i_stray = SIZE_MAX;
    for (size_t i = 0; i < e->n_configuration && s == STATUS_OK; i++) {
        bool contrast = observation_is_contrast(&f->problem->observation->item[i]);
        fit_layout_estimate(contrast ? &bare : &f->layout, call->param, call->want_jacobian, &to[i], &out[i]);
    }
    return s;
}

static void nuisance_of(const struct fit_layout *l, const double *value, const double *se, const bool *at_bound,
                        struct fit_nuisance *n)
{
    const size_t slot[FIT_MAX_NUISANCE] = {l->i_gain, l->i_stray};
    memset(n, 0, sizeof *n);
    for (size_t i = 0; i < FIT_MAX_NUISANCE; i++) {
        if (slot[i] == SIZE_MAX) continue;
        snprintf(n->name[n->n], sizeof n->name[n->n], "%s", l->info[slot[i]].name);
        n->value[n->n] = value[slot[i]];
        n->se[n->n] = se != NULL ? se[slot[i]] : NAN;
        n->at_bound[n->n++] = at_bound != NULL && at_bound[slot[i]];
    }
}

static status report(void *context, const struct fit_step *step, struct error *err)
{
    struct fit *f = context;
    struct fit_step outer = *step;
    struct fit_nuisance nuisance;
    double full[N], se[N];
    char phase[64];
    fit_layout_full(&f->layout, step->param, full);
    if (step->param_se != NULL) fit_layout_full(&f->layout, step->param_se, se);
    nuisance_of(&f->layout, step->param, step->param_se, NULL, &nuisance);
    while (outer.n_configuration > 0 &&
           !observation_is_measured_mean(&f->problem->observation->item[outer.n_configuration - 1]))
        outer.n_configuration--;
    if (f->n_start > 1) {
        snprintf(phase, sizeof phase, "start %zu of %zu: %.30s", f->i_start + 1, f->n_start, step->phase);
        outer.phase = phase;
    }
    outer.step += f->n_step;
    outer.wall_s += f->wall_s;
    outer.n_path_total += f->n_path;
    outer.n_param = f->layout.n_full;
    outer.param = full;
    outer.param_se = step->param_se != NULL ? se : NULL;
    outer.nuisance = nuisance.n > 0 ? &nuisance : NULL;
    return f->problem->report(f->problem->report_context, &outer, err);
}

static void report_progress(void *context, double fraction)
{
    const struct fit *f = context;
    progress_report(f->problem->progress, ((double)f->i_start + fraction) / (double)f->n_start);
}

/* ---- back to the model's parameters ---- */

static void expand_uncertainty(const struct fit_layout *l, const struct param_info *info, const double *unknown,
                               const struct uncertainty *u, struct uncertainty *full)
{
    size_t n = l->n_full, m = l->n_unknown;
    memset(full, 0, sizeof *full);
    full->n_param = n;
    full->misfit_var = u->misfit_var;
    full->noise_var = u->noise_var;
    full->photograph_var = u->photograph_var;
    for (size_t p = 0; p < n; p++) {
        size_t k = l->owner[p];
        double stretch = fit_layout_stretch(l, info, unknown, p);
        full->se_param[p] = l->ratio[p] * u->se_param[k];
        full->at_bound[p] = u->at_bound[k];
        full->determined[p] = u->determined[k];
        for (size_t q = 0; q < n; q++) {
            size_t j = l->owner[q];
            full->cov[p * n + q] = stretch * fit_layout_stretch(l, info, unknown, q) * u->cov[k * m + j];
            full->correlation[p * n + q] = p == q                             ? 1.0
                                           : k != j || !l->parameter[k].fixed ? u->correlation[k * m + j]
                                                                              : 0.0;
        }
    }
}

static void expand(const struct fit *f, const struct fit_result *r, struct fit_result *out)
{
    *out = *r;
    memset(out->param, 0, sizeof out->param);
    fit_layout_full(&f->layout, r->param, out->param);
    expand_uncertainty(&f->layout, f->problem->info, r->param, &r->uncertainty, &out->uncertainty);
    nuisance_of(&f->layout, r->param, r->uncertainty.se_param, r->uncertainty.at_bound, &out->nuisance);
    memcpy(out->unknown, r->param, sizeof out->unknown);
    out->unknown_uncertainty = r->uncertainty;
}

/* ---- starts ---- */

void fit_run_start(const struct fit_layout *l, size_t k, double *unknown)
{
    size_t n_free = 0, i = 0;
    for (size_t u = 0; u < l->n_unknown; u++) n_free += !l->parameter[u].fixed;
    double phi = 2.0; /* the root of phi^(n + 1) = phi + 1 */
    for (int round = 0; round < 60; round++) phi = pow(1.0 + phi, 1.0 / ((double)n_free + 1.0));
    for (size_t u = 0; u < l->n_unknown; u++) {
        const struct fit_parameter *p = &l->parameter[u];
        unknown[u] = p->start;
        if (p->fixed) continue;
        struct coordinate c;
        coordinate_init(&c, &l->info[u], p->lower, p->upper);
        double share = fmod(0.5 + (double)k * pow(phi, -(double)++i), 1.0), lower = c.lower, upper = c.upper;
        if (l->prior[u].precision > 0.0) {
            double sd = 1.0 / sqrt(l->prior[u].precision);
            lower = fmax(lower, l->prior[u].mean - 2.5 * sd);
            upper = fmax(lower, fmin(upper, l->prior[u].mean + 2.5 * sd));
        }
        unknown[u] = coordinate_to_param(&c, lower + (0.1 + 0.8 * share) * (upper - lower));
    }
}

/* Writes the values of the unknowns at a point given in the model's parameters. */
static void start_at(const struct fit_layout *l, const double *full, double *unknown)
{
    for (size_t u = 0; u < l->n_unknown; u++) unknown[u] = l->parameter[u].start;
    for (size_t p = 0; p < l->n_full; p++) {
        const struct fit_parameter *own = &l->parameter[l->owner[p]];
        if (own->fixed || l->ratio[p] != 1.0) continue; /* a leader is its own owner, with the ratio 1 */
        unknown[l->owner[p]] = fmin(fmax(full[p], own->lower), own->upper);
    }
}

static void start_of(const struct fit *f, size_t k, double *unknown)
{
    const struct fit_layout *l = &f->layout;
    size_t n_extra = f->option->n_extra_start;
    if (k == 0)
        for (size_t u = 0; u < l->n_unknown; u++) unknown[u] = l->parameter[u].start;
    else if (k <= n_extra)
        start_at(l, f->option->extra_start[k - 1], unknown);
    else
        fit_run_start(l, k - n_extra, unknown);
}

static status run_start(struct fit *f, const struct descent_method *method, size_t k, struct fit_start *start,
                        struct fit_result *result, struct error *err)
{
    struct fit_layout layout = f->layout;
    struct fit_result reduced;
    struct estimator e = {.context = f,
                          .n_configuration = f->problem->estimator->n_configuration,
                          .n_param = layout.n_unknown,
                          .run = estimate};
    struct progress progress = {.report = report_progress,
                                .context = f,
                                .cancel = f->problem->progress != NULL ? f->problem->progress->cancel : NULL};
    struct fit_problem p = *f->problem;
    double unknown[N];
    start_of(f, k, unknown);
    for (size_t u = 0; u < layout.n_unknown; u++) layout.parameter[u].start = unknown[u];
    fit_layout_full(&f->layout, unknown, start->from);
    f->i_start = k;
    p.n_param = layout.n_unknown;
    p.info = layout.info;
    p.parameter = layout.parameter;
    p.estimator = &e;
    p.path_budget = f->path_budget;
    p.report = f->problem->report != NULL ? report : NULL;
    p.report_context = f;
    p.progress = &progress;
    p.prior = layout.has_prior ? layout.prior : NULL;
    p.gain_sd = f->option->photograph_gain_sd;
    status s = method->run(&p, &reduced, err);
    if (s != STATUS_OK) return s;
    expand(f, &reduced, result);
    memcpy(start->param, result->param, sizeof start->param);
    start->objective = result->objective.value;
    start->objective_se = result->objective.se;
    start->prior_penalty = result->prior_penalty;
    start->cross_validation = NAN;
    start->converged = result->converged;
    start->n_path = result->n_path;
    f->n_step += result->n_step;
    f->n_path += result->n_path;
    f->wall_s += result->wall_s;
    return STATUS_OK;
}

/* Returns the objective of b minus the objective of a, both with their prior penalties; se: its standard error. */
static double difference(const struct fit_start *a, const struct fit_start *b, double *se)
{
    *se = hypot(a->objective_se, b->objective_se);
    return b->objective + b->prior_penalty - a->objective - a->prior_penalty;
}

/* Marks converged starts whose objective equals the kept start's within the noise although a determined parameter
 * differs by more than four standard errors. */
static void mark_elsewhere(struct fit_result *r, size_t kept)
{
    for (size_t k = 0; k < r->n_start; k++) {
        double se, change = difference(&r->start[kept], &r->start[k], &se);
        if (k == kept || change > 2.0 * se || !r->start[k].converged || !r->converged) continue;
        for (size_t p = 0; p < r->uncertainty.n_param; p++)
            if (r->uncertainty.determined[p] &&
                fabs(r->start[k].param[p] - r->start[kept].param[p]) > 4.0 * r->uncertainty.se_param[p])
                r->start[k].elsewhere = true;
    }
}

static status run_starts(struct fit *f, const struct descent_method *method, struct fit_result *result,
                         struct error *err)
{
    size_t kept = 0;
    struct fit_result *next = malloc(sizeof *next);
    struct fit_start start[FIT_MAX_START];
    status s = next != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot start a fit: out of memory");
    memset(start, 0, sizeof start);
    for (size_t k = 0; k < f->n_start && s == STATUS_OK; k++) {
        s = run_start(f, method, k, &start[k], next, err);
        if (s != STATUS_OK) break;
        double se = 0.0;
        double change = difference(&start[kept], &start[k], &se);
        bool better = k == 0 || change < (k <= f->option->n_extra_start ? 0.0 : -2.0 * se);
        if (!better) continue;
        kept = k;
        *result = *next;
    }
    free(next);
    if (s != STATUS_OK || f->n_start == 1) return s;
    start[kept].kept = true;
    memcpy(result->start, start, sizeof start);
    result->n_start = f->n_start;
    result->n_step = f->n_step;
    result->n_path = f->n_path;
    result->wall_s = f->wall_s;
    mark_elsewhere(result, kept);
    return STATUS_OK;
}

status fit_run(const struct descent_method *method, const struct fit_problem *problem, const struct fit_option *option,
               struct fit_result *result, struct error *err)
{
    struct fit_option none;
    fit_option_init(&none);
    struct fit *f = calloc(1, sizeof *f);
    if (f == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot start a fit: out of memory");
    f->problem = problem;
    f->option = option != NULL ? option : &none;
    memset(result, 0, sizeof *result);
    status s = fit_layout_init(&f->layout, problem->info, problem->parameter, problem->n_param, f->option, err);
    f->n_start = f->option->n_start + f->option->n_extra_start;
    if (s == STATUS_OK && (f->option->n_start < 1 || f->n_start > FIT_MAX_START))
        s = error_set_field(err, STATUS_INVALID, OPTION_STARTS, "cannot fit from %zu starts: allowed are 1 to %d",
                            f->option->n_start, FIT_MAX_START);
    if (s != STATUS_OK) goto out;
    size_t n = problem->estimator->n_configuration;
    f->path_budget = problem->path_budget / f->n_start;
    f->buffer = calloc(n > 0 ? n : 1, sizeof *f->buffer);
    f->pair.next = calloc(n > 0 ? n : 1, sizeof *f->pair.next);
    s = f->buffer != NULL && f->pair.next != NULL
            ? run_starts(f, method, result, err)
            : error_set(err, STATUS_NO_MEMORY, "cannot fit %zu observations: out of memory", n);
out:
    free(f->buffer);
    free(f->pair.next);
    free(f);
    return s;
}
