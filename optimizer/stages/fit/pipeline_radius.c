#include "optimizer/stages/fit/pipeline_radius.h"
#include "base/catalogue/method_catalogue.h"
#include "base/option_id.h"
#include "optimizer/fit/descent/fit_run.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/options/option_key.h"
#include "optimizer/stages/fit/pipeline_fit_option.h"
#include "optimizer/stages/fit/pipeline_trace.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FIRST_POINTS = 5, MOST_POINTS = 11 };

static const double um = 1e-6, tolerance = 0.01;
/* Share of the fit's path budget for the fit at each radius, and the least number of paths per row, without which
 * there would be no second iteration. */
static const double budget_share = 0.12, least_paths_a_row = 21000.0;

struct search {
    const struct fit_input *in;
    struct fitted_radius *radius;
    struct worker_series *series;
    struct fiber_set original; /* the cloth before the search */
    size_t n_done;
    double u[NOISY_MAX_POINT], param[NOISY_MAX_POINT][FIT_MAX_PARAM];
};

static double mean_radius_m(const struct fiber_set *f)
{
    double sum = 0.0;
    for (size_t i = 0; i < f->n_fiber; i++) sum += (double)f->radius_m[i];
    return sum / (double)f->n_fiber;
}

/* Gives f the radii of `from`, which has the same fibers (or is f itself), times a factor. */
static void scale_radii(struct fiber_set *f, const struct fiber_set *from, double factor)
{
    for (size_t i = 0; i < f->n_fiber; i++) {
        const size_t first = f->first_vertex[i], n = f->first_vertex[i + 1] - first;
        f->radius_m[i] = from->radius_m[i];
        if (f->shape != NULL && from != f) memcpy(f->shape + first, from->shape + first, n * sizeof *f->shape);
        fiber_set_scale_radius(f, i, factor);
    }
}

/* Starts each fit at the result of the one at the nearest radius. */
static void set_starts(const struct search *q, double u, struct fit_parameter *parameter)
{
    size_t nearest = 0;
    for (size_t k = 1; k < q->n_done; k++)
        if (fabs(q->u[k] - u) < fabs(q->u[nearest] - u)) nearest = k;
    const struct model_setup *m = &q->in->job->model[q->radius->i_model];
    for (size_t p = 0; p < m->sets.info.n_param; p++) {
        parameter[p] = m->parameter[p];
        if (q->n_done > 0 && !parameter[p].fixed)
            parameter[p].start = fmin(fmax(q->param[nearest][p], parameter[p].lower), parameter[p].upper);
    }
}

static status run_fit(struct search *q, double u, const struct estimator *e, const struct progress *progress,
                      struct fit_result *r, struct error *err)
{
    const struct cloth_job *job = q->in->job;
    const struct model_setup *m = &job->model[q->radius->i_model];
    const struct descent_method *method = descent_find(method_gauss_newton.id);
    uint64_t budget = job->fit->path_budget > 0 ? job->fit->path_budget : method->info->default_path_budget;
    double paths = fmax(budget_share * (double)budget, least_paths_a_row * (double)job->rows->fitted.n);
    struct fit_parameter parameter[FIT_MAX_PARAM];
    struct fit_option option;
    set_starts(q, u, parameter);
    pipeline_fit_option(m->option, m->sets.info.param, m->sets.info.n_param, &option);
    option.n_start = 1;
    const struct fit_problem problem = {.n_param = m->sets.info.n_param,
                                        .info = m->sets.info.param,
                                        .parameter = parameter,
                                        .observation = &job->rows->fitted,
                                        .estimator = e,
                                        .path_budget = (uint64_t)paths,
                                        .progress = progress};
    return fit_run(method, &problem, &option, r, err);
}

