#include "optimizer/worker/stages/result/pipeline_skill.h"
#include "optimizer/worker/stages/result/pipeline_choice.h"

#include <math.h>

/* The warning needs a difference that the noise of the rendered rows cannot explain. */
static const double skill_standard_errors = 2.0;

static void warn_without_skill(struct pipeline_context *c)
{
    const struct pipeline_model *best = &c->model[pipeline_best_model(c)];
    const struct objective_value *twin = &best->validation.held_out;
    double plain = c->skill.heldout_rel_rms;
    if (!isfinite(plain) || !(twin->rel_rms - skill_standard_errors * twin->rel_rms_se > plain)) return;
    worker_status_warn(c->status,
                       "a plain BRDF that knows nothing of the cloth, fitted to the same rows, predicts the held-out "
                       "rows better (%.3g %%) than this fit (%.3g %%): %s",
                       100.0 * plain, 100.0 * twin->rel_rms,
                       best->fit.converged ? "the model of the fibers or the cloth does not describe this fabric"
                                           : "the fit has not converged; if more paths do not help, the model of the "
                                             "fibers or the cloth does not describe this fabric");
}

status pipeline_measure_skill(struct pipeline_context *c, struct error *err)
{
    struct observation_set fitted;
    c->skill = (struct pipeline_skill){.fit_rel_rms = NAN, .heldout_rel_rms = NAN, .left_out_rel_rms = NAN};
    for (size_t i = 0; i < c->observation.n; i++)
        if (!plain_brdf_applies(&c->observation.item[i].configuration)) return STATUS_OK;
    observation_set_init(&fitted);
    status s = observation_set_select(&c->observation, JOB_SET_FIT, &fitted, err);
    if (s == STATUS_OK) s = plain_brdf_fit(&fitted, &c->skill.brdf, err);
    if (s == STATUS_OK) s = plain_brdf_left_out(&fitted, &c->skill.left_out_rel_rms, err);
    observation_set_release(&fitted);
    if (s != STATUS_OK) return s;
    c->skill.measured = true;
    c->skill.fit_rel_rms = plain_brdf_rel_rms(&c->skill.brdf, &c->observation, JOB_SET_FIT);
    c->skill.heldout_rel_rms = plain_brdf_rel_rms(&c->skill.brdf, &c->observation, JOB_SET_HELD_OUT);
    log_info(c->log,
             "plain BRDF on the same rows: relative RMS error %.4f over the fitted rows, %.4f over the held-out rows",
             c->skill.fit_rel_rms, c->skill.heldout_rel_rms);
    warn_without_skill(c);
    return STATUS_OK;
}
