#include "optimizer/fit/profile/profile_fit.h"
#include "base/clock.h"
#include "base/option_id.h"
#include "optimizer/fit/descent/fit_run.h"
#include "optimizer/fit/profile/profile_error.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

enum { ITERATIONS_OF_START = 8, DEFAULT_ITERATIONS = 40, MISFIT_ROUNDS = 4, MOST_START = 16 };

/* The relative misfit that weighs the values before the residuals are known, and the part of the mean radiance that is
 * added to each value, so that a dark one does not count for much. */
static const double first_misfit = 0.1, dark_part = 0.02;
/* Relative residuals and errors, as reported, are shares of at least this part of the brightest radiance. */
static const double least_part = 0.02;
/* Change of the misfit, over it, below which another round would not change the weights. */
static const double same_misfit = 0.02;

/* ---- the target ---- */

static status target_values(struct profile_target *t, struct error *err)
{
    const struct fiber_profile *p = t->problem->profile;
    double mean = 0.0, most = 0.0;
    t->measured = calloc(t->n_value, sizeof *t->measured);
    t->base = calloc(t->n_value, sizeof *t->base);
    if (t->measured == NULL || t->base == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot fit a profile: out of memory");
    for (size_t i = 0; i < t->n_value; i++) {
        t->measured[i] = p->row[i / p->n_channel].radiance[i % p->n_channel];
        mean += t->measured[i] / (double)t->n_value;
        most = fmax(most, t->measured[i]);
    }
    t->least = least_part * most;
    for (size_t i = 0; i < t->n_value; i++) t->base[i] = fmax(t->measured[i], 0.0) + dark_part * mean;
    return STATUS_OK;
}

/* Makes q follow the leader of p, with all that follow q. */
static void follow(struct fit_option *o, size_t n_param, size_t q, size_t p)
{
    for (size_t k = 0; k < n_param; k++) {
        if (o->leader[k] != q) continue;
        o->leader[k] = o->leader[p];
        o->ratio[k] *= o->ratio[p];
    }
}

/* A grey profile says one thing of a colour, so its channels have one value. The ties of the job stay as they are: a
 * channel that follows another parameter is not tied again. */
static void tie_channels(const struct profile_problem *problem, struct fit_option *o)
{
    const struct param_info *info = problem->model->param;
    if (problem->profile->n_channel != 1) return;
    for (size_t p = 0; p + 2 < problem->model->n_param; p++) {
        if (info[p].kind != PARAM_COLOUR || info[p].channel != 0) continue;
        for (size_t q = p + 1; q < p + 3; q++)
            if (o->leader[q] == q && o->leader[p] != q && !problem->parameter[q].fixed && !problem->parameter[p].fixed)
                follow(o, problem->model->n_param, q, p);
    }
}

/* Sets the mode that the profile shows. */
static status find_mode(struct profile_target *t, struct error *err)
{
    const struct profile_problem *p = t->problem;
    if (p->mode == NULL) return STATUS_OK;
    for (const char *const *m = p->model->mode; m != NULL && *m != NULL; m++)
        if (strcmp(*m, p->mode) == 0) t->mode = (size_t)(m - p->model->mode) + 1;
    if (t->mode > 0) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, OPTION_PROFILE_MODE,
                           "the profile shows the mode %s alone, which '%s' cannot do: it has all modes together",
                           p->mode, p->model->id);
}

static status target_init(struct profile_target *t, const struct profile_problem *problem, const char *table_name,
                          size_t *n_free, struct error *err)
{
    struct fit_option o = *problem->option;
    *t = (struct profile_target){.problem = problem, .n_value = problem->profile->n * problem->profile->n_channel};
    o.global_gain_sd = o.stray_light_sd = 0.0;
    tie_channels(problem, &o);
    status s = fit_layout_init(&t->layout, problem->model->param, problem->parameter, problem->model->n_param, &o, err);
    if (s == STATUS_OK) s = find_mode(t, err);
    if (s != STATUS_OK) return s;
    t->i_turn = t->layout.n_unknown;
    t->i_scale = t->layout.n_unknown + 1;
    t->n_unknown = t->layout.n_unknown + 2;
    *n_free = 0;
    for (size_t u = 0; u < t->layout.n_unknown; u++) {
        const struct fit_parameter *k = &t->layout.parameter[u];
        coordinate_init(&t->coordinate[u], &t->layout.info[u], k->lower, k->upper);
        t->fixed[u] = k->fixed;
        *n_free += !k->fixed;
    }
    t->fixed[t->i_turn] = !isnan(problem->turn_rad) || !profile_model_turns(problem->model, problem->profile);
    t->fixed[t->i_scale] = !isnan(problem->scale);
    *n_free += (size_t)!t->fixed[t->i_turn] + (size_t)!t->fixed[t->i_scale];
    if (t->n_value <= *n_free)
        return error_set_field(err, STATUS_INVALID, OPTION_PROFILE_FILE,
                               "cannot use table '%s': it ends at line %zu with %zu radiances, but the fit of '%s' has "
                               "%zu unknowns%s: give more rows, or hold some parameters fixed",
                               table_name, problem->profile->last_line, t->n_value, problem->model->id, *n_free,
                               isnan(problem->scale) ? " with the scale" : "");
    return target_values(t, err);
}

