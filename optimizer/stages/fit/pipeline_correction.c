#include "optimizer/stages/fit/pipeline_correction.h"
#include "optimizer/fit/descent/fit_run.h"
#include "optimizer/fit/descent/trace_estimator.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/stages/fit/pipeline_fit_option.h"
#include "optimizer/stages/fit/pipeline_scan_error.h"
#include "optimizer/stages/fit/pipeline_trace.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

/* Paths of a row and replica when a fit is scored: a share of the paths of the fit, between two bounds. */
static const double score_share = 0.1, score_least = 4096.0, score_most = 65536.0;

bool pipeline_correction_applies(const struct job_cloth *cloth, const struct cloth_numbers *number)
{
    return cloth->has_correction && number->n > 0;
}

static status fit_uncorrected(const struct fit_input *in, size_t i_model, uint64_t path_budget,
                              const struct scene *scene, const struct progress *progress, struct fit_result *r,
                              struct error *err)
{
    const struct cloth_job *job = in->job;
    const struct model_setup *m = &job->model[i_model];
    struct fit_option option;
    struct trace_estimator live;
    struct configuration *configuration = trace_configurations(&job->rows->row);
    if (configuration == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot compare fits: out of memory");
    pipeline_fit_option(m->option, m->sets.info.param, m->sets.info.n_param, &option);
    pipeline_trace_request(&live, job, in->made, i_model, configuration, job->rows->row.n);
    live.request.input.scene = (struct appearance_scene){.fibers = scene};
    struct estimator e = trace_estimator(&live);
    const struct fit_problem problem = {.n_param = m->sets.info.n_param,
                                        .info = m->sets.info.param,
                                        .parameter = m->parameter,
                                        .observation = &job->rows->row,
                                        .estimator = &e,
                                        .path_budget = path_budget,
                                        .progress = progress};
    status s = fit_run(descent_find(job->fit->method), &problem, &option, r, err);
    free(configuration);
    return s;
}

/* Scores the rows of one set, given two replicas of all observations. */
static status score(const struct observation_set *all, enum job_set set, const struct fit_result *r,
                    struct estimate *const replica[2], struct objective_value *value, struct error *err)
{
    struct observation_set part;
    struct estimate *shown[2] = {malloc(all->n * sizeof **shown), malloc(all->n * sizeof **shown)};
    size_t n = 0, *place = malloc(all->n * sizeof *place);
    observation_set_init(&part);
    status s = shown[0] != NULL && shown[1] != NULL && place != NULL
                   ? observation_set_select(all, set, &part, err)
                   : error_set(err, STATUS_NO_MEMORY, "cannot compare fits: out of memory");
    observation_set_weigh(&part);
    for (size_t i = 0; i < all->n && s == STATUS_OK; i++) {
        place[i] = SIZE_MAX;
        if (all->item[i].set != set || !(all->item[i].weight > 0.0)) continue;
        for (int q = 0; q < 2; q++) nuisance_show(&r->nuisance, &replica[q][i], &shown[q][n]);
        place[i] = n++;
    }
    for (size_t i = 0; i < 2 * n && s == STATUS_OK; i++) estimate_move_partners(&shown[i % 2][i / 2], place);
    *value = (struct objective_value){.rel_rms = NAN, .rel_rms_se = NAN};
    if (s == STATUS_OK && n > 0) objective_evaluate(&part, shown[0], shown[1], value);
    observation_set_release(&part);
    free(place);
    free(shown[0]);
    free(shown[1]);
    return s;
}

static status score_uncorrected(const struct fit_input *in, size_t i_model, const struct scene *scene,
                                const struct progress *progress, const struct fit_result *r,
                                struct uncorrected_errors *u, struct error *err)
{
    const struct cloth_job *job = in->job;
    const size_t n = job->rows->observation.n;
    struct objective_value fit, held_out;
    struct trace_estimator live;
    struct configuration *configuration = trace_configurations(&job->rows->observation);
    struct estimate *replica[2] = {calloc(n, sizeof **replica), calloc(n, sizeof **replica)};
    size_t *n_path = malloc(n * sizeof *n_path);
    double wall_s;
    status s = configuration != NULL && replica[0] != NULL && replica[1] != NULL && n_path != NULL
                   ? STATUS_OK
                   : error_set(err, STATUS_NO_MEMORY, "cannot compare fits: out of memory");
    for (size_t i = 0; i < n && s == STATUS_OK; i++)
        n_path[i] = (size_t)fmin(fmax(score_share * (double)r->n_path / (double)n, score_least), score_most);
    pipeline_trace_request(&live, job, in->made, i_model, configuration, n);
    live.request.input.scene = (struct appearance_scene){.fibers = scene};
    struct estimator e = trace_estimator(&live);
    for (uint32_t q = 0; q < 2 && s == STATUS_OK; q++) {
        const struct estimator_call call = {
            .param = r->param, .n_path = n_path, .iteration = 2, .replica = q == 0 ? REPLICA_FINAL_A : REPLICA_FINAL_B};
        s = e.run(e.context, &call, progress, replica[q], &wall_s, err);
    }
    if (s == STATUS_OK) s = score(&job->rows->observation, JOB_SET_FIT, r, replica, &fit, err);
    if (s == STATUS_OK) s = score(&job->rows->observation, JOB_SET_HELD_OUT, r, replica, &held_out, err);
    if (s == STATUS_OK) *u = (struct uncorrected_errors){true, fit.rel_rms, held_out.rel_rms, held_out.rel_rms_se};
    free(configuration);
    free(replica[0]);
    free(replica[1]);
    free(n_path);
    return s;
}

status pipeline_correction_compare(const struct fit_input *in, size_t i_model, const struct progress *progress,
                                   struct model_fit *fit, struct error *err)
{
    struct progress_part first, last;
    struct progress main_part = progress_begin_part(&first, progress, 0.0, 0.8);
    struct scene *scene = NULL;
    struct fit_result *r = malloc(sizeof *r);
    if (r == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot compare fits: out of memory");
    status s = made_cloth_fiber_scene(in->job, i_model, &in->made->uncorrected, &scene, err);
    if (s == STATUS_OK) s = fit_uncorrected(in, i_model, fit->cloth.final.n_path, scene, &main_part, r, err);
    struct progress rest = progress_begin_part(&last, progress, 0.8, 0.2);
    if (s == STATUS_OK) s = score_uncorrected(in, i_model, scene, &rest, r, &fit->scan_error.uncorrected, err);
    if (s == STATUS_OK)
        log_info(in->job->tools->log,
                 "without corrections: relative RMS error %.4f over the fitted rows, %.4f over the held-out rows",
                 fit->scan_error.uncorrected.fit_rel_rms, fit->scan_error.uncorrected.heldout_rel_rms);
    scene_free(scene);
    free(r);
    return s;
}
