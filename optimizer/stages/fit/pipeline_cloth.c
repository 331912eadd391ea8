#include "optimizer/stages/fit/pipeline_cloth.h"
#include "base/clock.h"
#include "base/option_id.h"
#include "geometry/cloth/cloth.h"
#include "geometry/fibers/shape/fiber_correct.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/options/option_key.h"
#include "optimizer/stages/fit/pipeline_fit_option.h"
#include "optimizer/stages/fit/pipeline_trace.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* BUDGET_FACTOR: multiplies the method's path budget where the job states none. LEAST_FITS: joint and final fit have at
 * least so many times the least paths of the method. */
enum { BUDGET_FACTOR = 3, SHORTENINGS = 8, SCREEN_ITERATIONS = 6, LEAST_FITS = 2 };
/* Shares of the paths, at most: of the screening, and of the final fit. */
static const double screen_share = 0.25, final_share = 0.4;
/* Paths that the final fit needs for each row, and the share that it has in any case: with many paths the numbers are
 * worth more of them than the parameters on a cloth that is known. Nor are cheap fits to more than MOST_CLOTHS worth
 * theirs, because cloths that are as good as these differ by less than their noise. */
static const double final_paths = 150000.0, least_final_share = 0.25;
enum { MOST_CLOTHS = 4 };

/* ---- the numbers ---- */

static void add_number(struct cloth_numbers *to, const struct cloth_number *from, size_t index)
{
    size_t k = to->n++;
    to->info[k] = (struct param_info){.name = from->name,
                                      .symbol = from->name,
                                      .kind = PARAM_SHAPE,
                                      .channel = -1,
                                      .lower = from->info->lower,
                                      .upper = from->info->upper,
                                      .start = from->value,
                                      .coordinate = from->info->coordinate,
                                      .meaning = from->info->meaning};
    to->range[k] = (struct fit_parameter){from->lower, from->upper, from->value, false};
    to->item[k] = (struct cloth_number_item){from->info->unit, index, from->prior_mean, from->prior_sd};
}

static status check_company(const struct job_inputs *in, struct error *err)
{
    for (size_t i = 0; i < in->n_model; i++)
        if (in->model[i].appearance.kind != MODEL_SURFACE)
            return error_set_field(err, STATUS_INVALID, OPTION_MODEL,
                                   "numbers of the cloth are fitted with models of fibers only: '%s' sees a volume",
                                   in->model[i].appearance.id);
    if (in->section.fit->fit_radius)
        return error_set_field(
            err, STATUS_INVALID, OPTION_FIT_RADIUS, "'%s' is not for a cloth with fitted numbers: fit the %s of '%s'",
            job_option_key(OPTION_FIT_RADIUS), in->section.cloth->description != NULL ? "fiber_radius_um" : "radius",
            job_option_key(in->section.cloth->description != NULL ? OPTION_CLOTH : OPTION_CORRECTION));
    return STATUS_OK;
}

/* Returns all numbers of the cloth: the numbers of its description, or its corrections. */
static const struct cloth_number *numbers_of(const struct job_cloth *cloth, size_t *n)
{
    const struct cloth_description *d = cloth->description;
    *n = d != NULL ? d->n_number : cloth->has_correction ? CORRECTION_N : 0;
    return d != NULL ? d->number : cloth->correction;
}

status cloth_numbers_read(struct job_inputs *in, struct error *err)
{
    size_t n_number;
    const struct cloth_number *list = numbers_of(in->section.cloth, &n_number);
    memset(&in->number, 0, sizeof in->number);
    for (size_t i = 0; i < n_number; i++) {
        if (!list[i].fitted) continue;
        if (in->number.n == CLOTH_MAX_FITTED)
            return error_set_field(err, STATUS_INVALID, OPTION_CLOTH, "at most %d numbers of a cloth can be fitted",
                                   CLOTH_MAX_FITTED);
        add_number(&in->number, &list[i], i);
    }
    return in->number.n > 0 ? check_company(in, err) : STATUS_OK;
}

/* ---- the unknowns ---- */

