#include "optimizer/fit/baseline/plain_brdf.h"
#include "optimizer/fit/objective/folds.h"
#include "optimizer/fit/objective/objective.h"

#include <math.h>
#include <stdlib.h>

struct left_out {
    double square, count; /* sum over the rows that were left out and predicted, and their number of radiances */
};

static bool scored(const struct observation *o) { return o->weight > 0.0 && !observation_is_contrast(o); }

status plain_brdf_fit_without(const struct observation_set *rows, const size_t *fold, size_t i_fold,
                              struct plain_brdf *b, struct error *err)
{
    struct observation_set part;
    status s = STATUS_OK;
    observation_set_init(&part);
    for (size_t i = 0; i < rows->n && s == STATUS_OK; i++)
        if (fold[i] != i_fold) s = observation_set_append(&part, &rows->item[i], err);
    if (s == STATUS_OK) s = plain_brdf_fit(&part, b, err);
    observation_set_release(&part);
    return s;
}

/* Fits the rows outside one fold and predicts those in it. */
static status predict_fold(const struct observation_set *rows, const size_t *fold, size_t i_fold, struct left_out *out,
                           struct error *err)
{
    struct plain_brdf b;
    status s = plain_brdf_fit_without(rows, fold, i_fold, &b, err);
    for (size_t i = 0; s == STATUS_OK && i < rows->n; i++) {
        const struct observation *o = &rows->item[i];
        double rgb[3];
        if (fold[i] != i_fold || !scored(o)) continue;
        plain_brdf_radiance(&b, &o->configuration, rgb);
        out->square += objective_relative_weight(o) * objective_image_difference(rgb, o->mean_rgb);
        out->count += 3.0;
    }
    return s;
}

status plain_brdf_left_out(const struct observation_set *rows, double *rel_rms, struct error *err)
{
    struct left_out out = {0.0, 0.0};
    status s = STATUS_OK;
    *rel_rms = NAN;
    size_t *fold = malloc((rows->n + 1) * sizeof *fold);
    if (fold == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot fit the plain BRDF: out of memory");
    const size_t n_fold = folds_deal(rows, fold);
    for (size_t k = 0; n_fold >= FOLDS_LEAST && k < n_fold && s == STATUS_OK; k++)
        s = predict_fold(rows, fold, k, &out, err);
    if (s == STATUS_OK && out.count > 0.0) *rel_rms = sqrt(out.square / out.count);
    free(fold);
    return s;
}
