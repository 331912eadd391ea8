#include "renderer/scattering/models/microfacet/microfacet_walk.h"
#include "renderer/scattering/fresnel.h"
#include "renderer/scattering/models/elliptical/ellipse_ray.h"

#include <string.h>

/* A facet that a direction w meets, w . m > 0. */
struct facet {
    double normal[3], cosine, weight; /* m, w . m */
};

struct microfacet_fiber microfacet_fiber_of(double eta, double ratio, double roughness)
{
    return (struct microfacet_fiber){eta, roughness, sqrt(ratio), 1 / sqrt(ratio)};
}

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Mean of (w . (p, q, 1))+ for a direction w of this cosine from the normal of the wall. */
static double shown(double cosine, double roughness)
{
    const double sd = fmax(roughness * M_SQRT1_2 * sqrt(fmax(1 - cosine * cosine, 0)), 1e-12), z = cosine / sd;
    return cosine * 0.5 * erfc(-z * M_SQRT1_2) + sd * exp(-0.5 * z * z) / sqrt(2 * M_PI);
}

static struct facet facet_at(const struct microfacet_fiber *f, const double at[2], const double w[3],
                             const double slope[2])
{
    const double v = at[0] / (f->major * f->major), u = at[1] / (f->minor * f->minor), size = 1 / sqrt(v * v + u * u);
    const double n[3] = {0, v * size, u * size}, p = f->roughness * M_SQRT1_2 * slope[0],
                 q = f->roughness * M_SQRT1_2 * slope[1];
    struct facet y = {{p, n[1] - q * n[2], n[2] + q * n[1]}, 0, 0};
    const double along = dot(w, y.normal), scale = 1 / sqrt(1 + p * p + q * q);
    if (along <= 0) return y; /* turned away */
    for (int i = 0; i < 3; i++) y.normal[i] *= scale;
    y.cosine = fmin(along * scale, 1);
    y.weight = along / shown(dot(w, n), f->roughness);
    return y;
}

/* Goes to where the ray meets the wall again and returns the length of the way. Where a facet turned it outward, it
 * meets the wall at once. */
static double cross(const struct microfacet_fiber *f, const double w[3], double at[2])
{
    const double q[2] = {w[1] / f->major, w[2] / f->minor}, o[2] = {at[0] / f->major, at[1] / f->minor};
    const double way = fmax(-2 * (q[0] * o[0] + q[1] * o[1]) / fmax(q[0] * q[0] + q[1] * q[1], 1e-18), 0);
    at[0] += way * w[1];
    at[1] += way * w[2];
    return way;
}

/* Refraction out of the fiber at a facet. Returns the transmitted share; 0 where the reflection is total. */
static double leave(const struct microfacet_fiber *f, const struct facet *m, const double w[3], double out[3])
{
    const double cosine = ellipse_cosine_outside(1 - f->eta * f->eta * (1 - m->cosine * m->cosine), NULL);
    if (!(cosine > 0)) return 0;
    for (int i = 0; i < 3; i++) out[i] = f->eta * w[i] + (cosine - f->eta * m->cosine) * m->normal[i];
    return 1 - fresnel_unpolarised(cosine, f->eta, NULL);
}

void microfacet_walk(const struct microfacet_fiber *f, double theta, const struct microfacet_draw *draw,
                     struct microfacet_path *path)
{
    const double cos_phi = cos(draw->phi), sin_phi = sin(draw->phi), cos_theta = cos(theta);
    const double light[3] = {sin(theta), cos_theta * cos_phi, cos_theta * sin_phi};
    const double a = f->major * sin_phi, b = f->minor * cos_phi, depth = sqrt(fmax(1 - draw->offset * draw->offset, 0));
    memset(path, 0, sizeof *path);
    path->width = sqrt(a * a + b * b);
    /* parameter of the point: gamma_0 + asin(offset), as in ellipse_enter */
    const double s = (a * depth + b * draw->offset) / path->width, c = (b * depth - a * draw->offset) / path->width;
    double at[2] = {f->major * c, f->minor * s}, w[3], length = 0, lean = draw->slope[0][0];
    struct facet m = facet_at(f, at, light, draw->slope[0]);
    if (m.weight == 0) return;
    const double cos_t = sqrt(1 - (1 - m.cosine * m.cosine) / (f->eta * f->eta));
    double left = m.weight * (1 - fresnel_unpolarised(m.cosine, f->eta, NULL));
    for (int i = 0; i < 3; i++) w[i] = -light[i] / f->eta + (m.cosine / f->eta - cos_t) * m.normal[i];
    for (int p = 0; p < MICROFACET_N_INNER; p++) {
        double out[3];
        length += cross(f, w, at);
        m = facet_at(f, at, w, draw->slope[p + 1]);
        if (m.weight == 0) return;
        lean += draw->slope[p + 1][0];
        const double through = leave(f, &m, w, out);
        left *= m.weight;
        if (through > 0)
            path->exit[p] = (struct microfacet_exit){left * through, length, atan2(out[2], out[1]) - draw->phi,
                                                     atan2(out[0], hypot(out[1], out[2])) + theta, lean};
        left *= 1 - through;
        for (int i = 0; i < 3; i++) w[i] -= 2 * m.cosine * m.normal[i];
    }
    path->rest = left;
    path->rest_length = length + cross(f, w, at);
}