status pipeline_joint_init(const struct model_setup *m, const struct cloth_numbers *number, struct pipeline_joint *j,
                           struct error *err)
{
    size_t n = m->sets.info.n_param;
    memset(j, 0, sizeof *j);
    if (n + number->n > FIT_MAX_PARAM)
        return error_set(err, STATUS_TOO_LARGE,
                         "cannot fit %zu parameters and %zu numbers of the cloth: at most %d unknowns", n, number->n,
                         FIT_MAX_PARAM);
    j->n_scattering = n;
    j->info = m->sets.info;
    j->info.n_param = n + number->n;
    j->info.param = j->param;
    memcpy(j->param, m->sets.info.param, n * sizeof *j->param);
    memcpy(j->parameter, m->parameter, n * sizeof *j->parameter);
    memcpy(j->param + n, number->info, number->n * sizeof *j->param);
    memcpy(j->parameter + n, number->range, number->n * sizeof *j->parameter);
    pipeline_fit_option(m->option, m->sets.info.param, n, &j->option);
    for (size_t k = 0; k < number->n; k++) {
        j->option.prior_mean[n + k] = number->item[k].prior_mean;
        j->option.prior_se[n + k] = number->item[k].prior_sd;
    }
    return STATUS_OK;
}

/* Numbers that are fitted. */
static size_t n_free_number(const struct cloth_numbers *number)
{
    size_t n_free = 0;
    for (size_t k = 0; k < number->n; k++) n_free += !number->range[k].fixed;
    return n_free;
}

/* ---- one cloth after the other ---- */

/* Which cloth of given numbers is made. */
struct variant {
    bool final;      /* with the tile of the last fit */
    uint64_t places; /* added to the seed of the fibers' random places */
};

struct pipeline_cloth_trace {
    const struct cloth_job *job;
    struct made_cloth *made;
    size_t i_model;
    struct configuration *configuration;
    struct cloth_estimator cloth;
    struct estimator live;
    struct estimate_journal *journal;
    bool final;             /* the next cloths belong to a final fit */
    size_t n_built, i_next; /* the cloths of one iteration; the next of them to be replaced */
    struct built {
        double number[CLOTH_MAX_FITTED];
        struct variant variant;
        struct scene *scene;
    } built[CLOTH_MAX_MOVED + 1];
};

