/* The stages of a job with the profile of a single fiber: "fit" fits every model to it, "report" writes the results. A
 * fit takes seconds, so an interrupted job begins anew. */
#include "base/option_id.h"
#include "optimizer/job/options/option_key.h"
#include "optimizer/worker/pipeline_context.h"
#include "optimizer/worker/report/page/report_page.h"
#include "optimizer/worker/report/profile/profile_report.h"
#include "optimizer/worker/report/result_json.h"
#include "optimizer/worker/stages/fit/pipeline_fit_option.h"

#include <stdio.h>

/* Copies what the results show of any fit. */
static void take_fit(struct pipeline_model *m)
{
    const struct profile_fit *f = &m->profile;
    for (size_t p = 0; p < m->sets.info.n_param; p++) {
        m->fit.param[p] = f->param[p];
        m->fit.uncertainty.se_param[p] = f->se_param[p];
        m->fit.uncertainty.at_bound[p] = f->at_bound[p];
        m->fit.uncertainty.determined[p] = f->determined[p];
    }
    m->fit.uncertainty.n_param = m->sets.info.n_param;
    m->fit.converged = f->converged;
}

static void warn(struct pipeline_context *c, const struct pipeline_model *m)
{
    const struct profile_fit *f = &m->profile;
    if (!f->converged)
        worker_status_warn(c->status, "the fit of '%s' used up its steps before its residual was at its least",
                           m->appearance.id);
    if (f->n_agree < 2)
        worker_status_warn(c->status,
                           "'%s': only one of %zu starts came to the least residual of '%s': there may be a better "
                           "one; give more",
                           job_option_key(OPTION_STARTS), f->n_start, m->appearance.id);
}

status stage_profile_fit(struct pipeline_context *c, struct error *err)
{
    status s = STATUS_OK;
    for (size_t i = 0; i < c->n_model && s == STATUS_OK; i++) {
        struct pipeline_model *m = &c->model[i];
        struct fit_option option;
        struct progress_part part;
        const double share = 1.0 / (double)c->n_model;
        const struct progress progress = progress_begin_part(&part, &c->progress, (double)i * share, share);
        pipeline_fit_option(m->option, m->sets.info.param, m->sets.info.n_param, &option);
        const struct profile_problem problem = {.model = m->appearance.surface,
                                                .profile = &c->profile,
                                                .parameter = m->parameter,
                                                .option = &option,
                                                .scale = c->doc->profile.scale,
                                                .max_iteration = c->doc->fit.max_iteration,
                                                .pool = c->pool,
                                                .progress = &progress};
        s = profile_fit_run(&problem, job_profile_name(&c->doc->profile), &m->profile, err);
        if (s != STATUS_OK) return s;
        take_fit(m);
        warn(c, m);
        log_info(c->log, "'%s' fits the profile with a relative residual of %.2f %%, %zu evaluations, %.1f s",
                 m->appearance.id, 100.0 * m->profile.rel_rms, m->profile.n_evaluation, m->profile.wall_s);
    }
    return s;
}

status stage_profile_report(struct pipeline_context *c, struct error *err)
{
    status s = profile_json_write(c, err);
    if (s == STATUS_OK) s = result_summary_write(c, err);
    if (s == STATUS_OK) s = profile_csv_write(c, err);
    return s == STATUS_OK ? report_write(c, err) : s;
}
