/* The stage "fit" of a job with the profile of a single fiber: fits every model to it. A
 * fit takes seconds, so an interrupted job begins anew. */
#include "base/angle.h"
#include "base/option_id.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_profile.h"
#include "optimizer/job/options/option_key.h"
#include "optimizer/stages/fit/pipeline_fit_option.h"
#include "optimizer/stages/fit_stages.h"

#include <stdlib.h>

/* Copies the members that the results show of any fit. */
static void take_fit(const struct model_setup *m, struct model_fit *fit)
{
    const struct profile_fit *f = &fit->profile;
    for (size_t p = 0; p < m->sets.info.n_param; p++) {
        fit->result.param[p] = f->param[p];
        fit->result.uncertainty.se_param[p] = f->se_param[p];
        fit->result.uncertainty.at_bound[p] = f->at_bound[p];
        fit->result.uncertainty.determined[p] = f->determined[p];
    }
    fit->result.uncertainty.n_param = m->sets.info.n_param;
    fit->result.converged = f->converged;
}

static void warn(struct worker_status *st, const struct model_setup *m, const struct profile_fit *f)
{
    if (!f->converged)
        worker_status_warn(st, "the fit of '%s' used up its steps before its residual was at its least",
                           m->appearance.id);
    if (f->n_agree < 2)
        worker_status_warn(st,
                           "'%s': only one of %zu starts came to the least residual of '%s': there may be a better "
                           "one; give more",
                           job_option_key(OPTION_STARTS), f->n_start, m->appearance.id);
}

status stage_profile_fit(const struct profile_fit_input *in, struct fit_output *out, struct error *err)
{
    status s = STATUS_OK;
    double all_s = 0.0, before_s = 0.0;
    for (size_t i = 0; i < in->n_model; i++) all_s += in->expected_s[i];
    out->model = calloc(in->n_model, sizeof *out->model);
    if (out->model == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot fit a profile: out of memory");
    for (size_t i = 0; i < in->n_model && s == STATUS_OK; i++) {
        const struct model_setup *m = &in->model[i];
        struct model_fit *fit = &out->model[i];
        struct fit_option option;
        struct progress_part part;
        const struct progress progress =
            progress_begin_part(&part, &in->tools->progress, before_s / all_s, in->expected_s[i] / all_s);
        before_s += in->expected_s[i];
        pipeline_fit_option(m->option, m->sets.info.param, m->sets.info.n_param, &option);
        const struct profile_problem problem = {.model = m->appearance.surface,
                                                .profile = &in->fiber->profile,
                                                .parameter = m->parameter,
                                                .option = &option,
                                                .scale = in->asked->scale,
                                                .turn_rad = in->asked->turn_deg * RAD_PER_DEG,
                                                .mode = job_profile_mode(in->asked),
                                                .max_iteration = in->fit->max_iteration,
                                                .pool = in->tools->pool,
                                                .progress = &progress};
        s = profile_fit_run(&problem, job_profile_name(in->asked), &fit->profile, err);
        if (s != STATUS_OK) return s;
        take_fit(m, fit);
        warn(in->tools->status, m, &fit->profile);
        log_info(in->tools->log, "'%s' fits the profile with a relative residual of %.2f %%, %zu evaluations, %.1f s",
                 m->appearance.id, 100.0 * fit->profile.rel_rms, fit->profile.n_evaluation, fit->profile.wall_s);
    }
    return s;
}