/* Makes the fibers of the described cloth at the values of all of its numbers. report: NULL if not wanted. */
static status build_tile(const struct cloth_job *job, const double *value, struct variant variant, struct fiber_set *f,
                         struct cloth_report *report, struct error *err)
{
    const struct progress progress = {.cancel = job->tools->progress.cancel};
    struct cloth_description *d = malloc(sizeof *d);
    if (d == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make the cloth: out of memory");
    status s = cloth_description_enlarge(job->cloth->description, variant.final ? job->cloth->final_tiles : 1, d, err);
    if (s == STATUS_OK) {
        d->seed += variant.places;
        s = cloth_build(d, value, job->tools->pool, &progress, f, report, err);
    }
    free(d);
    return s;
}

/* Makes the fibers at given values of the fitted numbers. Where these contradict each other (a crimp that yarns cannot
 * follow), the nearest of a few cloths on the line to the start values takes their place, so that a search that meets
 * such a cloth goes on. */
static status make_fibers(const struct cloth_job *job, const struct made_cloth *made, const double *number,
                          struct variant variant, double value[CLOTH_MAX_NUMBER], struct fiber_set *f,
                          struct cloth_report *report, struct error *err)
{
    size_t n_number;
    const struct cloth_number *list = numbers_of(job->cloth, &n_number);
    status s = STATUS_OK;
    for (int k = 0; k <= SHORTENINGS; k++) {
        double share = 1.0 - (double)k / SHORTENINGS;
        for (size_t i = 0; i < n_number; i++) value[i] = list[i].value;
        for (size_t i = 0; i < made->number.n; i++) {
            double start = made->number.range[i].start;
            value[made->number.item[i].index] = k == 0 ? number[i] : start + share * (number[i] - start);
        }
        s = job->cloth->description != NULL ? build_tile(job, value, variant, f, report, err)
                                            : fiber_correct(&made->uncorrected, value, f, err);
        if (s != STATUS_INVALID) return s;
    }
    return s;
}

/* The cloth that an estimate sees. Where places are renewed, each replica of each iteration of the joint fit has places
 * of its own, so that the scatter of a tile is independent between the replicas, whose products make the objective. All
 * cloths of one replica share theirs, so that their differences do not hold it. */
static struct variant variant_of(const struct pipeline_cloth_trace *t, const struct estimator_call *call)
{
    struct variant v = {.final = t->final};
    if (t->job->cloth->description != NULL && t->job->cloth->renew_places && t->cloth.number_derivatives)
        v.places = 2 * (uint64_t)call->iteration + (call->replica == REPLICA_FIT_B ? 2 : 1);
    return v;
}

/* Finds or builds the scene of a cloth. Unless places are renewed, both replicas of an iteration ask for the same. */
static status scene_of(struct pipeline_cloth_trace *t, const double *number, struct variant variant,
                       const struct scene **scene, struct error *err)
{
    struct fiber_set fiber;
    const size_t n_bytes = t->made->number.n * sizeof *number;
    for (size_t i = 0; i < t->n_built; i++)
        if (t->built[i].scene != NULL && t->built[i].variant.final == variant.final &&
            t->built[i].variant.places == variant.places && memcmp(number, t->built[i].number, n_bytes) == 0) {
            *scene = t->built[i].scene;
            return STATUS_OK;
        }
    struct built *to = &t->built[t->i_next];
    t->i_next = (t->i_next + 1) % t->n_built;
    scene_free(to->scene);
    to->scene = NULL;
    fiber_set_init(&fiber);
    double value[CLOTH_MAX_NUMBER];
    status s = make_fibers(t->job, t->made, number, variant, value, &fiber, NULL, err);
    if (s == STATUS_OK) s = made_cloth_fiber_scene(t->job, t->i_model, &fiber, &to->scene, err);
    fiber_set_release(&fiber);
    memcpy(to->number, number, n_bytes);
    to->variant = variant;
    *scene = to->scene;
    return s;
}

static status estimate(void *context, const double *number, const struct estimator_call *call,
                       const struct progress *progress, struct estimate *out, double *wall_s, struct error *err)
{
    struct pipeline_cloth_trace *t = context;
    double start_s = clock_monotonic_s();
    struct trace_estimator live;
    const struct scene *scene = NULL;
    status s = scene_of(t, number, variant_of(t, call), &scene, err);
    if (s != STATUS_OK) return s;
    pipeline_trace_request(&live, t->job, t->made, t->i_model, t->configuration, t->cloth.n_configuration);
    live.request.input.scene = (struct appearance_scene){.fibers = scene};
    struct estimator e = trace_estimator(&live);
    s = e.run(e.context, call, progress, out, wall_s, err);
    *wall_s = clock_monotonic_s() - start_s;
    return s;
}

static void set_final(void *context, bool final) { ((struct pipeline_cloth_trace *)context)->final = final; }

status pipeline_cloth_open(const struct cloth_job *job, struct made_cloth *made, size_t i_model,
                           const struct pipeline_joint *j, struct pipeline_cloth_trace **trace,
                           struct estimate_journal **journal, struct error *err)
{
    struct pipeline_cloth_trace *t = calloc(1, sizeof *t);
    *trace = t;
    if (t == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot fit a cloth: out of memory");
    t->job = job;
    t->made = made;
    t->i_model = i_model;
    t->configuration = trace_configurations(&job->rows->row);
    if (t->configuration == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot fit a cloth: out of memory");
    const struct cloth_source source = {t, made->number.n, estimate, set_final};
    status s = cloth_estimator_init(&t->cloth, &source, j->n_scattering, job->rows->row.n, j->param + j->n_scattering,
                                    j->parameter + j->n_scattering, err);
    if (s != STATUS_OK) return s;
    t->n_built = 1 + cloth_estimator_n_moved(t->cloth.moves, n_free_number(&made->number));
    t->live = cloth_estimator(&t->cloth);
    s = pipeline_trace_journal(job, made, "fit", "estimates.journal", i_model, &t->live, &t->journal, err);
    *journal = t->journal;
    return s;
}

void pipeline_cloth_close(struct pipeline_cloth_trace *t)
{
    if (t == NULL) return;
    estimate_journal_close(t->journal);
    cloth_estimator_release(&t->cloth);
    for (size_t i = 0; i < t->n_built; i++) scene_free(t->built[i].scene);
    free(t->configuration);
    free(t);
}

/* ---- the search ---- */

uint64_t pipeline_cloth_least_budget(const struct cloth_numbers *number, uint64_t least, size_t n_start, size_t n_extra)
{
    double n_screen = n_extra > 0 ? 1.0 + (double)n_extra : 0.0, n_final = n_extra > 0 ? 2.0 : 1.0;
    size_t n_free = n_free_number(number);
    /* a moved cloth takes a block of paths at least, a quarter of the paths of the cloth itself */
    double moved = 0.25 * (double)cloth_estimator_n_moved(CLOTH_MOVES_BALANCED, n_free);
    double joint = LEAST_FITS * fmax(1.0 + moved, cloth_estimator_cost(CLOTH_MOVES_BALANCED, n_free));
    double later = n_extra > 0 ? 1.0 : 0.0; /* cloths that a search after the first one screens */
    double fits = (double)n_start * (joint + LEAST_FITS * n_final);
    return (uint64_t)((2.0 * SCREEN_ITERATIONS * (n_screen + later * ((double)n_start - 1.0)) + fits) * (double)least);
}

/* Divides the paths of one search between screening, joint fit and final fit. Several starts share a budget that the
 * job states. Extra starts are screened however small the budget is. */
static void plan_budget(uint64_t path_budget, const struct cloth_numbers *number, const struct descent_method *method,
                        struct fit_problem *problem, struct cloth_search *q)
{
    double least = (double)method->least_budget(problem), n_row = (double)problem->observation->n;
    double whole = (double)(path_budget > 0 ? path_budget / q->option->n_start
                                            : BUDGET_FACTOR * method->info->default_path_budget);
    double n_extra = (double)q->option->n_extra_start, least_screen = n_extra > 0.0 ? 1.0 + n_extra : 0.0;
    double per_cloth = SCREEN_ITERATIONS * least, most = fmin(MOST_CLOTHS + n_extra, CLOTH_MAX_SCREEN);
    double n_screen = fmax(least_screen, floor(fmin(most, screen_share * whole / per_cloth)));
    q->n_screen = (size_t)n_screen;
    q->screen_budget = (uint64_t)(2.0 * per_cloth);
    double final = fmin(final_share * whole, fmax(least_final_share * whole, final_paths * n_row));
    q->final_budget = (uint64_t)fmax(final, LEAST_FITS * least);
    const double cost = cloth_estimator_cost(q->cloth->moves, n_free_number(number)), least_joint = LEAST_FITS * least;
    double both = fmax(whole - final, least_joint * cost); /* of screening and joint fit */
    q->screen_expected = (uint64_t)fmin((double)q->n_screen * per_cloth, both - least_joint * cost);
    q->least_joint_budget = (uint64_t)least_joint;
    problem->path_budget = (uint64_t)((both - (double)q->screen_expected) / cost);
    q->screen_share = 0.25;
    q->final_share = 0.35;
}

static void log_cloth(struct log *log, const struct cloth_numbers *number, const struct model_setup *m,
                      const struct model_fit *fit)
{
    const struct fit_result *r = &fit->cloth.joint;
    size_t n = m->sets.info.n_param;
    for (size_t k = 0; k < number->n; k++)
        log_info(log, "cloth: %s %.4g +- %.2g%s%s", number->info[k].name, fit->cloth.number[k],
                 r->uncertainty.se_param[n + k], r->uncertainty.determined[n + k] ? "" : ", not determined",
                 r->uncertainty.at_bound[n + k] ? ", at its bound" : "");
}

status pipeline_cloth_fit(struct pipeline_cloth_trace *trace, const struct pipeline_joint *j,
                          const struct fit_problem *problem, struct model_fit *fit, struct error *err)
{
    struct fit_problem joint = *problem;
    struct estimator e = estimate_journal_estimator(trace->journal);
    struct cloth_search q = {.method = descent_find(trace->job->fit->method),
                             .problem = &joint,
                             .option = &j->option,
                             .cloth = &trace->cloth};
    joint.estimator = &e;
    plan_budget(trace->job->fit->path_budget, &trace->made->number, q.method, &joint, &q);
    status s = cloth_search_run(&q, &fit->cloth, err);
    if (s != STATUS_OK) return s;
    cloth_search_marginal(&q, &fit->cloth, &fit->result);
    log_cloth(trace->job->tools->log, &trace->made->number, &trace->job->model[trace->i_model], fit);
    return STATUS_OK;
}

/* Warns where the cloth of the fitted numbers cannot be and another one takes its place. */
static void warn_of_contradiction(struct worker_status *st, const struct made_cloth *made, const struct model_fit *fit)
{
    for (size_t k = 0; k < made->number.n; k++) {
        double built = made->shown[made->number.item[k].index];
        if (built == fit->cloth.number[k]) continue;
        worker_status_warn(st,
                           "the fitted numbers of the cloth contradict each other: '%s' came to %.4g, and the nearest "
                           "cloth that can be made, with %.4g, was rendered; narrow the bounds",
                           made->number.info[k].name, fit->cloth.number[k], built);
        return;
    }
}

status pipeline_cloth_use(const struct cloth_job *job, const struct model_fit *fit, size_t i_model,
                          struct made_cloth *made, struct error *err)
{
    if (made->number.n == 0 || made->i_shown == i_model + 1) return STATUS_OK;
    status s = make_fibers(job, made, fit->cloth.number, (struct variant){.final = true}, made->shown, &made->fiber,
                           &made->report, err);
    if (s == STATUS_OK) s = made_cloth_make_scene(job, made, err);
    if (s == STATUS_OK) made->geometry.total_length_m = fiber_set_length_m(&made->fiber);
    if (s == STATUS_OK) warn_of_contradiction(job->tools->status, made, fit);
    made->i_shown = s == STATUS_OK ? i_model + 1 : 0;
    return s;
}
