/* Two directions at a round fiber that is seen from close (near_field.h). v of the fiber frame is the normal of the
 * surface at the hit, so the azimuth of wo is the angle between the view and the normal; its sine is the offset h. */
#ifndef SELVEDGE_RENDERER_NEAR_VIEW_H
#define SELVEDGE_RENDERER_NEAR_VIEW_H

#include "renderer/scattering/fiber_direction.h"

#define NEAR_LEAST_COSINE_D 1e-6 /* of th_d: steeper rays are taken at this cosine */

struct near_view {
    struct fiber_direction in, out;
    double x, phi; /* offset angle; ph_i - ph_o in [-pi, pi] */
    double cos_d;  /* of th_d */
};

/* The offset h = sin x of a direction of view. */
static inline double near_offset_angle(const struct fiber_direction *out)
{
    return atan2((double)out->azimuth[1], fabs((double)out->azimuth[0]));
}

/* cos th_d, th_d = (th_i - th_o) / 2, from the sines and cosines of both angles. */
static inline double near_cosine_d(double sin_i, double cos_i, double sin_o, double cos_o)
{
    double c = cos_i + cos_o, u = sin_i + sin_o;
    return fmax(0.5 * sqrt(c * c + u * u), NEAR_LEAST_COSINE_D);
}

static inline struct near_view near_view_of(const float wi[3], const float wo[3])
{
    struct near_view g = {.in = fiber_direction_of(wi), .out = fiber_direction_of(wo)};
    const float *a = g.in.azimuth, *b = g.out.azimuth;
    double across = (double)a[1] * (double)b[0] - (double)a[0] * (double)b[1];
    double along = (double)a[0] * (double)b[0] + (double)a[1] * (double)b[1];
    g.x = near_offset_angle(&g.out);
    g.phi = atan2(across, along);
    g.cos_d = near_cosine_d((double)wi[0], (double)g.in.cos_theta, (double)wo[0], (double)g.out.cos_theta);
    return g;
}

/* Sets wi from th_i and phi, its azimuth less the azimuth of the view. */
static inline void near_direction(const struct fiber_direction *out, float sin_i, float cos_i, double phi, float wi[3])
{
    fiber_direction_beyond(out, sin_i, cos_i, (float)cos(phi), (float)sin(phi), wi);
}

#endif
