#include "optimizer/report/findings/findings.h"
#include "optimizer/stages/validation/pipeline_choice.h"

#include <math.h>

/* The warning needs a difference that the noise of the rendered rows cannot explain. */
static const double skill_standard_errors = 2.0;

static void warn_without_skill(struct report *report)
{
    const struct pipeline_model *best = &report->model[report_best_model(report)];
    const struct objective_value *twin = &best->validation->held_out;
    double plain = report->skill.heldout_rel_rms;
    if (!isfinite(plain) || !(twin->rel_rms - skill_standard_errors * twin->rel_rms_se > plain)) return;
    worker_status_warn(report->in.job->tools->status,
                       "a plain BRDF that knows nothing of the cloth, fitted to the same rows, predicts the held-out "
                       "rows better (%.3g %%) than this fit (%.3g %%): %s",
                       100.0 * plain, 100.0 * twin->rel_rms,
                       best->fit->result.converged
                           ? "the model of the fibers or the cloth does not describe this fabric"
                           : "the fit has not converged; if more paths do not help, the model of the "
                             "fibers or the cloth does not describe this fabric");
}

status pipeline_measure_skill(struct report *report, struct error *err)
{
    struct observation_set fitted;
    report->skill = (struct pipeline_skill){.fit_rel_rms = NAN, .heldout_rel_rms = NAN, .left_out_rel_rms = NAN};
    for (size_t i = 0; i < report->in.job->rows->observation.n; i++)
        if (!plain_brdf_applies(&report->in.job->rows->observation.item[i].configuration)) return STATUS_OK;
    observation_set_init(&fitted);
    status s = observation_set_select(&report->in.job->rows->observation, JOB_SET_FIT, &fitted, err);
    if (s == STATUS_OK) s = plain_brdf_fit(&fitted, &report->skill.brdf, err);
    if (s == STATUS_OK) s = plain_brdf_left_out(&fitted, &report->skill.left_out_rel_rms, err);
    observation_set_release(&fitted);
    if (s != STATUS_OK) return s;
    report->skill.measured = true;
    report->skill.fit_rel_rms =
        plain_brdf_rel_rms(&report->skill.brdf, &report->in.job->rows->observation, JOB_SET_FIT);
    report->skill.heldout_rel_rms =
        plain_brdf_rel_rms(&report->skill.brdf, &report->in.job->rows->observation, JOB_SET_HELD_OUT);
    log_info(report->in.job->tools->log,
             "plain BRDF on the same rows: relative RMS error %.4f over the fitted rows, %.4f over the held-out rows",
             report->skill.fit_rel_rms, report->skill.heldout_rel_rms);
    warn_without_skill(report);
    return STATUS_OK;
}