/* Writes one record of the series for a radius. */
static status report(struct search *q, const struct fit_result *r, double radius_m, bool replayed, struct error *err)
{
    const struct stage_tools *tools = q->in->job->tools;
    const struct model_setup *m = &q->in->job->model[q->radius->i_model];
    char note[80];
    snprintf(note, sizeof note, "radius %.4g um", radius_m / um);
    const struct fit_step step = {.step = q->n_done,
                                  .phase = "radius",
                                  .wall_s = q->radius->wall_s,
                                  .n_path = r->n_path,
                                  .n_path_total = q->radius->n_path,
                                  .objective = r->objective,
                                  .n_param = m->sets.info.n_param,
                                  .param = r->param,
                                  .param_se = r->uncertainty.se_param,
                                  .note = note};
    const struct worker_series_model model = {&m->sets.info, m->parameter, q->radius->i_model, 0};
    worker_status_objective(tools->status, step.step, r->objective.value, r->objective.se);
    if (replayed)
        worker_status_restart_eta(tools->status);
    else
        log_info(tools->log, "radius %.4g um: objective %.5g +- %.2g after %zu steps", radius_m / um,
                 r->objective.value, r->objective.se, r->n_step);
    return worker_series_add(q->series, &step, &model, replayed, err);
}

static status evaluate(void *context, double u, double *f, double *se, struct error *err)
{
    struct search *q = context;
    const struct cloth_job *job = q->in->job;
    struct made_cloth *made = q->in->made;
    struct pipeline_trace trace = {0};
    struct progress_part part;
    double share = PIPELINE_RADIUS_SHARE / MOST_POINTS;
    struct progress progress = progress_begin_part(&part, &job->tools->progress, share * (double)q->n_done, share);
    struct estimator estimator;
    struct fit_result r;
    char name[64], message[100];
    snprintf(name, sizeof name, "radius-%02zu.journal", q->n_done);
    snprintf(message, sizeof message, "fiber radius: trying %.4g um", exp(u) / um);
    worker_status_message(job->tools->status, message);
    scale_radii(&made->fiber, &q->original, exp(u) / q->radius->start_m);
    status s = made_cloth_make_surface_scene(job, made, err);
    if (s != STATUS_OK) return s;
    s = pipeline_trace_open(&trace, job, made, "fit", name, q->radius->i_model, &job->rows->fitted, err);
    if (s != STATUS_OK) goto out;
    estimator = estimate_journal_estimator(trace.journal);
    s = run_fit(q, u, &estimator, &progress, &r, err);
    if (s != STATUS_OK) goto out;
    q->radius->n_path += r.n_path;
    q->radius->wall_s += r.wall_s;
    s = report(q, &r, exp(u), estimate_journal_replaying(trace.journal), err);
    *f = r.objective.value + r.prior_penalty;
    *se = fmax(r.objective.se, 1e-12);
    q->u[q->n_done] = u;
    memcpy(q->param[q->n_done++], r.param, sizeof r.param);
out:
    pipeline_trace_close(&trace);
    return s;
}

/* Computes the radius and its error from the minimum of the curve. */
static void conclude(const struct cloth_job *job, struct fitted_radius *r)
{
    const struct model_setup *m = &job->model[r->i_model];
    double n_free = 1.0 + (double)model_setup_n_free(m), n_row = 3.0 * (double)job->rows->fitted.n;
    double s2 =
        fmax(fmax(r->curve.f, 0.0) / fmax(1.0, n_row - n_free), objective_mean_photograph_variance(&job->rows->fitted));
    double var = r->curve.u_se * r->curve.u_se + (r->curve.curvature > 0.0 ? 2.0 * s2 / r->curve.curvature : INFINITY);
    double range = log(r->upper_m / r->lower_m);
    r->curve.determined = r->curve.determined && sqrt(var) < 0.5 * range / sqrt(12.0);
    r->radius_m = pipeline_radius_used(r) ? exp(r->curve.u) : r->start_m;
    r->se_m = fmin(exp(r->curve.u) * sqrt(var), (r->upper_m - r->lower_m) / sqrt(12.0));
}

static void report_radius(const struct stage_tools *tools, const struct fitted_radius *r)
{
    log_info(tools->log, "fiber radius %.4g +- %.2g um (%s), it was %.4g um", r->radius_m / um, r->se_m / um,
             r->curve.determined ? "determined" : "not determined", r->start_m / um);
    if (r->curve.determined) return;
    if (r->curve.at_bound)
        worker_status_warn(tools->status,
                           "the fiber radius ends at the edge of its range, %.4g um (%s: %.4g to %.4g um)",
                           r->radius_m / um, job_option_key(OPTION_FIT_RADIUS), r->lower_m / um, r->upper_m / um);
    else
        worker_status_warn(tools->status,
                           "the fiber radius is not determined by these photographs: %.4g um is kept as it was",
                           r->start_m / um);
}

