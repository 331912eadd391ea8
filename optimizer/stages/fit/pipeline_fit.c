/* Stage "fit": for each model of the job, the path tracer behind a journal and a method of descent. */
#include "base/option_id.h"
#include "optimizer/fit/descent/fit_run.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/stages/fit/pipeline_cloth.h"
#include "optimizer/stages/fit/pipeline_correction.h"
#include "optimizer/stages/fit/pipeline_fit_option.h"
#include "optimizer/stages/fit/pipeline_nesting.h"
#include "optimizer/stages/fit/pipeline_radius.h"
#include "optimizer/stages/fit/pipeline_scan_error.h"
#include "optimizer/stages/fit/pipeline_trace.h"
#include "optimizer/stages/fit_stages.h"
#include "optimizer/stages/run/work_file.h"
#include "optimizer/stages/run/worker_series.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FIT_SECTIONS = 3 * JOB_MAX_MODEL + 1 };
_Static_assert((int)FIT_SECTIONS <= (int)WORK_FILE_MAX_SECTION, "a checkpoint has room for the fits of all models");

struct fit_listener {
    const struct fit_input *in;
    struct fit_output *out;
    size_t i_model, i_place; /* its place in the order of the fits */
    size_t step_base;        /* steps of the fits before this one */
    struct worker_series *series;
    struct estimate_journal *journal;
    const struct pipeline_joint *joint; /* the unknowns of the model's fit */
};

static status on_step(void *context, const struct fit_step *step, struct error *err)
{
    struct fit_listener *l = context;
    const struct stage_tools *tools = l->in->job->tools;
    bool replayed = estimate_journal_replaying(l->journal);
    double n_path = (double)step->n_path_total;
    for (size_t i = 0; i < l->in->job->n_model; i++)
        n_path += i != l->i_model ? (double)l->out->model[i].result.n_path : 0.0;
    if (tools->plan.fit_paths != NULL) tools->plan.fit_paths(tools->plan.context, n_path);
    worker_status_objective(tools->status, l->step_base + step->step, step->objective.value, step->objective.se);
    if (replayed)
        worker_status_restart_eta(tools->status);
    else
        log_info(tools->log,
                 "step %zu (%s): objective %.5g +- %.2g, relative RMS error %.3f, %.0f thousand paths in all",
                 step->step, step->phase, step->objective.value, step->objective.se, step->objective.rel_rms,
                 (double)step->n_path_total / 1e3);
    const struct worker_series_model model = {&l->joint->info, l->joint->parameter, l->i_model, l->step_base};
    return worker_series_add(l->series, step, &model, replayed, err);
}

static struct fit_problem problem_of(struct fit_listener *l, const struct progress *progress)
{
    const struct job_fit *fit = l->in->job->fit;
    return (struct fit_problem){.n_param = l->joint->info.n_param,
                                .info = l->joint->info.param,
                                .parameter = l->joint->parameter,
                                .observation = &l->in->job->rows->row,
                                .path_budget = fit->path_budget,
                                .precision = fit->precision,
                                .max_iteration = fit->max_iteration,
                                .discrepancy = fit->discrepancy,
                                .report = on_step,
                                .report_context = l,
                                .progress = progress};
}

/* Fits the scattering parameters to the cloth as it is. */
static status fit_parameters(struct fit_listener *l, const struct progress *progress, struct error *err)
{
    const struct cloth_job *job = l->in->job;
    struct pipeline_trace trace;
    struct fit_problem problem = problem_of(l, progress);
    problem.usual_path = l->in->usual_path;
    status s =
        pipeline_trace_open(&trace, job, l->in->made, "fit", "estimates.journal", l->i_model, &job->rows->row, err);
    if (s == STATUS_OK) {
        struct estimator estimator = estimate_journal_estimator(trace.journal);
        l->journal = trace.journal;
        problem.estimator = &estimator;
        s = fit_run(descent_find(job->fit->method), &problem, &l->joint->option, &l->out->model[l->i_model].result,
                    err);
    }
    if (s == STATUS_OK && estimate_journal_n_replayed(trace.journal) > 0)
        log_info(job->tools->log, "%zu estimates came from the checkpoint", estimate_journal_n_replayed(trace.journal));
    pipeline_trace_close(&trace);
    return s;
}

