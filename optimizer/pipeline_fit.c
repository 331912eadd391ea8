/* Stages "fit" and "validation": the path tracer behind a journal, a method of descent, and fresh estimates at its
 * result. */
#include "optimizer/descent/estimate_journal.h"
#include "optimizer/descent/trace_estimator.h"
#include "optimizer/pipeline_context.h"
#include "optimizer/work_file.h"
#include "optimizer/worker_series.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

enum {
    VALIDATION_PILOT = 8192,
    VALIDATION_LEAST = 1024,
    VALIDATION_BLOCK = 256,
    VALIDATION_MAX = 1 << 20,
    FIT_RESULT_SECTION = 1
};

/* Standard error of a validated mean relative to the row's brightness, and the paths that may be spent on all rows for
 * it, as a share of those of the fit. */
/* Budget: a share of the fit's paths, but enough for a fair judgement where the fit needed few. */
static const double validation_rel_se = 0.005, validation_share = 0.7, validation_least_paths = 4e6;

/* ---- the path tracer as an estimator, shared by both stages ---- */

/* configuration: owned by t (free it). */
static status trace_init(struct trace_estimator *t, const struct pipeline_context *c, const struct appearance *model,
                         const struct observation_set *o, struct error *err)
{
    *t = (struct trace_estimator){.model = model,
                                  .scene = {.fibers = c->scene},
                                  .pool = c->pool,
                                  .seed = c->doc->seed,
                                  .configuration = trace_configurations(o),
                                  .n_configuration = o->n};
    return t->configuration != NULL ? STATUS_OK
                                    : error_set(err, STATUS_NO_MEMORY, "cannot start the path tracer: out of memory");
}

static status may_write(void *context, struct error *err)
{
    const struct pipeline_context *c = context;
    return worker_folder_check(c->folder, err);
}

/* Of everything that estimates depend on beside the call. */
static uint64_t fit_fingerprint(const struct pipeline_context *c)
{
    const struct fiber_set *f = &c->fiber;
    uint32_t sum = (uint32_t)crc32_z(0, (const void *)f->position_m, 3 * f->n_vertex * sizeof *f->position_m);
    sum = (uint32_t)crc32_z(sum, (const void *)f->radius_m, f->n_fiber * sizeof *f->radius_m);
    for (size_t i = 0; i < c->observation.n; i++) {
        sum = (uint32_t)crc32_z(sum, (const void *)c->observation.item[i].mean_rgb,
                                sizeof c->observation.item[i].mean_rgb);
        sum = (uint32_t)crc32_z(sum, (const void *)&c->observation.item[i].configuration, sizeof(struct configuration));
    }
    return c->fingerprint << 32 | sum;
}

/* ---- fit ---- */

struct fit_listener {
    struct pipeline_context *pipeline;
    struct worker_series *series;
    struct estimate_journal *journal;
};

static status on_step(void *context, const struct fit_step *step, struct error *err)
{
    struct fit_listener *l = context;
    struct pipeline_context *c = l->pipeline;
    bool replayed = estimate_journal_replaying(l->journal);
    worker_status_objective(c->status, step->step, step->objective.value, step->objective.se);
    if (replayed)
        worker_status_restart_eta(c->status);
    else
        log_info(c->log, "step %zu (%s): objective %.5g +- %.2g, relative RMS error %.3f, %.0f thousand paths in all",
                 step->step, step->phase, step->objective.value, step->objective.se, step->objective.rel_rms,
                 (double)step->n_path_total / 1e3);
    return worker_series_add(l->series, step, c->model->param, replayed, err);
}

static status run_method(struct pipeline_context *c, const struct estimator *estimator, struct fit_listener *listener,
                         struct error *err)
{
    const struct descent_method *method = descent_find(c->doc->method);
    if (method == NULL)
        return error_set_field(err, STATUS_INVALID, "fit.method", "unknown method '%s'", c->doc->method);
    struct fit_problem problem = {.n_param = c->model->n_param,
                                  .info = c->model->param,
                                  .param = c->parameter,
                                  .observation = &c->fitted,
                                  .estimator = estimator,
                                  .path_budget = c->doc->path_budget,
                                  .max_iteration = c->doc->max_iteration,
                                  .report = on_step,
                                  .report_context = listener,
                                  .progress = &c->progress};
    return method->run(&problem, &c->fit, err);
}

static status store_fit(struct pipeline_context *c, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    struct work_section section[] = {{&c->fit, sizeof c->fit}};
    status s = pipeline_work_path(c, "fit", "result.bin", path, err);
    if (s == STATUS_OK) s = worker_folder_check(c->folder, err);
    return s == STATUS_OK ? work_file_write(path, "fit.1", section, FIT_RESULT_SECTION, err) : s;
}

