/* Stage "fit": for each model of the job, the path tracer behind a journal and a method of descent. */
#include "base/option_id.h"
#include "optimizer/fit/descent/fit_run.h"
#include "optimizer/worker/progress/pipeline_plan.h"
#include "optimizer/worker/stages/fit/pipeline_cloth.h"
#include "optimizer/worker/stages/fit/pipeline_correction.h"
#include "optimizer/worker/stages/fit/pipeline_fit_option.h"
#include "optimizer/worker/stages/fit/pipeline_nesting.h"
#include "optimizer/worker/stages/fit/pipeline_radius.h"
#include "optimizer/worker/stages/fit/pipeline_scan_error.h"
#include "optimizer/worker/stages/fit/pipeline_trace.h"
#include "optimizer/worker/work_file.h"
#include "optimizer/worker/worker_series.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FIT_SECTIONS = 3 * JOB_MAX_MODEL + 1 };
_Static_assert((int)FIT_SECTIONS <= (int)WORK_FILE_MAX_SECTION, "a checkpoint has room for the fits of all models");

struct fit_listener {
    struct pipeline_context *pipeline;
    size_t i_model, i_place; /* its place in the order of the fits */
    size_t step_base;        /* steps of the fits before this one */
    struct worker_series *series;
    struct estimate_journal *journal;
    const struct pipeline_joint *joint; /* the unknowns of the model's fit */
};

static status on_step(void *context, const struct fit_step *step, struct error *err)
{
    struct fit_listener *l = context;
    struct pipeline_context *c = l->pipeline;
    bool replayed = estimate_journal_replaying(l->journal);
    double n_path = (double)step->n_path_total;
    for (size_t i = 0; i < c->n_model; i++) n_path += i != l->i_model ? (double)c->model[i].fit.n_path : 0.0;
    pipeline_plan_fit_paths(c, n_path);
    worker_status_objective(c->status, l->step_base + step->step, step->objective.value, step->objective.se);
    if (replayed)
        worker_status_restart_eta(c->status);
    else
        log_info(c->log, "step %zu (%s): objective %.5g +- %.2g, relative RMS error %.3f, %.0f thousand paths in all",
                 step->step, step->phase, step->objective.value, step->objective.se, step->objective.rel_rms,
                 (double)step->n_path_total / 1e3);
    const struct worker_series_model model = {&l->joint->info, l->joint->parameter, l->i_model, l->step_base};
    return worker_series_add(l->series, step, &model, replayed, err);
}

static struct fit_problem problem_of(struct fit_listener *l, const struct progress *progress)
{
    struct pipeline_context *c = l->pipeline;
    return (struct fit_problem){.n_param = l->joint->info.n_param,
                                .info = l->joint->info.param,
                                .parameter = l->joint->parameter,
                                .observation = &c->row,
                                .path_budget = c->doc->fit.path_budget,
                                .precision = c->doc->fit.precision,
                                .max_iteration = c->doc->fit.max_iteration,
                                .discrepancy = c->doc->fit.discrepancy,
                                .report = on_step,
                                .report_context = l,
                                .progress = progress};
}

/* Fits the scattering parameters to the cloth as it is. */
static status fit_parameters(struct fit_listener *l, const struct progress *progress, struct error *err)
{
    struct pipeline_context *c = l->pipeline;
    struct pipeline_trace trace;
    struct fit_problem problem = problem_of(l, progress);
    problem.usual_path = pipeline_plan_usual_paths(c);
    status s = pipeline_trace_open(&trace, c, "fit", "estimates.journal", l->i_model, &c->row, err);
    if (s == STATUS_OK) {
        struct estimator estimator = estimate_journal_estimator(trace.journal);
        l->journal = trace.journal;
        problem.estimator = &estimator;
        s = fit_run(descent_find(c->doc->fit.method), &problem, &l->joint->option, &c->model[l->i_model].fit, err);
    }
    if (s == STATUS_OK && estimate_journal_n_replayed(trace.journal) > 0)
        log_info(c->log, "%zu estimates came from the checkpoint", estimate_journal_n_replayed(trace.journal));
    pipeline_trace_close(&trace);
    return s;
}

/* Fits the numbers of the cloth as well. */
static status fit_cloth(struct fit_listener *l, const struct progress *progress, struct error *err)
{
    struct pipeline_context *c = l->pipeline;
    struct pipeline_cloth_trace *trace = NULL;
    struct fit_problem problem = problem_of(l, progress);
    status s = pipeline_cloth_open(c, l->i_model, l->joint, &trace, &l->journal, err);
    if (s == STATUS_OK) s = pipeline_cloth_fit(trace, l->joint, &problem, err);
    if (s == STATUS_OK && estimate_journal_n_replayed(l->journal) > 0)
        log_info(c->log, "%zu estimates came from the checkpoint", estimate_journal_n_replayed(l->journal));
    pipeline_cloth_close(trace);
    return s;
}

