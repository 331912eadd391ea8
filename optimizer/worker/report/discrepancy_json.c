#include "optimizer/worker/report/discrepancy_json.h"
#include "optimizer/worker/report/json_number.h"
#include "optimizer/worker/stages/result/pipeline_discrepancy.h"

#include <math.h>

/* Root mean square of ln factor over the places and channels: how much is left to the factor. */
static double rms_log_factor(const struct discrepancy *d)
{
    double sum = 0.0;
    for (size_t i = 0; i < d->n; i++)
        for (size_t c = 0; c < 3; c++) {
            double log_factor = 0.0;
            for (size_t k = 0; k < d->n; k++)
                log_factor += d->weight[k][c] * discrepancy_kernel(d->scale, d->place[i], d->place[k]);
            sum += log_factor * log_factor;
        }
    return sqrt(sum / (3.0 * (double)d->n));
}

json_t *discrepancy_json(const struct pipeline_model *m)
{
    const struct discrepancy *d = pipeline_discrepancy(m);
    json_t *place = json_array(), *weight = json_array();
    if (d == NULL) {
        json_decref(place);
        json_decref(weight);
        return json_null();
    }
    for (size_t i = 0; i < d->n; i++) {
        json_array_append_new(place, json_number_list(d->place[i], DISCREPANCY_COORDINATES, 1.0));
        json_array_append_new(weight, json_number_list(d->weight[i], 3, 1.0));
    }
    return json_pack("{s:f, s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "share", m->fit.cross_validation.discrepancy_share,
                     "rms_log_factor", json_number(rms_log_factor(d)), "fit_rel_rms_without",
                     json_number(m->discrepancy.fit_rel_rms), "heldout_rel_rms_without",
                     json_number(m->discrepancy.heldout_rel_rms), "cross_validation_rel_rms_without",
                     json_number(m->fit.cross_validation.plain_rel_rms), "scale",
                     json_number_list(d->scale, DISCREPANCY_COORDINATES, 1.0), "place", place, "log_weight", weight);
}