static void target_release(struct profile_target *t)
{
    free(t->measured);
    free(t->base);
}

/* ---- starts ---- */

/* Share of the time that the starts take; the rest goes to the best one. */
static const double share_of_starts = 0.95;

struct starts;
struct start {
    struct starts *all;
    double done; /* share */
};

struct starts {
    const struct profile_target *target;
    size_t n;
    struct profile_search search[MOST_START];
    status code[MOST_START];
    struct error error[MOST_START];
    struct start start[MOST_START];
    pthread_mutex_t lock; /* of `done` of all starts, and of reports */
};

/* Reports the mean share of all starts. context: one of them. */
static void report_start(void *context, double done)
{
    struct start *one = context;
    struct starts *all = one->all;
    double sum = 0.0;
    pthread_mutex_lock(&all->lock);
    one->done = done;
    for (size_t k = 0; k < all->n; k++) sum += all->start[k].done;
    progress_report(all->target->problem->progress, share_of_starts * sum / (double)all->n);
    pthread_mutex_unlock(&all->lock);
}

static void run_start(void *context, size_t k, size_t i_thread)
{
    struct starts *all = context;
    const struct fit_layout *l = &all->target->layout;
    double unknown[FIT_MAX_PARAM];
    (void)i_thread;
    for (size_t u = 0; u < l->n_unknown; u++) unknown[u] = l->parameter[u].start;
    if (k > 0) fit_run_start(l, k, unknown);
    const struct profile_start from = {unknown, first_misfit, k % 3 == 2};
    all->code[k] = profile_search_begin(&all->search[k], all->target, NULL, &from, &all->error[k]);
    all->start[k].all = all;
    all->search[k].progress = (struct progress){.report = report_start, .context = &all->start[k]};
    if (all->code[k] == STATUS_OK)
        all->code[k] = profile_search_run(&all->search[k], ITERATIONS_OF_START, &all->error[k]);
    report_start(&all->start[k], 1.0);
}

/* The radiance that the residual and the error of a value are relative to. */
static double relative_to(const struct profile_target *t, size_t i) { return fmax(t->base[i], t->least); }

static double rel_rms_of(const struct profile_target *t, const double *value)
{
    double sum = 0.0;
    for (size_t i = 0; i < t->n_value; i++) {
        const double r = (value[i] - t->measured[i]) / relative_to(t, i);
        sum += r * r;
    }
    return sqrt(sum / (double)t->n_value);
}

/* Runs all starts and returns the index of the best. */
static status run_starts(struct starts *all, struct profile_fit *fit, size_t *best, struct error *err)
{
    const struct profile_problem *problem = all->target->problem;
    const struct progress silent = progress_silent(problem->progress);
    status s = thread_pool_run(problem->pool, fit->n_start, run_start, all, &silent);
    if (s != STATUS_OK) return error_set(err, s, "cancelled");
    *best = 0;
    for (size_t k = 0; k < fit->n_start; k++) {
        if (all->code[k] != STATUS_OK) {
            if (err != NULL) *err = all->error[k];
            return all->code[k];
        }
        fit->n_evaluation += all->search[k].n_evaluation;
        if (all->search[k].here.f < all->search[*best].here.f) *best = k;
    }
    const double least = rel_rms_of(all->target, all->search[*best].here.value);
    for (size_t k = 0; k < fit->n_start; k++)
        fit->n_agree += rel_rms_of(all->target, all->search[k].here.value) <= 1.01 * least;
    return STATUS_OK;
}

/* ---- the misfit ---- */

/* The sum of squares at a relative misfit t, over the number of values less the number of unknowns. */
static double reduced_sum(const struct profile_search *s, size_t n_free, double misfit)
{
    const struct profile_target *t = s->target;
    const struct fiber_profile *p = t->problem->profile;
    double sum = 0.0;
    for (size_t i = 0; i < t->n_value; i++) {
        const double r = s->here.value[i] - t->measured[i], se = p->row[i / p->n_channel].se[i % p->n_channel];
        sum += r * r / (se * se + misfit * misfit * t->base[i] * t->base[i]);
    }
    return sum / (double)(t->n_value - n_free);
}