/* Warns of starts that ended at other parameters with the same objective, because the photographs do not distinguish
 * the two. */
static void warn_of_starts(struct pipeline_context *c, const struct pipeline_model *m)
{
    for (size_t k = 0; k < m->fit.n_start; k++) {
        if (!m->fit.start[k].elsewhere) continue;
        worker_status_warn(
            c->status,
            "start %zu of the fit of %s ended at other parameters with an objective (%.4g) that cannot be told "
            "from the one kept: the photographs allow more than one solution",
            k + 1, m->appearance.id, m->fit.start[k].objective);
    }
}

static void warn_convergence(struct pipeline_context *c, const struct pipeline_model *m)
{
    if (m->fit.converged) return;
    worker_status_warn(c->status, "the fit%s%s has not converged: %s", c->n_model > 1 ? " of " : "",
                       c->n_model > 1 ? m->appearance.id : "", m->fit.reason);
}

static void warn_density(struct pipeline_context *c, const struct pipeline_model *m)
{
    int d = appearance_param_index(&m->appearance, MODEL_DENSITY_MULTIPLIER);
    if (d < 0 || m->parameter[d].fixed || m->fit.uncertainty.determined[d]) return;
    worker_status_warn(
        c->status,
        "the density multiplier of %s is not determined by these photographs: too little light comes through "
        "the cloth, or too much",
        m->appearance.id);
}

/* Writes the names of the flagged parameters as "a, b, c". Returns false when there is none. */
static bool list_names(const struct pipeline_model *m, const bool *flag, size_t n_text, char *text)
{
    size_t used = 0;
    text[0] = '\0';
    for (size_t p = 0; p < m->sets.info.n_param && used < n_text; p++)
        if (flag[p])
            used +=
                (size_t)snprintf(text + used, n_text - used, "%s%s", used > 0 ? ", " : "", m->sets.info.param[p].name);
    return used > 0;
}

/* Names the numbers of the cloth that the measurements do not determine. */
static void warn_numbers(struct pipeline_context *c, const struct pipeline_model *m)
{
    const struct uncertainty *u = &m->cloth.joint.uncertainty;
    char names[300];
    size_t used = 0;
    for (size_t k = 0; k < c->number.n && used < sizeof names; k++)
        if (!u->determined[u->n_param - c->number.n + k])
            used += (size_t)snprintf(names + used, sizeof names - used, "%s%s", used > 0 ? ", " : "",
                                     c->number.info[k].name);
    if (m->cloth.took_screened)
        worker_status_warn(c->status,
                           "the search over the cloth's numbers of %s ended worse than a cloth that was tried first, "
                           "which was taken: allow more paths",
                           m->appearance.id);
    if (used > 0)
        worker_status_warn(c->status, "these measurements do not determine, in the fit of %s: %s", m->appearance.id,
                           names);
}

static void warn_parameters(struct pipeline_context *c, const struct pipeline_model *m)
{
    bool at_bound[FIT_MAX_PARAM], unknown[FIT_MAX_PARAM];
    char names[300];
    for (size_t p = 0; p < m->sets.info.n_param; p++) {
        bool density = m->sets.info.param[p].kind == PARAM_DENSITY; /* warn_density */
        at_bound[p] = !m->parameter[p].fixed && m->fit.uncertainty.at_bound[p];
        unknown[p] = !m->parameter[p].fixed && !m->fit.uncertainty.determined[p] && !density;
    }
    if (list_names(m, at_bound, sizeof names, names)) {
        worker_status_warn(c->status, "at the edge of the allowed range in the fit of %s: %s", m->appearance.id, names);
    }
    if (list_names(m, unknown, sizeof names, names)) {
        worker_status_warn(c->status, "not determined by these measurements in the fit of %s: %s", m->appearance.id,
                           names);
    }
}

/* Logs the result of a fit, made now or by an earlier attempt, and sends its warnings. */
static void conclude_fit(struct pipeline_context *c, const struct pipeline_model *m)
{
    log_info(c->log, "fit of %s %s after %zu steps, %.3g paths, %.1f s: %s", m->appearance.id,
             m->fit.converged ? "converged" : "did NOT converge", m->fit.n_step, (double)m->fit.n_path, m->fit.wall_s,
             m->fit.reason);
    warn_convergence(c, m);
    warn_of_starts(c, m);
    warn_density(c, m);
    warn_parameters(c, m);
    warn_numbers(c, m);
}

static void announce_model(struct pipeline_context *c, const struct fit_listener *l)
{
    char message[160];
    if (c->n_model < 2) return;
    snprintf(message, sizeof message, "fitting %s (model %zu of %zu)", c->model[l->i_model].appearance.id,
             l->i_place + 1, c->n_model);
    worker_status_message(c->status, message);
    log_info(c->log, "%s", message);
}

