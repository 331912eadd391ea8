#include "optimizer/worker/stages/result/pipeline_discrepancy.h"
#include "base/option_id.h"
#include "optimizer/fit/discrepancy/discrepancy_fit.h"
#include "optimizer/job/options/option_key.h"

#include <math.h>
#include <stdlib.h>

const struct discrepancy *pipeline_discrepancy(const struct pipeline_model *m)
{
    return m->discrepancy.factor.n > 0 ? &m->discrepancy.factor : NULL;
}

bool pipeline_discrepancy_expected(const struct pipeline_context *c, const struct pipeline_model *m)
{
    return c->doc->fit.discrepancy && m->appearance.kind == MODEL_SURFACE &&
           m->fit.cross_validation.discrepancy_share > 0.0;
}

static status fit_factor(const struct pipeline_context *c, struct pipeline_model *m, struct error *err)
{
    struct discrepancy_row *row = malloc((c->observation.n + 1) * sizeof *row);
    size_t n = 0;
    if (row == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot find a discrepancy: out of memory");
    for (size_t i = 0; i < c->observation.n; i++) {
        const struct observation *o = &c->observation.item[i];
        double rendered[3];
        if (o->set != JOB_SET_FIT || !discrepancy_applies(o)) continue;
        for (int k = 0; k < 3; k++)
            rendered[k] = 0.5 * (m->validation.replica[0][i].mean[k] + m->validation.replica[1][i].mean[k]);
        discrepancy_row_of(o, rendered, &row[n++]);
    }
    status s = discrepancy_fit(row, n, m->fit.cross_validation.discrepancy_share, &m->discrepancy.factor, err);
    free(row);
    return s;
}

static void apply(const struct pipeline_context *c, struct pipeline_model *m)
{
    for (size_t i = 0; i < c->observation.n; i++) {
        const struct configuration *g = &c->observation.item[i].configuration;
        const double light = cos(g->light_theta_rad), camera = cos(g->camera_theta_rad);
        const double between = light * camera + sin(g->light_theta_rad) * sin(g->camera_theta_rad) *
                                                    cos(g->camera_phi_rad - g->light_phi_rad);
        double factor[3];
        if (!plain_brdf_applies(g)) continue;
        discrepancy_factor(&m->discrepancy.factor, light, camera, between, factor);
        for (int q = 0; q < 2; q++)
            for (int k = 0; k < 3; k++) {
                m->validation.replica[q][i].mean[k] *= factor[k];
                m->validation.replica[q][i].var[k] *= factor[k] * factor[k];
            }
    }
}

status pipeline_find_discrepancy(struct pipeline_context *c, struct pipeline_model *m, struct error *err)
{
    const struct cross_validation *v = &m->fit.cross_validation;
    m->discrepancy = (struct pipeline_discrepancy){.fit_rel_rms = m->validation.fit.rel_rms,
                                                   .heldout_rel_rms = m->validation.held_out.rel_rms};
    if (!c->doc->fit.discrepancy) return STATUS_OK;
    if (!pipeline_discrepancy_expected(c, m)) {
        worker_status_warn(c->status, "%s: the fit of %s goes without one, because %s",
                           job_option_key(OPTION_DISCREPANCY), m->appearance.id,
                           m->appearance.kind != MODEL_SURFACE ? "it is a model of a volume"
                           : v->n_fold == 0                    ? "there are too few rows to judge it"
                                                               : "it does not predict left-out rows better");
        return STATUS_OK;
    }
    status s = fit_factor(c, m, err);
    if (s != STATUS_OK) return s;
    apply(c, m);
    log_info(c->log,
             "discrepancy of %s: with a share of %.2f the error of left-out rows is %.4f instead of %.4f; without it "
             "the relative RMS error is %.4f over the fitted rows, %.4f over the held-out rows",
             m->appearance.id, v->discrepancy_share, v->rel_rms, v->plain_rel_rms, m->discrepancy.fit_rel_rms,
             m->discrepancy.heldout_rel_rms);
    return STATUS_OK;
}
