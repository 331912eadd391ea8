#include "geometry/fibers/lines/weak_lines.h"

/* Mean density at the vertices of a line. */
static double density_along(const struct polyline_set *p, size_t line, const struct volume *v)
{
    double sum = 0.0;
    for (size_t i = p->first[line]; i < p->first[line + 1]; i++) {
        size_t at[3];
        for (int a = 0; a < 3; a++) {
            const float x = p->vertex[i][a], last = (float)(v->n[a] - 1);
            at[a] = x <= 0.0f ? 0 : x >= last ? v->n[a] - 1 : (size_t)x;
        }
        sum += (double)v->density[volume_index(v->n, at[0], at[1], at[2])];
    }
    return sum / (double)polyline_length(p, line);
}

status polylines_drop_weak(const struct polyline_set *in, const struct volume *v, double least_radius,
                           double least_density, struct polyline_set *out, struct error *err)
{
    status s = STATUS_OK;
    for (size_t l = 0; l < in->n_line && s == STATUS_OK; l++) {
        const bool has_no_edge = in->radius[l] > 0.0f && (double)in->radius[l] <= least_radius;
        if (has_no_edge && density_along(in, l, v) < least_density) continue;
        s = polyline_add_part(out, in, l, in->first[l], in->first[l + 1], err);
    }
    return s;
}