/* Fits the model, and carries the errors of scanned fibers into those of its parameters. */
static status run_fit(struct fit_listener *l, const struct progress *progress, struct error *err)
{
    struct pipeline_context *c = l->pipeline;
    struct progress_part first, last;
    const bool compare = pipeline_correction_applies(c);
    const double share = compare                                      ? PIPELINE_CORRECTION_SHARE
                         : pipeline_scan_error_applies(c, l->i_model) ? PIPELINE_SCAN_ERROR_SHARE
                                                                      : 0.0;
    struct progress fit = progress_begin_part(&first, progress, 0.0, 1.0 - share);
    status s = c->number.n > 0 ? fit_cloth(l, &fit, err) : fit_parameters(l, &fit, err);
    if (s != STATUS_OK) return s;
    struct progress rest = progress_begin_part(&last, progress, 1.0 - share, share);
    s = pipeline_scan_error_carry(c, l->i_model, &rest, err);
    return s == STATUS_OK && compare ? pipeline_correction_compare(c, l->i_model, &rest, err) : s;
}

static status fit_model(struct fit_listener *listener, struct error *err)
{
    struct pipeline_context *c = listener->pipeline;
    struct pipeline_model *m = &c->model[listener->i_model];
    struct progress_part rest, part;
    double before = c->doc->fit.fit_radius ? PIPELINE_RADIUS_SHARE : 0.0;
    struct progress whole = progress_begin_part(&rest, &c->progress, before, 1.0 - before);
    struct progress progress = pipeline_model_progress(&part, &whole, c, listener->i_place);
    struct pipeline_joint *joint = malloc(sizeof *joint);
    if (joint == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot start a fit: out of memory");
    announce_model(c, listener);
    listener->joint = joint;
    status s = pipeline_joint_init(c, listener->i_model, joint, err);
    if (s == STATUS_OK) pipeline_add_nested_starts(c, listener->i_model, &joint->option);
    if (s == STATUS_OK && descent_find(c->doc->fit.method) == NULL)
        s = error_set_field(err, STATUS_INVALID, OPTION_METHOD, "unknown method '%s'", c->doc->fit.method);
    if (s == STATUS_OK) s = run_fit(listener, &progress, err);
    if (s == STATUS_OK) {
        conclude_fit(c, m);
        listener->step_base += m->fit.n_step;
    }
    free(joint);
    return s;
}

static size_t result_sections(struct pipeline_context *c, struct work_section section[FIT_SECTIONS])
{
    for (size_t i = 0; i < c->n_model; i++) {
        section[3 * i] = (struct work_section){&c->model[i].fit, sizeof c->model[i].fit};
        section[3 * i + 1] = (struct work_section){&c->model[i].cloth, sizeof c->model[i].cloth};
        section[3 * i + 2] = (struct work_section){&c->model[i].scan_error, sizeof c->model[i].scan_error};
    }
    section[3 * c->n_model] = (struct work_section){&c->radius, sizeof c->radius};
    return 3 * c->n_model + 1;
}

static status store_fits(struct pipeline_context *c, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    struct work_section section[FIT_SECTIONS];
    size_t n = result_sections(c, section);
    status s = pipeline_work_path(c, "fit", "result.bin", path, err);
    if (s == STATUS_OK) s = worker_folder_check(c->folder, err);
    return s == STATUS_OK ? work_file_write(path, "fit.12", section, n, err) : s;
}

status stage_fit_load(struct pipeline_context *c, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    struct work_section section[FIT_SECTIONS];
    size_t n = result_sections(c, section);
    pipeline_correction_priors(c);
    status s = pipeline_work_path(c, "fit", "result.bin", path, err);
    if (s == STATUS_OK) s = work_file_read(path, "fit.12", section, n, err);
    if (s == STATUS_OK && c->doc->fit.fit_radius) s = pipeline_radius_apply(c, err);
    for (size_t i = 0; i < c->n_model && s == STATUS_OK; i++) conclude_fit(c, &c->model[i]);
    return s;
}

status stage_fit(struct pipeline_context *c, struct error *err)
{
    struct fit_listener listener = {.pipeline = c};
    pipeline_correction_priors(c);
    size_t order[JOB_MAX_MODEL];
    status s = worker_series_open(c->folder, &listener.series, err);
    if (s == STATUS_OK && c->doc->fit.fit_radius) s = pipeline_radius_search(c, listener.series, err);
    listener.step_base = c->radius.n_step;
    pipeline_fit_order(c, order);
    for (; listener.i_place < c->n_model && s == STATUS_OK; listener.i_place++) {
        listener.i_model = order[listener.i_place];
        s = fit_model(&listener, err);
    }
    if (s == STATUS_OK) s = store_fits(c, err);
    worker_series_close(listener.series);
    return s;
}
