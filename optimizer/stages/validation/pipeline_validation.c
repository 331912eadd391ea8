/* Stage "validation": fresh estimates of every configuration at each model's result, scored for fitted and held-out
 * rows apart. */
#include "optimizer/stages/validation/pipeline_validation.h"
#include "optimizer/fit/baseline/discrepancy_fit.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_fit_option.h"
#include "optimizer/stages/fit/pipeline_cloth.h"
#include "optimizer/stages/fit/pipeline_trace.h"
#include "optimizer/stages/run/work_file.h"
#include "optimizer/stages/validation/pipeline_choice.h"
#include "optimizer/stages/validation/pipeline_contrast.h"
#include "optimizer/stages/validation/pipeline_discrepancy.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { VALIDATION_PILOT = 8192, VALIDATION_LEAST = 1024, VALIDATION_BLOCK = 256, VALIDATION_MAX = 1 << 20 };

/* Standard error of a validated mean relative to the row's brightness: this share of the relative error that the fit
 * has left, to which it adds less than 1 %, between these bounds. And the paths that may be spent on all rows for
 * that: a share of the fit's, which together with the pictures (result_pictures.h) stays below the fit, but enough for
 * a fair judgement where the fit needed few. */
static const double least_rel_se = 0.005, most_rel_se = 0.01, misfit_share = 0.1, validation_share = 0.4,
                    validation_least_paths = 3e5;
/* The same for fitted rows that give a discrepancy, because their noise goes into the renderings of all others, and the
 * paths for all of them. */
static const double factor_rel_se = 0.003, factor_share = 0.2;

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

double pipeline_pilot_paths(double n_fit_path) { return 0.05 * n_fit_path; }

double pipeline_validation_paths(const struct job_fit *fit, double n_fit_path)
{
    double least =
        fit->path_budget > 0 ? fmin(validation_least_paths, (double)fit->path_budget) : validation_least_paths;
    return fmax(validation_share * n_fit_path, least);
}

double pipeline_factor_paths(const struct job_fit *fit, double n_fit_path)
{
    return fit->discrepancy ? factor_share / validation_share * pipeline_validation_paths(fit, n_fit_path) : 0.0;
}

static bool gives_factor(const struct observation *o) { return o->set == JOB_SET_FIT && discrepancy_applies(o); }

static void plan_factor(const struct cloth_job *job, const struct pipeline_model *m, const struct estimate *pilot,
                        size_t *n_path)
{
    double total = 0.0;
    if (!pipeline_discrepancy_expected(job->fit, m)) return;
    for (size_t i = 0; i < job->rows->observation.n; i++)
        if (gives_factor(&job->rows->observation.item[i]))
            total +=
                relative_path_variance(&job->rows->observation.item[i], &pilot[i]) / (factor_rel_se * factor_rel_se);
    const double shrink = fmin(1.0, pipeline_factor_paths(job->fit, (double)m->fit->result.n_path) / fmax(total, 1.0));
    for (size_t i = 0; i < job->rows->observation.n; i++) {
        if (!gives_factor(&job->rows->observation.item[i])) continue;
        const double var = relative_path_variance(&job->rows->observation.item[i], &pilot[i]);
        const double n = fmin(0.5 * shrink * var / (factor_rel_se * factor_rel_se), VALIDATION_MAX);
        n_path[i] += (size_t)ceil(n / VALIDATION_BLOCK) * VALIDATION_BLOCK;
    }
}

/* Plans the paths per replica so that both together reach that standard error. When the budget is short, all rows get
 * less in the same proportion. */
static void plan_validation(const struct cloth_job *job, const struct pipeline_model *m, const struct estimate *pilot,
                            size_t *n_path)
{
    const double rel_se = fmin(fmax(least_rel_se, misfit_share * m->fit->result.objective.rel_rms), most_rel_se);
    double total = 0.0;
    for (size_t i = 0; i < job->rows->observation.n; i++)
        if (job->rows->observation.item[i].weight > 0.0)
            total += relative_path_variance(&job->rows->observation.item[i], &pilot[i]) / (rel_se * rel_se);
    double shrink = fmin(1.0, pipeline_validation_paths(job->fit, (double)m->fit->result.n_path) / fmax(total, 1.0));
    for (size_t i = 0; i < job->rows->observation.n; i++) {
        double n =
            0.5 * shrink * relative_path_variance(&job->rows->observation.item[i], &pilot[i]) / (rel_se * rel_se);
        n = fmin(fmax(n, (double)pilot[i].n_path), VALIDATION_MAX);
        if (!(job->rows->observation.item[i].weight > 0.0))
            n = (double)pilot[i].n_path; /* the row is shown, but not scored */
        n_path[i] = (size_t)ceil(n / VALIDATION_BLOCK) * VALIDATION_BLOCK;
    }
}

