#include "optimizer/stages/validation/pipeline_discrepancy.h"
#include "base/option_id.h"
#include "optimizer/fit/baseline/discrepancy_fit.h"
#include "optimizer/fit/baseline/plain_brdf.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/options/option_key.h"

#include <math.h>
#include <stdlib.h>

const struct discrepancy *pipeline_discrepancy(const struct validation *v)
{
    return v != NULL && v->discrepancy.factor.n > 0 ? &v->discrepancy.factor : NULL;
}

bool pipeline_discrepancy_expected(const struct job_fit *fit, const struct pipeline_model *m)
{
    return fit->discrepancy && m->setup->appearance.kind == MODEL_SURFACE &&
           m->fit->result.cross_validation.discrepancy_share > 0.0;
}

static status fit_factor(const struct observation_set *all, double share, struct validation *v, struct error *err)
{
    struct discrepancy_row *row = malloc((all->n + 1) * sizeof *row);
    size_t n = 0;
    if (row == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot find a discrepancy: out of memory");
    for (size_t i = 0; i < all->n; i++) {
        const struct observation *o = &all->item[i];
        double rendered[3];
        if (o->set != JOB_SET_FIT || !discrepancy_applies(o)) continue;
        for (int k = 0; k < 3; k++) rendered[k] = 0.5 * (v->replica[0][i].mean[k] + v->replica[1][i].mean[k]);
        discrepancy_row_of(o, rendered, &row[n++]);
    }
    status s = discrepancy_fit(row, n, share, &v->discrepancy.factor, err);
    free(row);
    return s;
}

static void apply(const struct observation_set *all, struct validation *v)
{
    for (size_t i = 0; i < all->n; i++) {
        const struct configuration *g = &all->item[i].configuration;
        const double light = cos(g->light_theta_rad), camera = cos(g->camera_theta_rad);
        const double between = light * camera + sin(g->light_theta_rad) * sin(g->camera_theta_rad) *
                                                    cos(g->camera_phi_rad - g->light_phi_rad);
        double factor[3];
        if (!plain_brdf_applies(g)) continue;
        discrepancy_factor(&v->discrepancy.factor, light, camera, between, factor);
        for (int q = 0; q < 2; q++)
            for (int k = 0; k < 3; k++) {
                v->replica[q][i].mean[k] *= factor[k];
                v->replica[q][i].var[k] *= factor[k] * factor[k];
            }
    }
}

status pipeline_find_discrepancy(const struct cloth_job *job, const struct pipeline_model *m, struct validation *v,
                                 struct error *err)
{
    const struct cross_validation *left_out = &m->fit->result.cross_validation;
    v->discrepancy = (struct model_discrepancy){.fit_rel_rms = v->fit.rel_rms, .heldout_rel_rms = v->held_out.rel_rms};
    if (!job->fit->discrepancy) return STATUS_OK;
    if (!pipeline_discrepancy_expected(job->fit, m)) {
        worker_status_warn(job->tools->status, "%s: the fit of %s goes without one, because %s",
                           job_option_key(OPTION_DISCREPANCY), m->setup->appearance.id,
                           m->setup->appearance.kind != MODEL_SURFACE ? "it is a model of a volume"
                           : left_out->n_fold == 0                    ? "there are too few rows to judge it"
                                                                      : "it does not predict left-out rows better");
        return STATUS_OK;
    }
    status s = fit_factor(&job->rows->observation, left_out->discrepancy_share, v, err);
    if (s != STATUS_OK) return s;
    apply(&job->rows->observation, v);
    log_info(job->tools->log,
             "discrepancy of %s: with a share of %.2f the error of left-out rows is %.4f instead of %.4f; without it "
             "the relative RMS error is %.4f over the fitted rows, %.4f over the held-out rows",
             m->setup->appearance.id, left_out->discrepancy_share, left_out->rel_rms, left_out->plain_rel_rms,
             v->discrepancy.fit_rel_rms, v->discrepancy.heldout_rel_rms);
    return STATUS_OK;
}
