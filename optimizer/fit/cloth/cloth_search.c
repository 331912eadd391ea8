#include "optimizer/fit/cloth/cloth_search.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Steps of the fit to one cloth of the screening: the first starts far from its parameters, the others at those of the
 * best cloth so far. */
enum { FIRST_SCREEN_STEPS = 8, SCREEN_STEPS = 4 };

struct screening {
    const struct cloth_search *search;
    struct fit_layout layout;                      /* of the numbers alone, for the spread of the cloths */
    struct fit_parameter parameter[FIT_MAX_PARAM]; /* with the best parameters so far as start */
    struct cloth_search_result *result;
    size_t i_cloth, n_step; /* present cloth; steps of the fits before it */
};

static size_t n_scattering(const struct cloth_search *q) { return q->cloth->n_scattering; }
static size_t n_number(const struct cloth_search *q) { return q->cloth->source.n_number; }

/* Describes the numbers as the unknowns of a fit, so that fit_run_start spreads them like starts. */
static status spread_layout(const struct cloth_search *q, struct fit_layout *l, struct error *err)
{
    struct fit_option option;
    fit_option_init(&option);
    for (size_t k = 0; k < n_number(q); k++) {
        option.prior_mean[k] = q->option->prior_mean[n_scattering(q) + k];
        option.prior_se[k] = q->option->prior_se[n_scattering(q) + k];
    }
    return fit_layout_init(l, q->problem->info + n_scattering(q), q->problem->parameter + n_scattering(q), n_number(q),
                           &option, err);
}

static void choose_cloth(struct screening *s, size_t i, double *number)
{
    if (i == 0)
        for (size_t k = 0; k < s->layout.n_unknown; k++) number[k] = s->layout.parameter[k].start;
    else
        fit_run_start(&s->layout, i, number);
}

static status report_step(void *context, const struct fit_step *step, struct error *err)
{
    const struct screening *s = context;
    const struct fit_problem *problem = s->search->problem;
    struct fit_step outer = *step;
    char phase[64];
    if (s->i_cloth < s->search->n_screen) {
        snprintf(phase, sizeof phase, "cloth %zu of %zu: %.30s", s->i_cloth + 1, s->search->n_screen, step->phase);
        outer.phase = phase;
    }
    outer.step += s->n_step;
    outer.wall_s += s->result->wall_s;
    outer.n_path_total += s->result->n_path;
    return problem->report(problem->report_context, &outer, err);
}

/* Runs one of the fits and adds what it took. */
static status run_fit(struct screening *s, struct fit_problem *problem, const struct fit_option *option,
                      struct fit_result *fit, struct error *err)
{
    problem->report = s->search->problem->report != NULL ? report_step : NULL;
    problem->report_context = s;
    status st = fit_run(s->search->method, problem, option, fit, err);
    if (st != STATUS_OK) return st;
    s->n_step += fit->n_step;
    s->result->n_path += fit->n_path;
    s->result->wall_s += fit->wall_s;
    return STATUS_OK;
}

/* Fits the scattering parameters to cloth i, and keeps them as the start of what follows when it is the best so far. */
static status screen_cloth(struct screening *s, size_t i, struct fit_result *fit, struct error *err)
{
    const struct cloth_search *q = s->search;
    struct cloth_screened *to = &s->result->screened[i];
    struct progress_part part;
    const double share = q->screen_share / (double)q->n_screen;
    struct progress progress = progress_begin_part(&part, q->problem->progress, share * (double)i, share);
    struct fit_parameter parameter[FIT_MAX_PARAM];
    struct fit_option option = *q->option;
    struct fit_problem problem = *q->problem;
    memcpy(parameter, s->parameter, sizeof parameter);
    choose_cloth(s, i, to->number);
    for (size_t k = 0; k < n_number(q); k++) {
        parameter[n_scattering(q) + k].start = to->number[k];
        parameter[n_scattering(q) + k].fixed = true;
    }
    option.n_start = 1;
    problem.parameter = parameter;
    problem.path_budget = q->screen_budget;
    problem.max_iteration = i == 0 ? FIRST_SCREEN_STEPS : SCREEN_STEPS;
    problem.progress = &progress;
    s->i_cloth = i;
    status st = run_fit(s, &problem, &option, fit, err);
    if (st != STATUS_OK) return st;
    to->objective = fit->objective.value + fit->prior_penalty;
    to->objective_se = fit->objective.se;
    to->n_path = fit->n_path;
    if (i > 0 && !(to->objective < s->result->screened[s->result->i_best].objective)) return STATUS_OK;
    s->result->i_best = i;
    for (size_t p = 0; p < n_scattering(q); p++)
        if (!parameter[p].fixed) s->parameter[p].start = fit->param[p];
    return STATUS_OK;
}