/* Fits the numbers of the cloth as well. */
static status fit_cloth(struct fit_listener *l, const struct progress *progress, struct error *err)
{
    const struct cloth_job *job = l->in->job;
    struct pipeline_cloth_trace *trace = NULL;
    struct fit_problem problem = problem_of(l, progress);
    status s = pipeline_cloth_open(job, l->in->made, l->i_model, l->joint, &trace, &l->journal, err);
    if (s == STATUS_OK) s = pipeline_cloth_fit(trace, l->joint, &problem, &l->out->model[l->i_model], err);
    if (s == STATUS_OK && estimate_journal_n_replayed(l->journal) > 0)
        log_info(job->tools->log, "%zu estimates came from the checkpoint", estimate_journal_n_replayed(l->journal));
    pipeline_cloth_close(trace);
    return s;
}

/* Warns of starts that ended at other parameters with the same objective, because the photographs do not distinguish
 * the two. */
static void warn_of_starts(const struct fit_input *in, const struct pipeline_model *m)
{
    for (size_t k = 0; k < m->fit->result.n_start; k++) {
        if (!m->fit->result.start[k].elsewhere) continue;
        worker_status_warn(in->job->tools->status,
                           "start %zu of the fit of %s ended at other parameters with a sum of squared errors (%.4g) "
                           "that cannot be told "
                           "from the one kept: the photographs allow more than one solution",
                           k + 1, m->setup->appearance.id, m->fit->result.start[k].objective);
    }
}

static void warn_convergence(const struct fit_input *in, const struct pipeline_model *m)
{
    if (m->fit->result.converged) return;
    worker_status_warn(in->job->tools->status, "the fit%s%s has not converged: %s", in->job->n_model > 1 ? " of " : "",
                       in->job->n_model > 1 ? m->setup->appearance.id : "", m->fit->result.reason);
}

static void warn_density(const struct fit_input *in, const struct pipeline_model *m)
{
    int d = appearance_param_index(&m->setup->appearance, MODEL_DENSITY_MULTIPLIER);
    if (d < 0 || m->setup->parameter[d].fixed || m->fit->result.uncertainty.determined[d]) return;
    worker_status_warn(
        in->job->tools->status,
        "the density multiplier of %s is not determined by these photographs: too little light comes through "
        "the cloth, or too much",
        m->setup->appearance.id);
}

/* Writes the names of the flagged parameters as "a, b, c". Returns false when there is none. */
static bool list_names(const struct pipeline_model *m, const bool *flag, size_t n_text, char *text)
{
    size_t used = 0;
    text[0] = '\0';
    for (size_t p = 0; p < m->setup->sets.info.n_param && used < n_text; p++)
        if (flag[p])
            used += (size_t)snprintf(text + used, n_text - used, "%s%s", used > 0 ? ", " : "",
                                     m->setup->sets.info.param[p].name);
    return used > 0;
}

/* Names the numbers of the cloth that the measurements do not determine. */
static void warn_numbers(const struct fit_input *in, const struct pipeline_model *m)
{
    const struct uncertainty *u = &m->fit->cloth.joint.uncertainty;
    char names[300];
    size_t used = 0;
    for (size_t k = 0; k < in->made->number.n && used < sizeof names; k++)
        if (!u->determined[u->n_param - in->made->number.n + k])
            used += (size_t)snprintf(names + used, sizeof names - used, "%s%s", used > 0 ? ", " : "",
                                     in->made->number.info[k].name);
    if (m->fit->cloth.took_screened)
        worker_status_warn(in->job->tools->status,
                           "the search over the cloth's numbers of %s ended worse than a cloth that was tried first, "
                           "which was taken: allow more paths",
                           m->setup->appearance.id);
    if (used > 0)
        worker_status_warn(in->job->tools->status, "these measurements do not determine, in the fit of %s: %s",
                           m->setup->appearance.id, names);
}