status stage_fit_load(struct pipeline_context *c, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    struct work_section section[] = {{&c->fit, sizeof c->fit}};
    status s = pipeline_work_path(c, "fit", "result.bin", path, err);
    return s == STATUS_OK ? work_file_read(path, "fit.1", section, FIT_RESULT_SECTION, err) : s;
}

status stage_fit(struct pipeline_context *c, struct error *err)
{
    struct appearance model;
    struct trace_estimator trace = {0};
    struct fit_listener listener = {.pipeline = c};
    char path[WORKER_PATH_BYTES];
    struct estimator live, estimator;
    appearance_from_surface(c->model, &model);
    status s = trace_init(&trace, c, &model, &c->fitted, err);
    if (s == STATUS_OK) s = pipeline_work_path(c, "fit", "estimates.journal", path, err);
    if (s != STATUS_OK) goto out;
    live = trace_estimator(&trace);
    s = estimate_journal_open(path, fit_fingerprint(c), &live, may_write, c, &listener.journal, err);
    if (s == STATUS_OK) s = worker_series_open(c->folder, &listener.series, err);
    if (s != STATUS_OK) goto out;
    estimator = estimate_journal_estimator(listener.journal);
    s = run_method(c, &estimator, &listener, err);
    if (s != STATUS_OK) goto out;
    if (estimate_journal_n_replayed(listener.journal) > 0)
        log_info(c->log, "%zu estimates came from the checkpoint", estimate_journal_n_replayed(listener.journal));
    log_info(c->log, "fit %s after %zu steps, %.3g paths, %.1f s: %s",
             c->fit.converged ? "converged" : "did NOT converge", c->fit.n_step, (double)c->fit.n_path, c->fit.wall_s,
             c->fit.reason);
    if (!c->fit.converged) {
        char warning[400];
        snprintf(warning, sizeof warning, "the fit has not converged: %s", c->fit.reason);
        worker_status_warn(c->status, warning);
    }
    s = store_fit(c, err);
out:
    worker_series_close(listener.series);
    estimate_journal_close(listener.journal);
    free((void *)(uintptr_t)trace.configuration);
    return s;
}

/* ---- validation ---- */

static double brightness(const struct observation *o)
{
    return fmax((o->mean_rgb[0] + o->mean_rgb[1] + o->mean_rgb[2]) / 3.0, OBJECTIVE_TAU);
}

/* Relative variance of one path, from a pilot run. */
static double relative_path_variance(const struct observation *o, const struct estimate *pilot)
{
    double a = brightness(o), largest = 0.0;
    for (int c = 0; c < 3; c++) largest = fmax(largest, pilot->var[c]);
    return (double)pilot->n_path * largest / (a * a);
}

/* Paths a replica, so that both together reach the standard error asked for; all rows give way alike when the budget is
 * short. */
static void plan_validation(const struct pipeline_context *c, const struct estimate *pilot, size_t *n_path)
{
    double total = 0.0;
    for (size_t i = 0; i < c->observation.n; i++)
        total += relative_path_variance(&c->observation.item[i], &pilot[i]) / (validation_rel_se * validation_rel_se);
    double least = c->doc->path_budget > 0 ? fmin(validation_least_paths, (double)c->doc->path_budget) : validation_least_paths;
    double budget = fmax(validation_share * (double)c->fit.n_path, least);
    double shrink = fmin(1.0, budget / fmax(total, 1.0));
    for (size_t i = 0; i < c->observation.n; i++) {
        double n = 0.5 * shrink * relative_path_variance(&c->observation.item[i], &pilot[i]) /
                   (validation_rel_se * validation_rel_se);
        n = fmin(fmax(n, (double)pilot[i].n_path), VALIDATION_MAX);
        n_path[i] = (size_t)ceil(n / VALIDATION_BLOCK) * VALIDATION_BLOCK;
    }
}

static void evaluate_set(const struct pipeline_context *c, enum job_set set, struct objective_value *value)
{
    struct observation_set part;
    size_t n = c->observation.n, n_part = 0;
    struct estimate *a = malloc(2 * n * sizeof *a), *b = a != NULL ? a + n : NULL;
    observation_set_init(&part);
    *value = (struct objective_value){NAN, NAN, NAN};
    if (a != NULL && observation_set_select(&c->observation, set, &part, NULL) == STATUS_OK && part.n > 0) {
        for (size_t i = 0; i < n; i++) {
            if (c->observation.item[i].set != set) continue;
            a[n_part] = c->validation.replica[0][i];
            b[n_part++] = c->validation.replica[1][i];
        }
        objective_evaluate(&part, a, b, value);
    }
    observation_set_release(&part);
    free(a);
}