/* The misfit that explains the residuals: the root of reduced_sum = 1, or 0 where it is below 1 without any. */
static double misfit_of(const struct profile_search *s, size_t n_free)
{
    double low = 1e-6, high = 100.0;
    if (s->target->problem->profile->has_se && reduced_sum(s, n_free, 0.0) <= 1.0) return 0.0;
    for (int i = 0; i < 60; i++) {
        const double middle = sqrt(low * high);
        if (reduced_sum(s, n_free, middle) > 1.0)
            low = middle;
        else
            high = middle;
    }
    return sqrt(low * high);
}

/* Weighs the values by the misfit that is left, and fits again, until both agree. */
static status refine(struct profile_search *s, struct profile_fit *fit, struct error *err)
{
    const size_t asked = s->target->problem->max_iteration;
    double misfit = first_misfit;
    for (int round = 0; round < MISFIT_ROUNDS; round++) {
        fit->misfit = misfit_of(s, fit->n_free);
        if (round > 0 && fabs(fit->misfit - misfit) <= same_misfit * misfit) break;
        misfit = fit->misfit;
        profile_search_set_misfit(s, misfit);
        status code = profile_search_run(s, asked > 0 ? asked : DEFAULT_ITERATIONS, err);
        if (code != STATUS_OK) return code;
    }
    fit->converged = s->converged;
    return STATUS_OK;
}

/* ---- the result ---- */

static void put_residuals(const struct profile_search *s, struct profile_fit *fit)
{
    const struct profile_target *t = s->target;
    const struct fiber_profile *p = t->problem->profile;
    double least = INFINITY, most = 0.0, sum = 0.0, stated = 0.0;
    fit->bic = (double)fit->n_free * log((double)t->n_value);
    for (size_t i = 0; i < t->n_value; i++) {
        const double r = s->here.value[i] - t->measured[i];
        sum += r * r;
        if (p->has_se) stated += pow(p->row[i / p->n_channel].se[i % p->n_channel] / relative_to(t, i), 2.0);
        fit->bic += r * r / (s->error[i] * s->error[i]) + 2.0 * log(s->error[i]);
        least = fmin(least, t->measured[i]);
        most = fmax(most, t->measured[i]);
    }
    fit->nrmse = most > least ? sqrt(sum / (double)t->n_value) / (most - least) : NAN;
    fit->rel_rms = rel_rms_of(t, s->here.value);
    fit->stated_rms = sqrt(stated / (double)t->n_value);
    fit->chi_square = p->has_se ? reduced_sum(s, fit->n_free, 0.0) : NAN;
}

size_t profile_fit_starts(const struct fit_option *option)
{
    if (option->n_start < PROFILE_LEAST_START) return PROFILE_LEAST_START;
    return option->n_start < MOST_START ? option->n_start : MOST_START;
}

size_t profile_fit_bytes(const struct fiber_profile *profile, size_t n_param, size_t n_start)
{
    return 2 * sizeof(double) * profile->n * profile->n_channel + n_start * profile_search_bytes(profile, n_param);
}

static status fit_target(struct profile_target *t, struct profile_fit *fit, struct error *err)
{
    struct starts *all = calloc(1, sizeof *all);
    size_t best = 0;
    if (all == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot fit a profile: out of memory");
    all->target = t;
    pthread_mutex_init(&all->lock, NULL);
    all->n = fit->n_start = profile_fit_starts(t->problem->option);
    status s = run_starts(all, fit, &best, err);
    struct profile_search *search = &all->search[best];
    const size_t before = search->n_evaluation;
    struct progress_part part = {t->problem->progress, share_of_starts, 1.0 - share_of_starts};
    search->pool = t->problem->pool;
    search->progress = progress_of_part(&part);
    if (s == STATUS_OK) s = refine(search, fit, err);
    if (s == STATUS_OK) {
        fit->n_evaluation += search->n_evaluation - before;
        put_residuals(search, fit);
        profile_error_put(search, fit);
        fit->value = search->here.value;
        search->here.value = NULL;
    }
    for (size_t k = 0; k < fit->n_start; k++) profile_search_end(&all->search[k]);
    pthread_mutex_destroy(&all->lock);
    free(all);
    return s;
}

status profile_fit_run(const struct profile_problem *problem, const char *table_name, struct profile_fit *fit,
                       struct error *err)
{
    struct profile_target t;
    const double start_s = clock_monotonic_s();
    *fit = (struct profile_fit){0};
    status s = target_init(&t, problem, table_name, &fit->n_free, err);
    fit->n_value = t.n_value;
    if (s == STATUS_OK) s = fit_target(&t, fit, err);
    target_release(&t);
    fit->wall_s = clock_monotonic_s() - start_s;
    return s;
}

void profile_fit_release(struct profile_fit *fit)
{
    free(fit->value);
    fit->value = NULL;
}