/* The fit of all unknowns, from the best cloth. */
static status run_joint(struct screening *s, struct error *err)
{
    const struct cloth_search *q = s->search;
    const double done = q->n_screen > 1 ? q->screen_share : 0.0;
    struct progress_part part;
    struct progress progress = progress_begin_part(&part, q->problem->progress, done, 1.0 - done);
    struct fit_problem problem = *q->problem;
    if (q->n_screen > 1)
        for (size_t k = 0; k < n_number(q); k++)
            s->parameter[n_scattering(q) + k].start = s->result->screened[s->result->i_best].number[k];
    s->i_cloth = q->n_screen;
    problem.parameter = s->parameter;
    problem.progress = &progress;
    return run_fit(s, &problem, q->option, &s->result->joint, err);
}

status cloth_search_run(const struct cloth_search *q, struct cloth_search_result *r, struct error *err)
{
    struct screening *s = calloc(1, sizeof *s);
    struct fit_result *fit = malloc(sizeof *fit);
    memset(r, 0, sizeof *r);
    status st =
        s != NULL && fit != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot fit a cloth: out of memory");
    if (st == STATUS_OK && q->n_screen > CLOTH_MAX_SCREEN)
        st = error_set(err, STATUS_INVALID, "cannot screen %zu cloths: at most %d are allowed", q->n_screen,
                       CLOTH_MAX_SCREEN);
    if (st != STATUS_OK) goto out;
    s->search = q;
    s->result = r;
    memcpy(s->parameter, q->problem->parameter, q->problem->n_param * sizeof *s->parameter);
    st = spread_layout(q, &s->layout, err);
    q->cloth->differences = false;
    for (; st == STATUS_OK && q->n_screen > 1 && r->n_screen < q->n_screen; r->n_screen++)
        st = screen_cloth(s, r->n_screen, fit, err);
    q->cloth->differences = true;
    if (st == STATUS_OK) st = run_joint(s, err);
out:
    free(fit);
    free(s);
    return st;
}

/* ---- the scattering parameters of a joint fit ---- */

/* Leaves out of u the n_out entries from `first` on: of vectors and of rows and columns of matrices. */
static void leave_out(const struct uncertainty *u, size_t first, size_t n_out, struct uncertainty *out)
{
    size_t n = u->n_param, m = n - n_out;
    *out = *u;
    out->n_param = m;
    for (size_t p = 0; p < m; p++) {
        size_t from = p < first ? p : p + n_out;
        out->se_param[p] = u->se_param[from];
        out->at_bound[p] = u->at_bound[from];
        out->determined[p] = u->determined[from];
        for (size_t q = 0; q < m; q++) {
            size_t to = q < first ? q : q + n_out;
            out->cov[p * m + q] = u->cov[from * n + to];
            out->correlation[p * m + q] = u->correlation[from * n + to];
        }
    }
}

void cloth_search_marginal(const struct fit_result *joint, const struct fit_option *option, size_t n_scattering_param,
                           size_t n_numbers, struct fit_result *out)
{
    size_t n_leader = 0;
    for (size_t p = 0; p < n_scattering_param; p++) n_leader += option->leader[p] == p;
    *out = *joint;
    leave_out(&joint->uncertainty, n_scattering_param, n_numbers, &out->uncertainty);
    leave_out(&joint->unknown_uncertainty, n_leader, n_numbers, &out->unknown_uncertainty);
    memmove(out->unknown + n_leader, out->unknown + n_leader + n_numbers,
            (FIT_MAX_PARAM - n_leader - n_numbers) * sizeof *out->unknown);
}
