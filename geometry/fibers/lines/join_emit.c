#include "geometry/fibers/lines/join_emit.h"

#include "geometry/fibers/lines/join_curve.h"

#include <math.h>

/* The section at a share of the way from one end of a gap to the other. */
static struct fiber_shape shape_between(const struct fiber_shape *a, const struct fiber_shape *b, float share)
{
    struct fiber_shape s = share < 0.5f ? *a : *b;
    s.radius = a->radius + share * (b->radius - a->radius);
    s.radius_se = fmaxf(a->radius_se, b->radius_se);
    s.ratio = a->ratio + share * (b->ratio - a->ratio);
    s.ratio_se = fmaxf(a->ratio_se, b->ratio_se);
    return s;
}

/* Index of vertex k from an end. */
static size_t end_index(const struct polyline_set *p, uint32_t end, size_t k)
{
    return (end & 1u) != 0 ? p->first[end / 2 + 1] - 1 - k : p->first[end / 2] + k;
}

/* Adds vertices about one voxel apart on the curve over a gap. */
static status fill_gap(const struct polyline_set *lines, uint32_t a, uint32_t b, const uint8_t *trim,
                       struct polyline_set *out, struct error *err)
{
    struct join_curve j;
    const uint8_t own_trim[2] = {trim[a], trim[b]};
    status s = STATUS_OK;
    if (!join_curve_fit(lines, a, b, own_trim, &j))
        return error_set(err, STATUS_INTERNAL, "cannot join fibers: an accepted join cannot be fitted again");
    int n = (int)lrint(j.gap);
    for (int i = 1; i < n && s == STATUS_OK; i++) {
        double y[3];
        join_curve_at(&j, j.from + (j.to - j.from) * i / n, y);
        s = polyline_add(out, (const float[3]){(float)y[0], (float)y[1], (float)y[2]}, err);
        if (s == STATUS_OK && lines->shape != NULL)
            out->shape[out->n_vertex - 1] =
                shape_between(&lines->shape[end_index(lines, a, trim[a])], &lines->shape[end_index(lines, b, trim[b])],
                              (float)i / (float)n);
    }
    return s;
}

/* Appends the vertices of a line from end e on, without those that are trimmed. */
static status append_line(const struct polyline_set *lines, uint32_t e, const uint8_t *trim, struct polyline_set *out,
                          struct error *err)
{
    size_t n = polyline_length(lines, e / 2);
    status s = STATUS_OK;
    for (size_t k = trim[e]; k + trim[e ^ 1u] < n && s == STATUS_OK; k++) {
        s = polyline_add(out, line_end_vertex(lines, e, k), err);
        if (s == STATUS_OK && lines->shape != NULL)
            out->shape[out->n_vertex - 1] = lines->shape[end_index(lines, e, k)];
    }
    return s;
}

status joins_emit(const struct polyline_set *lines, const struct join_partners *joins, bool *done,
                  struct polyline_set *out, struct error *err)
{
    const uint32_t *partner = joins->partner;
    const uint8_t *trim = joins->trim;
    status s = lines->shape != NULL ? polyline_shapes_init(out, err) : STATUS_OK;
    for (uint32_t e = 0; e < 2 * lines->n_line && s == STATUS_OK; e++) {
        if (partner[e] != UINT32_MAX || done[e / 2]) continue;
        double sum = 0.0, weight = 0.0;
        s = polyline_begin_like(out, lines, e / 2, err);
        for (uint32_t at = e; at != UINT32_MAX && s == STATUS_OK; at = partner[at ^ 1u]) {
            double length = lines->radius[at / 2] > 0.0f ? (double)polyline_length(lines, at / 2) : 0.0;
            sum += length * (double)lines->radius[at / 2];
            weight += length;
            if (at != e) s = fill_gap(lines, partner[at], at, trim, out, err);
            if (s == STATUS_OK) s = append_line(lines, at, trim, out, err);
            done[at / 2] = true;
        }
        if (s == STATUS_OK && weight > 0.0) out->radius[out->n_line - 1] = (float)(sum / weight);
    }
    polyline_shapes_follow(out, false);
    return s;
}