/* Converts one replica of row i to the values that its photograph would show. */
static void show_row(const struct observation *o, const struct pipeline_model *m, size_t i, int replica, bool own_gain,
                     struct estimate *out)
{
    nuisance_show(&m->fit->result.nuisance, &m->validation->replica[replica][i], out);
    if (own_gain)
        nuisance_apply_own_gain(o, out, m->setup->option->gain_prior_rel, m->fit->result.uncertainty.misfit_var, out);
}

/* Scores the rows of one set; NaN when it has none. channels may be NULL. */
static status evaluate_set(const struct cloth_job *job, const struct pipeline_model *m, enum job_set set,
                           bool own_gains, struct objective_value *value, struct objective_channels *channels,
                           struct error *err)
{
    struct observation_set part;
    size_t n = job->rows->observation.n, n_part = 0, *place = malloc(n * sizeof *place);
    struct estimate *a = malloc(2 * n * sizeof *a), *b = a != NULL ? a + n : NULL;
    observation_set_init(&part);
    *value = (struct objective_value){NAN, NAN, NAN, NAN, NAN, NAN};
    status s = a != NULL && place != NULL ? observation_set_select(&job->rows->observation, set, &part, err)
                                          : error_set(err, STATUS_NO_MEMORY, "cannot validate: out of memory");
    observation_set_weigh(&part); /* as the fit does */
    for (size_t i = 0; i < n && s == STATUS_OK; i++) {
        place[i] = SIZE_MAX;
        if (job->rows->observation.item[i].set != set || !(job->rows->observation.item[i].weight > 0.0)) continue;
        show_row(&job->rows->observation.item[i], m, i, 0, own_gains, &a[n_part]);
        show_row(&job->rows->observation.item[i], m, i, 1, own_gains, &b[n_part]);
        place[i] = n_part++;
    }
    for (size_t i = 0; i < 2 * n_part && s == STATUS_OK; i++)
        estimate_move_partners(i < n_part ? &a[i] : &b[i - n_part], place);
    if (s == STATUS_OK && part.n > 0) objective_evaluate(&part, a, b, value);
    if (s == STATUS_OK && channels != NULL) objective_evaluate_channels(&part, a, b, channels);
    observation_set_release(&part);
    free(place);
    free(a);
    return s;
}

static status score_validation(const struct cloth_job *job, const struct pipeline_model *m, struct validation *v,
                               struct error *err)
{
    status s = evaluate_set(job, m, JOB_SET_FIT, false, &v->fit, &v->fit_channels, err);
    if (s == STATUS_OK) s = evaluate_set(job, m, JOB_SET_HELD_OUT, false, &v->held_out, &v->held_out_channels, err);
    v->fit_with_gains = v->held_out_with_gains = (struct objective_value){NAN, NAN, NAN, NAN, NAN, NAN};
    if (s == STATUS_OK && m->setup->option->gain == JOB_GAIN_PER_PHOTOGRAPH) {
        s = evaluate_set(job, m, JOB_SET_FIT, true, &v->fit_with_gains, NULL, err);
        if (s == STATUS_OK) s = evaluate_set(job, m, JOB_SET_HELD_OUT, true, &v->held_out_with_gains, NULL, err);
    }
    v->worst_rel_se = 0.0;
    for (size_t i = 0; i < job->rows->observation.n; i++)
        for (int k = 0; k < 3; k++)
            v->worst_rel_se = fmax(v->worst_rel_se, 0.5 * sqrt(v->replica[0][i].var[k] + v->replica[1][i].var[k]) /
                                                        brightness(&job->rows->observation.item[i]));
    return s;
}

