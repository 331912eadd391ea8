#include "optimizer/report/surface/surface_field.h"
#include "base/catalogue/model_catalogue.h"
#include "optimizer/job/document/job_results.h"

#include <math.h>

double surface_field_coverage(const struct fiber_set *fiber, double pixel_m)
{
    double shown = 0.0, weight = 0.0; /* sums of length times diameter squared, and of length times diameter */
    for (size_t i = 0; i < fiber->n_fiber; i++)
        for (size_t k = fiber->first_vertex[i]; k + 1 < fiber->first_vertex[i + 1]; k++) {
            const float *p = fiber->position_m + 3 * k;
            double d[3] = {(double)p[3] - (double)p[0], (double)p[4] - (double)p[1], (double)p[5] - (double)p[2]};
            double area = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) * 2.0 * (double)fiber_radius_m(fiber, i, k);
            weight += area;
            shown += area * 2.0 * (double)fiber_radius_m(fiber, i, k);
        }
    return shown > 0.0 ? pixel_m * weight / shown : 0.0;
}

const struct appearance *surface_field_model(const struct report *report, size_t i, const struct appearance *best,
                                             struct appearance *far)
{
    const struct job_surface_picture *p = &report->in.results->surface_picture[i];
    const char *id = model_catalogue_far_field(best->id);
    if (!p->field_by_pixel || id == NULL) return best;
    double pixel_m = 1e-3 * p->width_mm / (double)p->px;
    if (surface_field_coverage(&report->in.made->fiber, pixel_m) < 1.0) return best;
    return appearance_find(id, far) ? far : best;
}
