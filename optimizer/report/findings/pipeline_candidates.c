/* The next photograph: every candidate configuration of the job is rendered at the result, with derivatives, and ranked
 * by the information that it would add (next_photograph.h). */
#include "optimizer/job/document/job_fit.h"
#include "optimizer/report/findings/findings.h"
#include "optimizer/stages/fit/pipeline_cloth.h"
#include "optimizer/stages/fit/pipeline_fit_option.h"
#include "optimizer/stages/fit/pipeline_trace.h"

#include <math.h>
#include <stdlib.h>

enum { LEAST_PATH = 1024, MOST_PATH = 65536 }; /* paths of a candidate and replica */

static status candidate_set(const struct report *pipeline, struct observation_set *o, struct error *err)
{
    const struct job_fit *fit = pipeline->in.job->fit;
    status s = STATUS_OK;
    for (size_t i = 0; i < fit->n_candidate && s == STATUS_OK; i++) {
        const struct job_candidate *c = &fit->candidate[i];
        struct observation item = {.weight = 1.0};
        item.configuration = observation_configuration(pipeline->in.job->setup, c->light_theta_deg, c->light_phi_deg,
                                                       c->camera_theta_deg, c->camera_phi_deg, c->cloth_rotation_deg);
        item.configuration.environment = pipeline->in.job->rows->environment;
        s = observation_set_append(o, &item, err);
    }
    return s;
}

static int compare_rank(const void *a, const void *b)
{
    const struct pipeline_candidate *x = a, *y = b;
    if (x->score.information != y->score.information) return x->score.information > y->score.information ? -1 : 1;
    return x->i_candidate < y->i_candidate ? -1 : x->i_candidate > y->i_candidate;
}

/* The misfit that the model leaves at the fitted rows, by the fresh estimates of the validation. */
static status make_misfit_field(const struct report *report, const struct pipeline_model *m, struct misfit_field *field,
                                struct error *err)
{
    struct observation_set fitted;
    size_t n = 0;
    struct estimate *a = malloc(2 * report->in.job->rows->observation.n * sizeof *a),
                    *b = a != NULL ? a + report->in.job->rows->observation.n : NULL;
    observation_set_init(&fitted);
    status s = a != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot rank candidates: out of memory");
    for (size_t i = 0; i < report->in.job->rows->observation.n && s == STATUS_OK; i++) {
        if (report->in.job->rows->observation.item[i].set != JOB_SET_FIT ||
            !(report->in.job->rows->observation.item[i].weight > 0.0))
            continue;
        s = observation_set_append(&fitted, &report->in.job->rows->observation.item[i], err);
        nuisance_show(&m->fit->result.nuisance, &m->validation->replica[0][i], &a[n]);
        nuisance_show(&m->fit->result.nuisance, &m->validation->replica[1][i], &b[n++]);
    }
    if (s == STATUS_OK) misfit_field_init(field, &fitted, a, b, m->fit->result.uncertainty.misfit_var);
    observation_set_release(&fitted);
    free(a);
    return s;
}

/* Scores every candidate by its two estimates. */
static status score_candidates(const struct report *report, struct pipeline_model *m, const struct observation_set *o,
                               struct estimate *const replica[2], const struct next_photograph_fit *bare,
                               struct error *err)
{
    struct misfit_prediction misfit;
    struct next_photograph_fit fit = *bare;
    struct misfit_field *field = malloc(sizeof *field);
    status s = field != NULL ? make_misfit_field(report, m, field, err)
                             : error_set(err, STATUS_NO_MEMORY, "cannot rank candidates: out of memory");
    fit.misfit = &misfit;
    for (size_t i = 0; i < o->n && s == STATUS_OK; i++) {
        m->advice->candidate[i].i_candidate = i;
        misfit_field_predict(field, &o->item[i].configuration, &misfit);
        next_photograph_score(&fit, &replica[0][i], &replica[1][i], &m->advice->candidate[i].score);
    }
    if (s == STATUS_OK)
        log_info(report->in.job->tools->log,
                 "misfit of %s: %.0f %% of its variance is smooth over directions, with a length of %.2f",
                 m->setup->appearance.id, 100.0 * field->smooth_share, field->length);
    if (s == STATUS_OK) qsort(m->advice->candidate, o->n, sizeof *m->advice->candidate, compare_rank);
    free(field);
    return s;
}

static status rank(struct report *report, size_t i_model, const struct observation_set *o, struct estimate *replica[2],
                   size_t *n_path, struct error *err)
{
    struct pipeline_model *m = &report->model[i_model];
    double share = 0.25 * (double)m->fit->result.n_path / (double)o->n; /* half the paths of the fit for all of them */
    for (size_t i = 0; i < o->n; i++) n_path[i] = (size_t)fmin(fmax(share, LEAST_PATH), MOST_PATH);
    struct pipeline_trace trace;
    struct fit_option option;
    struct fit_layout layout;
    double wall_s;
    pipeline_fit_option(m->setup->option, m->setup->sets.info.param, m->setup->sets.info.n_param, &option);
    const struct next_photograph_fit fit = {&layout, m->fit->result.unknown, &m->fit->result.unknown_uncertainty,
                                            option.photograph_gain_sd, NULL};
    struct progress quiet = {.cancel = report->in.job->tools->progress.cancel};
    status s = fit_layout_init(&layout, m->setup->sets.info.param, m->setup->parameter, m->setup->sets.info.n_param,
                               &option, err);
    if (s != STATUS_OK) return s;
    s = pipeline_cloth_use(report->in.job, &report->in.fit[i_model], i_model, report->in.made, err);
    if (s != STATUS_OK) return s;
    s = pipeline_trace_open(&trace, report->in.job, report->in.made, "report", "candidates.journal", i_model, o, err);
    for (uint32_t q = 0; q < 2 && s == STATUS_OK; q++) {
        struct estimator e = estimate_journal_estimator(trace.journal);
        struct estimator_call call = {m->fit->result.param, n_path, 0,
                                      q == 0 ? REPLICA_CANDIDATE_A : REPLICA_CANDIDATE_B, true};
        s = e.run(e.context, &call, &quiet, replica[q], &wall_s, err);
    }
    if (s == STATUS_OK) s = score_candidates(report, m, o, replica, &fit, err);
    pipeline_trace_close(&trace);
    return s;
}

status pipeline_rank_candidates(struct report *report, struct error *err)
{
    size_t n = report->in.job->fit->n_candidate;
    if (n == 0) return STATUS_OK;
    struct observation_set o;
    struct estimate *replica[2] = {calloc(n, sizeof(struct estimate)), calloc(n, sizeof(struct estimate))};
    size_t *n_path = malloc(n * sizeof *n_path);
    observation_set_init(&o);
    status s = replica[0] != NULL && replica[1] != NULL && n_path != NULL
                   ? candidate_set(report, &o, err)
                   : error_set(err, STATUS_NO_MEMORY, "cannot rank candidates: out of memory");
    for (size_t i = 0; i < report->n_model && s == STATUS_OK; i++) {
        struct model_advice *advice = &report->advice[i];
        free(advice->candidate);
        advice->candidate = calloc(n, sizeof *advice->candidate);
        s = advice->candidate != NULL ? rank(report, i, &o, replica, n_path, err)
                                      : error_set(err, STATUS_NO_MEMORY, "cannot rank candidates: out of memory");
    }
    observation_set_release(&o);
    free(n_path);
    free(replica[0]);
    free(replica[1]);
    return s;
}