static void warn_parameters(const struct fit_input *in, const struct pipeline_model *m)
{
    bool at_bound[FIT_MAX_PARAM], unknown[FIT_MAX_PARAM];
    char names[300];
    for (size_t p = 0; p < m->setup->sets.info.n_param; p++) {
        bool density = m->setup->sets.info.param[p].kind == PARAM_DENSITY; /* warn_density */
        at_bound[p] = !m->setup->parameter[p].fixed && m->fit->result.uncertainty.at_bound[p];
        unknown[p] = !m->setup->parameter[p].fixed && !m->fit->result.uncertainty.determined[p] && !density;
    }
    if (list_names(m, at_bound, sizeof names, names)) {
        worker_status_warn(in->job->tools->status, "at the edge of the allowed range in the fit of %s: %s",
                           m->setup->appearance.id, names);
    }
    if (list_names(m, unknown, sizeof names, names)) {
        worker_status_warn(in->job->tools->status, "not determined by these measurements in the fit of %s: %s",
                           m->setup->appearance.id, names);
    }
}

/* Logs the result of a fit, made now or by an earlier attempt, and sends its warnings. */
static void conclude_fit(const struct fit_input *in, const struct pipeline_model *m)
{
    log_info(in->job->tools->log, "fit of %s %s after %zu steps, %.3g paths, %.1f s: %s", m->setup->appearance.id,
             m->fit->result.converged ? "converged" : "did NOT converge", m->fit->result.n_step,
             (double)m->fit->result.n_path, m->fit->result.wall_s, m->fit->result.reason);
    warn_convergence(in, m);
    warn_of_starts(in, m);
    warn_density(in, m);
    warn_parameters(in, m);
    warn_numbers(in, m);
}

static void announce_model(const struct fit_listener *l)
{
    const struct cloth_job *job = l->in->job;
    char message[160];
    if (job->n_model < 2) return;
    snprintf(message, sizeof message, "fitting %s (model %zu of %zu)", job->model[l->i_model].appearance.id,
             l->i_place + 1, job->n_model);
    worker_status_message(job->tools->status, message);
    log_info(job->tools->log, "%s", message);
}

/* Fits the model, and carries the errors of scanned fibers into the errors of its parameters. */
static status run_fit(struct fit_listener *l, const struct progress *progress, struct error *err)
{
    const struct cloth_job *job = l->in->job;
    const struct made_cloth *made = l->in->made;
    struct model_fit *own = &l->out->model[l->i_model];
    struct progress_part first, last;
    const bool compare = pipeline_correction_applies(job->cloth, &made->number);
    const double share = compare                                              ? PIPELINE_CORRECTION_SHARE
                         : pipeline_scan_error_applies(job, made, l->i_model) ? PIPELINE_SCAN_ERROR_SHARE
                                                                              : 0.0;
    struct progress fit = progress_begin_part(&first, progress, 0.0, 1.0 - share);
    status s = made->number.n > 0 ? fit_cloth(l, &fit, err) : fit_parameters(l, &fit, err);
    if (s != STATUS_OK) return s;
    struct progress rest = progress_begin_part(&last, progress, 1.0 - share, share);
    s = pipeline_scan_error_carry(l->in, l->i_model, &rest, own, err);
    return s == STATUS_OK && compare ? pipeline_correction_compare(l->in, l->i_model, &rest, own, err) : s;
}

