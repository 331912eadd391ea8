/* A longitudinal lobe of a fiber whose scales tilt light by +-shift off the cone of the mirror, to both sides alike,
 * since a fiber in a cloth has no known root: the mean of two Gaussians in th_i + th_o. Shared by elliptical.v1 and the
 * models of fur.
 *
 * Samples of th_i beyond a pole are taken as the direction on its other side.
 */
#ifndef SELVEDGE_RENDERER_TILTED_LOBE_H
#define SELVEDGE_RENDERER_TILTED_LOBE_H

#include "renderer/scattering/azimuth_table.h"
#include "renderer/scattering/von_mises.h"

#include <math.h>
#include <stddef.h>

struct tilted_lobe {
    float shift, width; /* rad */
};

/* M for th_i + th_o = x, and its derivatives by the shift and the width when wanted. */
static inline float tilted_lobe_eval(const struct tilted_lobe *m, float x, float d[2])
{
    float inv = 1 / m->width, p = (x - m->shift) * inv, q = (x + m->shift) * inv, norm = 0.19947114f * inv;
    float a = norm * expf(-0.5f * p * p), b = norm * expf(-0.5f * q * q);
    if (d != NULL) {
        d[0] = (a * p - b * q) * inv;
        d[1] = (a * (p * p - 1) + b * (q * q - 1)) * inv;
    }
    return a + b;
}

/* Density of samples of th_i: the sum of `direct` = M, for th_i itself, and of M for the angles beyond a pole. */
static inline float tilted_lobe_density(const struct tilted_lobe *m, float theta_i, float theta_o, float direct)
{
    const float reach = 6 * m->width + m->shift;
    for (int side = -1; side <= 1; side += 2) {
        float beyond = (float)side * (float)M_PI - theta_i + theta_o;
        if (fabsf(beyond) < reach) direct += tilted_lobe_eval(m, beyond, NULL);
    }
    return direct;
}

/* th_i for u in [0, 1). */
static inline float tilted_lobe_sample(const struct tilted_lobe *m, float theta_o, float u)
{
    float side = u < 0.5f ? 1 : -1;
    u = table_stretch(u < 0.5f ? u : u - 0.5f, 0.5f);
    float theta = -theta_o + side * m->shift + (float)M_SQRT2 * m->width * erf_inverse(2 * u - 1);
    if (fabsf(theta) > (float)M_PI_2) theta = copysignf((float)M_PI, theta) - theta;
    return fminf(fmaxf(theta, (float)-M_PI_2), (float)M_PI_2);
}

#endif
