#include "optimizer/fit/cloth/cloth_search.h"
#include "base/option_id.h"
#include "optimizer/fit/cloth/carried_error.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Steps of the fit to one cloth of the screening. */
enum { SCREEN_STEPS = 6, KIND_BYTES = 40 };
/* Steps that the budget of the joint fit is for. Each step builds several cloths, so its paths are many from the first
 * step on. */
enum { JOINT_STEPS = 14 };

struct search {
    const struct cloth_search *search;
    size_t i_start;                                /* of option->n_start searches */
    struct fit_layout layout;                      /* of the numbers alone, for the spread of the cloths */
    struct fit_parameter parameter[FIT_MAX_PARAM]; /* of all unknowns, with the start of the next fit */
    struct cloth_search_result *result;
    const struct cloth_search_result *before; /* totals of the searches before this one */
    char kind[KIND_BYTES];                    /* of the present fit: "cloth 3 of 8" */
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

/* Cloths that this search screens: later ones begin at one cloth each. */
static size_t n_screened(const struct search *s)
{
    return s->i_start > 0 && s->search->n_screen > 1 ? 1 : s->search->n_screen;
}

/* The extra start to which cloth i of the screening belongs; NULL when it belongs to none. */
static const double *extra_start(const struct cloth_search *q, size_t i)
{
    return i > 0 && i <= q->option->n_extra_start ? q->option->extra_start[i - 1] : NULL;
}

/* Index of cloth i in the sequence that is spread over the bounds; 0: the start values. Later searches go on where
 * the screening of the first one ends. */
static size_t spread_index(const struct search *s, size_t i)
{
    const size_t n_extra = s->search->option->n_extra_start, n_screen = s->search->n_screen;
    if (s->i_start > 0) return s->i_start + (n_screen > 1 + n_extra ? n_screen - 1 - n_extra : 0);
    return i > n_extra ? i - n_extra : 0;
}

static void choose_cloth(struct search *s, size_t i, double *number)
{
    const double *extra = s->i_start == 0 ? extra_start(s->search, i) : NULL;
    const size_t place = spread_index(s, i);
    for (size_t k = 0; k < s->layout.n_unknown; k++) {
        const struct fit_parameter *p = &s->layout.parameter[k];
        number[k] = p->start;
        if (extra != NULL && !p->fixed) number[k] = fmin(fmax(extra[n_scattering(s->search) + k], p->lower), p->upper);
    }
    if (place > 0) fit_run_start(&s->layout, place, number);
}

static status report_step(void *context, const struct fit_step *step, struct error *err)
{
    const struct search *s = context;
    const struct fit_problem *problem = s->search->problem;
    struct fit_step outer = *step;
    char phase[100], start[30] = "";
    if (s->search->option->n_start > 1)
        snprintf(start, sizeof start, "start %zu of %zu: ", s->i_start + 1, s->search->option->n_start);
    snprintf(phase, sizeof phase, "%s%s: %.30s", start, s->kind, step->phase);
    outer.phase = phase;
    outer.step += s->before->n_step + s->result->n_step;
    outer.wall_s += s->before->wall_s + s->result->wall_s;
    outer.n_path_total += s->before->n_path + s->result->n_path;
    return problem->report(problem->report_context, &outer, err);
}

/* Runs one of the fits and adds its steps, paths and time. */
static status run_fit(struct search *s, struct fit_problem *problem, const struct fit_option *option,
                      struct fit_result *fit, struct error *err)
{
    problem->report = s->search->problem->report != NULL ? report_step : NULL;
    problem->report_context = s;
    status st = fit_run(s->search->method, problem, option, fit, err);
    if (st != STATUS_OK) return st;
    s->result->n_step += fit->n_step;
    s->result->n_path += fit->n_path;
    s->result->wall_s += fit->wall_s;
    return STATUS_OK;
}

/* Fits the scattering parameters to the cloth of `number`, from `start`. */
static status fit_on_cloth(struct search *s, const double *number, const double *start, struct fit_problem *problem,
                           struct fit_result *fit, struct error *err)
{
    const struct cloth_search *q = s->search;
    struct fit_parameter parameter[FIT_MAX_PARAM];
    struct fit_option option = *q->option;
    memcpy(parameter, s->parameter, sizeof parameter);
    for (size_t p = 0; p < n_scattering(q); p++)
        if (start != NULL && !parameter[p].fixed)
            parameter[p].start = fmin(fmax(start[p], parameter[p].lower), parameter[p].upper);
    for (size_t k = 0; k < n_number(q); k++) {
        parameter[n_scattering(q) + k].start = number[k];
        parameter[n_scattering(q) + k].fixed = true;
    }
    option.n_start = 1;
    option.n_extra_start = 0;
    problem->parameter = parameter;
    q->cloth->number_derivatives = false;
    status st = run_fit(s, problem, &option, fit, err);
    q->cloth->number_derivatives = true;
    return st;
}

/* Whether cloth i is better than the best one so far. An extra start, which is the result of another fit, is when its
 * objective is lower at all. Of the others it takes two standard errors, because the lowest of many noisy objectives is
 * often a matter of chance, and the cloth of the start values is the likeliest one beforehand. */
static bool is_better(const struct search *s, size_t i)
{
    const struct cloth_screened *best = &s->result->screened[s->result->i_best], *new = &s->result->screened[i];
    double doubt = extra_start(s->search, i) != NULL ? 0.0 : 2.0 * hypot(new->objective_se, best->objective_se);
    return new->objective < best->objective - doubt;
}

/* Fits the scattering parameters to cloth i, and stores them as the start of the later fits when cloth i is the best so
 * far. */
static status screen_cloth(struct search *s, size_t i, double *best_param, struct fit_result *fit, struct error *err)
{
    const struct cloth_search *q = s->search;
    struct cloth_screened *to = &s->result->screened[i];
    struct progress_part part;
    const size_t n_screen = n_screened(s);
    const double share = q->screen_share / (double)n_screen;
    struct progress progress = progress_begin_part(&part, q->problem->progress, share * (double)i, share);
    struct fit_problem problem = *q->problem;
    snprintf(s->kind, sizeof s->kind, "cloth %zu of %zu", i + 1, n_screen);
    choose_cloth(s, i, to->number);
    problem.path_budget = q->screen_budget;
    problem.max_iteration = SCREEN_STEPS;
    problem.progress = &progress;
    status st = fit_on_cloth(s, to->number, s->i_start == 0 ? extra_start(q, i) : NULL, &problem, fit, err);
    if (st != STATUS_OK) return st;
    to->objective = fit->objective.value + fit->prior_penalty;
    to->objective_se = fit->objective.se;
    to->n_path = fit->n_path;
    if (i > 0 && !is_better(s, i)) return STATUS_OK;
    s->result->i_best = i;
    memcpy(best_param, fit->param, n_scattering(q) * sizeof *best_param);
    return STATUS_OK;
}

static status run_screening(struct search *s, struct error *err)
{
    const struct cloth_search *q = s->search;
    struct cloth_search_result *r = s->result;
    double best[FIT_MAX_PARAM];
    status st = STATUS_OK;
    if (q->n_screen == 0) {
        choose_cloth(s, 0, r->screened[0].number);
        for (size_t k = 0; k < n_number(q); k++) s->parameter[n_scattering(q) + k].start = r->screened[0].number[k];
        return STATUS_OK;
    }
    for (; st == STATUS_OK && r->n_screen < n_screened(s); r->n_screen++)
        st = screen_cloth(s, r->n_screen, best, &r->joint, err); /* its memory is free until the joint fit */
    if (st != STATUS_OK) return st;
    for (size_t p = 0; p < n_scattering(q); p++)
        if (!s->parameter[p].fixed) s->parameter[p].start = best[p];
    for (size_t k = 0; k < n_number(q); k++) s->parameter[n_scattering(q) + k].start = r->screened[r->i_best].number[k];
    return STATUS_OK;
}

/* Paths of the joint fit's own cloths: differences take paths, too. */
static uint64_t joint_budget(const struct search *s)
{
    const struct cloth_search *q = s->search;
    size_t n_free = 0;
    for (size_t k = 0; k < n_number(q); k++) n_free += !q->cloth->fixed[k];
    double spared =
        ((double)q->screen_expected - (double)s->result->n_path) / cloth_estimator_cost(q->cloth->moves, n_free);
    return (uint64_t)fmax((double)q->problem->path_budget + spared, (double)q->least_joint_budget);
}

/* The fit of all unknowns, from the best cloth. */
static status run_joint(struct search *s, struct error *err)
{
    const struct cloth_search *q = s->search;
    const double done = q->n_screen > 0 ? q->screen_share : 0.0;
    struct progress_part part;
    struct progress progress = progress_begin_part(&part, q->problem->progress, done, 1.0 - done - q->final_share);
    struct fit_problem problem = *q->problem;
    struct fit_option option = *q->option;
    option.n_start = 1;
    option.n_extra_start = 0;
    snprintf(s->kind, sizeof s->kind, "numbers of the cloth");
    if (q->n_screen > 0) problem.path_budget = joint_budget(s);
    /* with a goal of precision the budget says little about the paths that are needed, and few of them come first */
    const uint64_t usual = q->method->info->default_path_budget;
    const uint64_t expected = problem.precision > 0.0 && problem.path_budget > usual ? usual : problem.path_budget;
    problem.first_path = expected / (JOINT_STEPS * 2 * problem.observation->n);
    problem.parameter = s->parameter;
    problem.progress = &progress;
    return run_fit(s, &problem, &option, &s->result->joint, err);
}

static status run_final(struct search *s, const double *number, const double *start, double from,
                        struct fit_result *fit, struct error *err)
{
    const struct cloth_search *q = s->search;
    const struct cloth_source *source = &q->cloth->source;
    struct progress_part part;
    struct progress progress =
        progress_begin_part(&part, q->problem->progress, 1.0 - q->final_share * (1.0 - from), 0.5 * q->final_share);
    struct fit_problem problem = *q->problem;
    snprintf(s->kind, sizeof s->kind, "chosen cloth");
    problem.path_budget = q->final_budget;
    problem.progress = &progress;
    if (source->set_final != NULL) source->set_final(source->context, true);
    status st = fit_on_cloth(s, number, start, &problem, fit, err);
    if (source->set_final != NULL) source->set_final(source->context, false);
    return st;
}

/* Fits the cloth of the joint fit, and the best cloth of the screening where the joint fit ended worse. */
static status choose_final(struct search *s, struct fit_result *other, struct error *err)
{
    const size_t n = n_scattering(s->search);
    struct cloth_search_result *r = s->result;
    memcpy(r->number, r->joint.param + n, n_number(s->search) * sizeof *r->number);
    status st = run_final(s, r->number, r->joint.param, 0.0, &r->final, err);
    if (st != STATUS_OK || r->n_screen == 0) return st;
    const struct cloth_screened *best = &r->screened[r->i_best];
    double f = r->final.objective.value + r->final.prior_penalty;
    if (f - best->objective < 2.0 * hypot(r->final.objective.se, best->objective_se)) return STATUS_OK;
    st = run_final(s, best->number, NULL, 0.5, other, err);
    if (st != STATUS_OK || other->objective.value + other->prior_penalty >= f) return st;
    r->took_screened = true;
    r->final = *other;
    memcpy(r->number, best->number, sizeof r->number);
    return STATUS_OK;
}

/* ---- several searches ---- */

/* Makes search i_start, whose progress is a part of the whole. `other` is working memory. */
static status run_search(const struct cloth_search *q, size_t i_start, const struct cloth_search_result *before,
                         struct cloth_search_result *r, struct fit_result *other, struct error *err)
{
    const double n_start = (double)q->option->n_start;
    struct progress_part part;
    struct progress progress =
        progress_begin_part(&part, q->problem->progress, (double)i_start / n_start, 1.0 / n_start);
    struct fit_problem problem = *q->problem;
    struct cloth_search own = *q;
    struct search *s = calloc(1, sizeof *s);
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot fit a cloth: out of memory");
    problem.progress = &progress;
    own.problem = &problem;
    *s = (struct search){.search = &own, .i_start = i_start, .result = r, .before = before};
    memset(r, 0, sizeof *r);
    memcpy(s->parameter, problem.parameter, problem.n_param * sizeof *s->parameter);
    status st = spread_layout(q, &s->layout, err);
    if (st == STATUS_OK) st = run_screening(s, err);
    if (st == STATUS_OK) st = run_joint(s, err);
    if (st == STATUS_OK) st = choose_final(s, other, err);
    free(s);
    return st;
}

/* Whether `new` predicts rows that were left out better than `kept`; without cross-validation, whether its objective is
 * lower beyond doubt. */
static bool predicts_better(const struct fit_result *new, const struct fit_result *kept)
{
    const struct cross_validation *a = &kept->cross_validation, *b = &new->cross_validation;
    if (a->n_fold > 0 && b->n_fold > 0) return b->rel_square < a->rel_square;
    double doubt = 2.0 * hypot(new->objective.se, kept->objective.se);
    return new->objective.value + new->prior_penalty < kept->objective.value + kept->prior_penalty - doubt;
}

static void describe_start(const struct cloth_search *q, const struct cloth_search_result *r, struct fit_start *to)
{
    const struct cross_validation *v = &r->final.cross_validation;
    for (size_t p = 0; p < q->problem->n_param; p++) to->from[p] = q->problem->parameter[p].start;
    memcpy(to->from + n_scattering(q), r->screened[0].number, n_number(q) * sizeof *to->from);
    memcpy(to->param, r->final.param, sizeof to->param);
    to->objective = r->final.objective.value;
    to->objective_se = r->final.objective.se;
    to->prior_penalty = r->final.prior_penalty;
    to->cross_validation = v->n_fold > 0 ? v->rel_rms : NAN;
    to->converged = r->final.converged;
    to->n_path = r->n_path;
}

static void add_taken(struct cloth_search_result *sum, const struct cloth_search_result *r)
{
    sum->n_step += r->n_step;
    sum->n_path += r->n_path;
    sum->wall_s += r->wall_s;
}

/* All searches; the one that predicts best is left in r. next, taken, other: working memory; taken is 0. */
static status run_searches(const struct cloth_search *q, struct cloth_search_result *r,
                           struct cloth_search_result *next, struct cloth_search_result *taken,
                           struct fit_result *other, struct error *err)
{
    struct fit_start start[FIT_MAX_START];
    size_t kept = 0;
    memset(start, 0, sizeof start);
    for (size_t k = 0; k < q->option->n_start; k++) {
        status st = run_search(q, k, taken, k == 0 ? r : next, other, err);
        if (st != STATUS_OK) return st;
        const struct cloth_search_result *now = k == 0 ? r : next;
        describe_start(q, now, &start[k]);
        add_taken(taken, now);
        if (k == 0 || !predicts_better(&next->final, &r->final)) continue;
        kept = k;
        memcpy(r, next, sizeof *r);
    }
    r->n_step = taken->n_step;
    r->n_path = taken->n_path;
    r->wall_s = taken->wall_s;
    if (q->option->n_start == 1) return STATUS_OK;
    start[kept].kept = true;
    memcpy(r->final.start, start, sizeof start);
    r->final.n_start = q->option->n_start;
    return STATUS_OK;
}

status cloth_search_run(const struct cloth_search *q, struct cloth_search_result *r, struct error *err)
{
    struct cloth_search_result *next = calloc(2, sizeof *next);
    struct fit_result *other = malloc(sizeof *other);
    status st = STATUS_OK;
    if (next == NULL || other == NULL)
        st = error_set(err, STATUS_NO_MEMORY, "cannot fit a cloth: out of memory");
    else if (q->n_screen > CLOTH_MAX_SCREEN)
        st = error_set(err, STATUS_INVALID, "cannot screen %zu cloths: at most %d are allowed", q->n_screen,
                       CLOTH_MAX_SCREEN);
    else if (q->option->n_start < 1 || q->option->n_start > FIT_MAX_START)
        st = error_set_field(err, STATUS_INVALID, OPTION_STARTS, "cannot fit from %zu starts: allowed are 1 to %d",
                             q->option->n_start, FIT_MAX_START);
    else
        st = run_searches(q, r, next, next + 1, other, err);
    free(other);
    free(next);
    return st;
}

/* ---- the result for the scattering parameters ---- */

void cloth_search_marginal(const struct cloth_search *q, const struct cloth_search_result *r, struct fit_result *out)
{
    const size_t n = n_scattering(q), m = n_number(q);
    size_t n_leader = 0;
    for (size_t p = 0; p < n; p++) n_leader += q->option->leader[p] == p;
    *out = r->final;
    carried_error_leave_out(&r->final.uncertainty, n, m, &out->uncertainty);
    carried_error_add(&r->joint.uncertainty, n, m, NULL, &out->uncertainty);
    carried_error_limit(q->problem->info, q->problem->parameter, &out->uncertainty);
    carried_error_leave_out(&r->final.unknown_uncertainty, n_leader, m, &out->unknown_uncertainty);
    carried_error_add(&r->joint.unknown_uncertainty, n_leader, m, NULL, &out->unknown_uncertainty);
    memmove(out->unknown + n_leader, out->unknown + n_leader + m,
            (FIT_MAX_PARAM - n_leader - m) * sizeof *out->unknown);
    out->n_step = r->n_step;
    out->n_path = r->n_path;
    out->wall_s = r->wall_s;
}