static status fit_model(struct fit_listener *listener, struct error *err)
{
    const struct fit_input *in = listener->in;
    const struct cloth_job *job = in->job;
    const struct model_fit *fit = &listener->out->model[listener->i_model];
    struct progress_part rest, part;
    double before = job->fit->fit_radius ? PIPELINE_RADIUS_SHARE : 0.0;
    struct progress whole = progress_begin_part(&rest, &job->tools->progress, before, 1.0 - before);
    struct progress progress = pipeline_model_progress(&part, &whole, job->n_model, listener->i_place);
    struct pipeline_joint *joint = malloc(sizeof *joint);
    if (joint == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot start a fit: out of memory");
    announce_model(listener);
    listener->joint = joint;
    status s = pipeline_joint_init(&job->model[listener->i_model], &in->made->number, joint, err);
    if (s == STATUS_OK)
        pipeline_add_nested_starts(
            &(struct nested_models){job->n_model, job->model, listener->out->model, in->made->number.n},
            listener->i_model, &joint->option);
    if (s == STATUS_OK && descent_find(job->fit->method) == NULL)
        s = error_set_field(err, STATUS_INVALID, OPTION_METHOD, "unknown method '%s'", job->fit->method);
    if (s == STATUS_OK) s = run_fit(listener, &progress, err);
    if (s == STATUS_OK) {
        conclude_fit(in, &(struct pipeline_model){.setup = &job->model[listener->i_model], .fit = fit});
        listener->step_base += fit->result.n_step;
    }
    free(joint);
    return s;
}

static size_t result_sections(struct fit_output *out, size_t n_model, struct work_section section[FIT_SECTIONS])
{
    for (size_t i = 0; i < n_model; i++) {
        section[3 * i] = (struct work_section){&out->model[i].result, sizeof out->model[i].result};
        section[3 * i + 1] = (struct work_section){&out->model[i].cloth, sizeof out->model[i].cloth};
        section[3 * i + 2] = (struct work_section){&out->model[i].scan_error, sizeof out->model[i].scan_error};
    }
    section[3 * n_model] = (struct work_section){&out->radius, sizeof out->radius};
    return 3 * n_model + 1;
}

static status store_fits(const struct fit_input *in, struct fit_output *out, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    struct work_section section[FIT_SECTIONS];
    size_t n = result_sections(out, in->job->n_model, section);
    status s = stage_work_path(in->job->tools, "fit", "result.bin", path, err);
    if (s == STATUS_OK) s = worker_folder_check(in->job->tools->folder, err);
    return s == STATUS_OK ? work_file_write(path, "fit.12", section, n, err) : s;
}

static status allocate_fits(size_t n_model, struct fit_output *out, struct error *err)
{
    if (out->model == NULL) out->model = calloc(n_model, sizeof *out->model);
    return out->model != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot start a fit: out of memory");
}

status fit_output_given(const struct job_inputs *in, struct fit_output *out, struct error *err)
{
    status s = allocate_fits(in->n_model, out, err);
    if (s == STATUS_OK) out->model->result.n_path = in->given.n_fit_path;
    for (size_t p = 0; s == STATUS_OK && p < in->model->sets.info.n_param; p++) {
        out->model->result.param[p] = in->model->parameter[p].start;
        out->model->result.uncertainty.se_param[p] = NAN;
        out->model->result.uncertainty.determined[p] = true;
    }
    return s;
}

void fit_output_release(struct fit_output *out, size_t n_model)
{
    for (size_t i = 0; i < n_model && out->model != NULL; i++) profile_fit_release(&out->model[i].profile);
    free(out->model);
    out->model = NULL;
}

status stage_fit_load(const struct fit_input *in, struct fit_output *out, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    struct work_section section[FIT_SECTIONS];
    status s = allocate_fits(in->job->n_model, out, err);
    if (s == STATUS_OK) s = stage_work_path(in->job->tools, "fit", "result.bin", path, err);
    if (s != STATUS_OK) return s;
    size_t n = result_sections(out, in->job->n_model, section);
    s = work_file_read(path, "fit.12", section, n, err);
    if (s == STATUS_OK && in->job->fit->fit_radius) s = pipeline_radius_apply(in, &out->radius, err);
    for (size_t i = 0; i < in->job->n_model && s == STATUS_OK; i++)
        conclude_fit(in, &(struct pipeline_model){.setup = &in->job->model[i], .fit = &out->model[i]});
    return s;
}

status stage_fit(const struct fit_input *in, struct fit_output *out, struct error *err)
{
    struct fit_listener listener = {.in = in, .out = out};
    size_t order[JOB_MAX_MODEL];
    status s = allocate_fits(in->job->n_model, out, err);
    if (s == STATUS_OK) s = worker_series_open(in->job->tools->folder, &listener.series, err);
    if (s == STATUS_OK && in->job->fit->fit_radius) s = pipeline_radius_search(in, listener.series, &out->radius, err);
    listener.step_base = out->radius.n_step;
    pipeline_fit_order(in->job->model, in->job->n_model, order);
    for (; listener.i_place < in->job->n_model && s == STATUS_OK; listener.i_place++) {
        listener.i_model = order[listener.i_place];
        s = fit_model(&listener, err);
    }
    if (s == STATUS_OK) s = store_fits(in, out, err);
    worker_series_close(listener.series);
    return s;
}
