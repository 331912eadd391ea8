#include "geometry/fibers/axes/model/axis_lumen.h"

#include <math.h>

static const float LEAST_BLUR = 0.1f; /* voxels */
static const float ON_AXIS = 1e-3f;   /* distance below which a voxel has no direction from the axis */
static const float LEAST_FLATNESS = 1e-4f;

struct lumen_view lumen_view_make(const struct section_view *section, float radius, float area, float blur)
{
    /* c and s of the section follow from exp(-2 L) = cosh(2 f) - sinh(2 f) L / f */
    const float f = logf(section->stretch), odd = f > LEAST_FLATNESS ? sinhf(2.0f * f) / f : 2.0f;
    const float c = (section->vv - section->uu) / (2.0f * odd), s = -section->uv / odd;
    const float square = radius * radius * fabsf(area), wide = section->stretch * section->stretch,
                along = 0.25f * square * wide + blur * blur, across = 0.25f * square / wide + blur * blur;
    const float own = 0.25f * logf(along / across),
                turn = f > LEAST_FLATNESS ? own / f : 0.25f * square / (0.25f * square + blur * blur),
                even = coshf(2.0f * own), own_odd = own > LEAST_FLATNESS ? sinhf(2.0f * own) / own : 2.0f;
    const float own_blur = fmaxf(LEAST_BLUR, sqrtf(fmaxf(0.0f, sqrtf(along * across) - 0.25f * square))),
                unit = radius * radius / (own_blur * own_blur);
    return (struct lumen_view){.uu = even - own_odd * turn * c,
                               .vv = even + own_odd * turn * c,
                               .uv = -own_odd * turn * s,
                               .inverse = 1.0f / own_blur,
                               .area = area * unit,
                               .by_area = unit,
                               .by_radius = 2.0f * area * unit / radius,
                               .by_blur = 1.0f / blur,
                               .turn = turn};
}

struct lumen_lanes lumen_lanes_at(const struct lumen_view *w, const struct lumen_table *t, lanes x, lanes y)
{
    const lanes zero = {0.0f}, one = zero + 1.0f;
    const lanes p = w->uu * x + w->uv * y, q = w->uv * x + w->vv * y, root = lanes_sqrt(x * p + y * q),
                place = root * w->inverse;
    lanes share = zero, by_place = zero, by_area = zero;
    for (int l = 0; l < LANES; l++) {
        const struct lumen_image image = lumen_table_at(t, place[l], w->area);
        share[l] = image.share;
        by_place[l] = image.by_place;
        by_area[l] = image.by_area;
    }
    const lanes inverse_root = one / lanes_choose(root > ON_AXIS, root, one),
                step = by_place * w->inverse * inverse_root;
    return (struct lumen_lanes){.share = share,
                                .by_axis = {-step * p, -step * q},
                                .by_radius = by_area * w->by_radius,
                                .by_blur = -(place * by_place + 2.0f * w->area * by_area) * w->by_blur,
                                .by_area = by_area * w->by_area,
                                .by_c = -step * (x * p - y * q) * w->turn,
                                .by_s = -step * (y * p + x * q) * w->turn};
}

void lumen_equation_add(struct lumen_equation *to, const struct lumen_equation *from)
{
    to->normal += from->normal;
    to->gradient += from->gradient;
    to->by_radius += from->by_radius;
    for (int i = 0; i < 5; i++) to->cross[i] += from->cross[i];
    to->radius_shared += from->radius_shared;
}