bool pipeline_radius_used(const struct fitted_radius *r) { return r->curve.determined || r->curve.at_bound; }

static status use_radius(const struct fit_input *in, const struct fitted_radius *r, const struct fiber_set *from,
                         struct error *err)
{
    scale_radii(&in->made->fiber, from, r->radius_m / r->start_m);
    return made_cloth_make_scene(in->job, in->made, err);
}

static status check_range(const struct job_fit *fit, const double tile_size_m[2], struct fitted_radius *r,
                          struct error *err)
{
    r->lower_m = isnan(fit->radius_lower_um) ? 0.5 * r->start_m : fit->radius_lower_um * um;
    r->upper_m = isnan(fit->radius_upper_um) ? 2.0 * r->start_m : fit->radius_upper_um * um;
    if (r->upper_m < 1.1 * r->lower_m) /* one bound was given and lies beyond the default of the other */
        return error_set_field(err, STATUS_INVALID, OPTION_FIT_RADIUS,
                               "'%s' leaves no range to search: %.4g to %.4g um; the cloth's fibers have %.4g um",
                               job_option_key(OPTION_FIT_RADIUS), r->lower_m / um, r->upper_m / um, r->start_m / um);
    double tile_m = fmin(tile_size_m[0], tile_size_m[1]);
    if (r->upper_m > 0.25 * tile_m)
        return error_set_field(err, STATUS_INVALID, OPTION_FIT_RADIUS_UPPER,
                               "'%s' is %.4g: fibers of that radius are wider than half of the tile (%.4g um)",
                               job_option_key(OPTION_FIT_RADIUS_UPPER), r->upper_m / um, tile_m / um);
    return STATUS_OK;
}

/* Warns before the search, which takes long, that the range the user asked for does not contain the cloth's own
 * radius. */
static void warn_of_range(const struct stage_tools *tools, const struct fitted_radius *r)
{
    if (r->start_m >= r->lower_m && r->start_m <= r->upper_m) return;
    worker_status_warn(
        tools->status,
        "'%s' searches %.4g to %.4g um, but the cloth's own fibers have a mean radius of %.4g um, which is not in this "
        "range",
        job_option_key(OPTION_FIT_RADIUS), r->lower_m / um, r->upper_m / um, r->start_m / um);
}

status pipeline_radius_search(const struct fit_input *in, struct worker_series *series, struct fitted_radius *radius,
                              struct error *err)
{
    struct search q = {.in = in, .radius = radius, .series = series};
    memset(radius, 0, sizeof *radius);
    radius->start_m = mean_radius_m(&in->made->fiber);
    while (in->job->model[radius->i_model].appearance.kind != MODEL_SURFACE) radius->i_model++;
    status s = check_range(in->job->fit, in->made->fiber.tile_size_m, radius, err);
    if (s != STATUS_OK) return s;
    warn_of_range(in->job->tools, radius);
    fiber_set_init(&q.original);
    s = fiber_set_copy(&in->made->fiber, &q.original, err);
    if (s != STATUS_OK) goto out;
    const struct noisy_minimum_option option = {.lower = log(radius->lower_m),
                                                .upper = log(radius->upper_m),
                                                .n_first = FIRST_POINTS,
                                                .n_most = MOST_POINTS,
                                                .tolerance = tolerance};
    s = noisy_minimum_search(&option, evaluate, &q, &radius->curve, err);
    radius->n_step = q.n_done;
    if (s == STATUS_OK) {
        conclude(in->job, radius);
        report_radius(in->job->tools, radius);
        s = use_radius(in, radius, &q.original, err);
    }
out:
    fiber_set_release(&q.original);
    return s;
}

status pipeline_radius_apply(const struct fit_input *in, const struct fitted_radius *radius, struct error *err)
{
    warn_of_range(in->job->tools, radius);
    report_radius(in->job->tools, radius);
    return use_radius(in, radius, &in->made->fiber, err);
}