static void score_validation(struct pipeline_context *c)
{
    struct validation *v = &c->validation;
    evaluate_set(c, JOB_SET_FIT, &v->fit);
    evaluate_set(c, JOB_SET_HELD_OUT, &v->held_out);
    v->worst_rel_se = 0.0;
    for (size_t i = 0; i < c->observation.n; i++)
        for (int k = 0; k < 3; k++)
            v->worst_rel_se = fmax(v->worst_rel_se, 0.5 * sqrt(v->replica[0][i].var[k] + v->replica[1][i].var[k]) /
                                                        brightness(&c->observation.item[i]));
}

static status allocate_validation(struct pipeline_context *c, struct error *err)
{
    for (int q = 0; q < 2; q++) {
        free(c->validation.replica[q]);
        c->validation.replica[q] = calloc(c->observation.n, sizeof(struct estimate));
        if (c->validation.replica[q] == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot validate: out of memory");
    }
    return STATUS_OK;
}

struct part_progress {
    const struct progress *whole;
    double base, share;
};

static void report_part(void *context, double fraction)
{
    const struct part_progress *p = context;
    progress_report(p->whole, p->base + p->share * fraction);
}

/* Pilot, then two replicas, each through a journal: an interrupted validation does not start over. */
static status estimate_validation(struct pipeline_context *c, const struct estimator *e, size_t *n_path,
                                  struct error *err)
{
    struct part_progress part = {&c->progress, 0.0, 0.1};
    struct progress progress = {report_part, &part, c->progress.cancel};
    struct estimator_call call = {c->fit.param, n_path, 0, REPLICA_FINAL_A, false};
    double wall_s;
    double pilot = 0.05 * (double)c->fit.n_path / (double)c->observation.n;
    for (size_t i = 0; i < c->observation.n; i++)
        n_path[i] = (size_t)fmin(fmax(pilot, VALIDATION_LEAST), VALIDATION_PILOT);
    status s = e->run(e->context, &call, &progress, c->validation.replica[0], &wall_s, err);
    if (s != STATUS_OK) return s;
    plan_validation(c, c->validation.replica[0], n_path);
    for (uint32_t q = 0; q < 2 && s == STATUS_OK; q++) {
        part = (struct part_progress){&c->progress, 0.1 + 0.45 * q, 0.45};
        call.iteration = 1;
        call.replica = q == 0 ? REPLICA_FINAL_A : REPLICA_FINAL_B;
        s = e->run(e->context, &call, &progress, c->validation.replica[q], &wall_s, err);
    }
    return s;
}

static status store_validation(struct pipeline_context *c, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    size_t n = c->observation.n * sizeof(struct estimate);
    struct work_section section[] = {{c->validation.replica[0], n}, {c->validation.replica[1], n}};
    status s = pipeline_work_path(c, "validation", "estimates.bin", path, err);
    if (s == STATUS_OK) s = worker_folder_check(c->folder, err);
    return s == STATUS_OK ? work_file_write(path, "validation.1", section, 2, err) : s;
}

status stage_validation_load(struct pipeline_context *c, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    size_t n = c->observation.n * sizeof(struct estimate);
    status s = allocate_validation(c, err);
    if (s == STATUS_OK) s = pipeline_work_path(c, "validation", "estimates.bin", path, err);
    if (s != STATUS_OK) return s;
    struct work_section section[] = {{c->validation.replica[0], n}, {c->validation.replica[1], n}};
    s = work_file_read(path, "validation.1", section, 2, err);
    if (s == STATUS_OK) score_validation(c);
    return s;
}

status stage_validation(struct pipeline_context *c, struct error *err)
{
    struct appearance model;
    struct trace_estimator trace = {0};
    struct estimate_journal *journal = NULL;
    struct estimator live, estimator;
    char path[WORKER_PATH_BYTES];
    size_t *n_path = calloc(c->observation.n, sizeof *n_path);
    status s = n_path != NULL ? allocate_validation(c, err)
                              : error_set(err, STATUS_NO_MEMORY, "cannot validate: out of memory");
    appearance_from_surface(c->model, &model);
    if (s == STATUS_OK) s = trace_init(&trace, c, &model, &c->observation, err);
    if (s == STATUS_OK) s = pipeline_work_path(c, "validation", "estimates.journal", path, err);
    if (s != STATUS_OK) goto out;
    live = trace_estimator(&trace);
    s = estimate_journal_open(path, fit_fingerprint(c), &live, may_write, c, &journal, err);
    if (s != STATUS_OK) goto out;
    estimator = estimate_journal_estimator(journal);
    s = estimate_validation(c, &estimator, n_path, err);
    if (s != STATUS_OK) goto out;
    score_validation(c);
    log_info(c->log,
             "validation: relative RMS error %.4f over the fitted rows, %.4f over the held-out rows; rendered means "
             "have a standard error below %.2f %%",
             c->validation.fit.rel_rms, c->validation.held_out.rel_rms, 100.0 * c->validation.worst_rel_se);
    s = store_validation(c, err);
out:
    estimate_journal_close(journal);
    free((void *)(uintptr_t)trace.configuration);
    free(n_path);
    return s;
}