static status allocate_validations(size_t n_model, size_t n_row, struct validation_output *out, struct error *err)
{
    if (out->model == NULL) out->model = calloc(n_model, sizeof *out->model);
    if (out->model == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot validate: out of memory");
    for (size_t i = 0; i < 4 * n_model; i++) {
        struct validation *v = &out->model[i / 4];
        struct estimate **replica = i % 4 < 2 ? &v->replica[i % 2] : &v->contrast[i % 2];
        free(*replica);
        *replica = calloc(n_row, sizeof **replica);
        if (*replica == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot validate: out of memory");
    }
    return STATUS_OK;
}

/* Estimates a pilot, then two replicas, each through a journal, so that an interrupted validation does not start
 * over. */
static status estimate_validation(const struct cloth_job *job, const struct pipeline_model *m,
                                  const struct estimator *e, const struct progress *whole, size_t *n_path,
                                  struct validation *v, struct error *err)
{
    struct progress_part part;
    struct progress progress = progress_begin_part(&part, whole, 0.0, 0.1);
    struct estimator_call call = {m->fit->result.param, n_path, 0, REPLICA_FINAL_A, false};
    double wall_s;
    double pilot = pipeline_pilot_paths((double)m->fit->result.n_path) / (double)job->rows->observation.n;
    for (size_t i = 0; i < job->rows->observation.n; i++)
        n_path[i] = (size_t)fmin(fmax(pilot, VALIDATION_LEAST), VALIDATION_PILOT);
    status s = e->run(e->context, &call, &progress, v->replica[0], &wall_s, err);
    if (s != STATUS_OK) return s;
    plan_validation(job, m, v->replica[0], n_path);
    plan_factor(job, m, v->replica[0], n_path);
    for (uint32_t q = 0; q < 2 && s == STATUS_OK; q++) {
        progress = progress_begin_part(&part, whole, 0.1 + 0.45 * q, 0.45);
        call.iteration = 1;
        call.replica = q == 0 ? REPLICA_FINAL_A : REPLICA_FINAL_B;
        s = e->run(e->context, &call, &progress, v->replica[q], &wall_s, err);
    }
    return s;
}

static status validate_model(const struct validation_input *in, size_t i_model, size_t *n_path, struct validation *v,
                             struct error *err)
{
    const struct cloth_job *job = in->job;
    const struct pipeline_model m = {.setup = &job->model[i_model], .fit = &in->fit[i_model], .validation = v};
    struct pipeline_trace trace;
    struct progress_part part, means, contrasts;
    struct progress progress = pipeline_model_progress(&part, &job->tools->progress, job->n_model, i_model);
    double share = job->rows->contrast.n > 0 ? 0.5 : 1.0;
    struct progress of_means = progress_begin_part(&means, &progress, 0.0, share);
    struct progress of_contrasts = progress_begin_part(&contrasts, &progress, share, 1.0 - share);
    struct estimator estimator;
    status s = pipeline_cloth_use(job, &in->fit[i_model], i_model, in->made, err);
    if (s != STATUS_OK) return s;
    s = pipeline_trace_open(&trace, job, in->made, "validation", "estimates.journal", i_model, &job->rows->observation,
                            err);
    if (s != STATUS_OK) goto out;
    estimator = estimate_journal_estimator(trace.journal);
    s = estimate_validation(job, &m, &estimator, &of_means, n_path, v, err);
    if (s == STATUS_OK) s = pipeline_validate_contrast(in, i_model, n_path, &of_contrasts, v, err);
    if (s == STATUS_OK) s = score_validation(job, &m, v, err);
    if (s == STATUS_OK) s = pipeline_find_discrepancy(job, &m, v, err);
    if (s == STATUS_OK && pipeline_discrepancy(v) != NULL) s = score_validation(job, &m, v, err);
    if (s != STATUS_OK) goto out;
    log_info(job->tools->log,
             "validation of %s: relative RMS error %.4f +- %.4f over the fitted rows, %.4f +- %.4f over the held-out "
             "rows; rendered "
             "means have a standard error below %.2f %%",
             m.setup->appearance.id, v->fit.rel_rms, v->fit.rel_rms_se, v->held_out.rel_rms, v->held_out.rel_rms_se,
             100.0 * v->worst_rel_se);
out:
    pipeline_trace_close(&trace);
    return s;
}

enum { MAX_SECTION = 5 * JOB_MAX_MODEL };
_Static_assert((int)MAX_SECTION <= (int)WORK_FILE_MAX_SECTION, "a checkpoint has room for the estimates of all models");
static void estimate_sections(const struct validation_output *out, size_t n_model, size_t n_row,
                              struct work_section section[MAX_SECTION])
{
    for (size_t i = 0; i < 4 * n_model; i++) {
        struct validation *v = &out->model[i / 4];
        section[i] =
            (struct work_section){i % 4 < 2 ? v->replica[i % 2] : v->contrast[i % 2], n_row * sizeof(struct estimate)};
    }
    for (size_t i = 0; i < n_model; i++)
        section[4 * n_model + i] = (struct work_section){&out->model[i].discrepancy, sizeof out->model[i].discrepancy};
}

static status store_validations(const struct validation_input *in, struct validation_output *out, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    struct work_section section[MAX_SECTION];
    estimate_sections(out, in->job->n_model, in->job->rows->observation.n, section);
    status s = stage_work_path(in->job->tools, "validation", "estimates.bin", path, err);
    if (s == STATUS_OK) s = worker_folder_check(in->job->tools->folder, err);
    return s == STATUS_OK ? work_file_write(path, "validation.4", section, 5 * in->job->n_model, err) : s;
}

static void warn_choice(const struct validation_input *in, const struct validation_output *out)
{
    struct pipeline_model view[JOB_MAX_MODEL];
    for (size_t i = 0; i < in->job->n_model; i++)
        view[i] =
            (struct pipeline_model){.setup = &in->job->model[i], .fit = &in->fit[i], .validation = &out->model[i]};
    pipeline_warn_choice(in->job->tools->status, view, in->job->n_model);
}

status validation_output_given(const struct job_inputs *in, struct validation_output *out, struct error *err)
{
    if (in->given.rendered_rgb == NULL) return STATUS_OK;
    status s = allocate_validations(in->n_model, in->rows.observation.n, out, err);
    for (size_t i = 0; s == STATUS_OK && i < in->rows.observation.n; i++)
        for (int q = 0; q < 2; q++) {
            struct estimate *e = &out->model->replica[q][i];
            memcpy(e->mean, in->given.rendered_rgb[i], sizeof e->mean);
            /* two replicas of twice the variance have the mean's variance together */
            for (int c = 0; c < 3; c++) e->var[c] = 2.0 * in->given.rendered_var[i][c];
        }
    if (s == STATUS_OK) out->model->discrepancy.factor = in->given.factor;
    return s;
}

void validation_output_release(struct validation_output *out, size_t n_model)
{
    for (size_t i = 0; i < n_model && out->model != NULL; i++)
        for (int q = 0; q < 2; q++) {
            free(out->model[i].replica[q]);
            free(out->model[i].contrast[q]);
        }
    free(out->model);
    out->model = NULL;
}

status stage_validation_load(const struct validation_input *in, struct validation_output *out, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    struct work_section section[MAX_SECTION];
    status s = allocate_validations(in->job->n_model, in->job->rows->observation.n, out, err);
    if (s == STATUS_OK) s = stage_work_path(in->job->tools, "validation", "estimates.bin", path, err);
    if (s != STATUS_OK) return s;
    estimate_sections(out, in->job->n_model, in->job->rows->observation.n, section);
    s = work_file_read(path, "validation.4", section, 5 * in->job->n_model, err);
    for (size_t i = 0; i < in->job->n_model && s == STATUS_OK; i++)
        s = score_validation(
            in->job,
            &(struct pipeline_model){.setup = &in->job->model[i], .fit = &in->fit[i], .validation = &out->model[i]},
            &out->model[i], err);
    if (s == STATUS_OK) warn_choice(in, out);
    return s;
}

status stage_validation(const struct validation_input *in, struct validation_output *out, struct error *err)
{
    size_t *n_path = calloc(in->job->rows->observation.n, sizeof *n_path);
    status s = n_path != NULL ? allocate_validations(in->job->n_model, in->job->rows->observation.n, out, err)
                              : error_set(err, STATUS_NO_MEMORY, "cannot validate: out of memory");
    for (size_t i = 0; i < in->job->n_model && s == STATUS_OK; i++)
        s = validate_model(in, i, n_path, &out->model[i], err);
    if (s == STATUS_OK) s = store_validations(in, out, err);
    if (s == STATUS_OK) warn_choice(in, out);
    free(n_path);
    return s;
}
