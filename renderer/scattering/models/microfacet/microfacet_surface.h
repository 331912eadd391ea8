/* Reflection by the facets of a fiber's wall, the lobe R, in closed form.
 *
 * Over all orientations of the section its normals have all azimuths alike, whatever convex shape it has. So the facets
 * that mirror wi to wo are the same as on a circle, summed over the azimuth of the wall, psi measured from the
 * half vector h:
 *
 *     S_R cos th_i cos th_o = F / 8 * integral of D(m) over psi,   D = exp(-((p - k)^2 + q^2) / r^2) / (pi r^2 (m .
 * n)^4)
 *     p = tan th_h / cos psi,   q = tan psi,   k = tan tau: mean slope along the fiber of a wall with scales
 *
 * With t = tan psi the integrand is exp(-((tan th_h sqrt(1 + t^2) - k)^2 + t^2) / r^2) (1 + t^2) / (pi r^2 cos^4 th_h).
 * It is integrated in closed form with sqrt(1 + t^2) = 1 + t^2 / 2 in the one product with k, and exactly for k = 0.
 * The mean of k and -k is taken, since a fiber in a cloth has no known root. The visible share of these facets is a
 * factor of its own, V(alpha_i) + V(alpha_o) - 1 for the azimuths alpha of both directions off h (microfacet_seen).
 */
#ifndef SELVEDGE_RENDERER_MICROFACET_SURFACE_H
#define SELVEDGE_RENDERER_MICROFACET_SURFACE_H

#include "renderer/scattering/fresnel.h"

#include <math.h>
#include <stddef.h>

struct microfacet_surface {
    float eta, roughness, tilt, d_tilt; /* r, k, and d k / d tau */
};

enum { MICROFACET_R_BY_ETA, MICROFACET_R_BY_ROUGHNESS, MICROFACET_R_BY_TAU, MICROFACET_R_N_BY };

/* S_R cos th_i cos th_o if the wall hid no facets, for t = tan th_h and the cosine of half of the angle between both
 * directions, and its derivatives when wanted. */
static inline float microfacet_reflected(const struct microfacet_surface *s, float t, float cos_half,
                                         float d[MICROFACET_R_N_BY])
{
    const float r = s->roughness, inv = 1 / r, sec2 = 1 + t * t;
    float sum = 0, by_r = 0, by_k = 0;
    t = fabsf(t);
    if (t - s->tilt < 9 * r)
        for (int side = -1; side <= 1; side += 2) {
            const float k = (float)side * s->tilt, z = (t - k) * inv, q = 1 / (sec2 - t * k), root = sqrtf(q);
            const float g = expf(-z * z), wide = root * (1 + 0.5f * r * r * q);
            sum += g * wide;
            if (d == NULL) continue;
            by_r += g * (wide * 2 * z * z * inv + root * r * q);
            by_k += (float)side * g * (wide * 2 * z * inv + t * root * q * (0.5f + 0.75f * r * r * q));
        }
    double d_fresnel;
    const float fresnel =
        (float)fresnel_unpolarised(fmin((double)cos_half, 1), (double)s->eta, d != NULL ? &d_fresnel : NULL);
    const float scale = sec2 * sec2 * 0.035261849f * inv; /* 1 / (16 sqrt(pi)) */
    if (d != NULL) {
        d[MICROFACET_R_BY_ETA] = scale * sum * (float)d_fresnel;
        d[MICROFACET_R_BY_ROUGHNESS] = scale * fresnel * (by_r - sum * inv);
        d[MICROFACET_R_BY_TAU] = scale * fresnel * by_k * s->d_tilt;
    }
    return scale * sum * fresnel;
}

/* Arguments of R for two directions: tan th_h, the cosine of half of the angle between them, and the cosines of their
 * azimuths less the azimuth of h. */
struct microfacet_half {
    float t, cos_half, cos_alpha[2];
};

static inline struct microfacet_half microfacet_half_of(const float wi[3], const float wo[3])
{
    const float u = wi[0] + wo[0], v = wi[1] + wo[1], w = wi[2] + wo[2], across = v * v + w * w;
    const float inv = 1 / sqrtf(fmaxf(across, 1e-12f));
    struct microfacet_half h = {u * inv, 0.5f * sqrtf(across + u * u), {0, 0}};
    const float *const one[2] = {wi, wo};
    for (int k = 0; k < 2; k++) {
        const float c2 = one[k][1] * one[k][1] + one[k][2] * one[k][2];
        const float x = (one[k][1] * v + one[k][2] * w) * inv / sqrtf(fmaxf(c2, 1e-12f));
        h.cos_alpha[k] = fminf(fmaxf(x, -1), 1);
    }
    return h;
}

/* V: share of the facets with the half vector as their normal that a direction of the cosine of th sees, by Smith's
 * function, for the cosine of its azimuth off h. */
double microfacet_seen(double cos_theta, double cos_alpha, double roughness);

/* th_i + th_o of the light of one azimuth, for samples: normal, about both signs of the shift. */
void microfacet_reflected_lobe(const struct microfacet_surface *s, double cos_theta, double phi, float *shift,
                               float *width);

#endif
