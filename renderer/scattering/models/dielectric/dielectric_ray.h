/* Geometric optics of a smooth circular dielectric cylinder: exits of a ray that meets it at the offset h = sin x from
 * its axis, and their derivatives by the index of refraction. Marschner et al. 2003, "Light Scattering from Human Hair
 * Fibers", section 3, with unpolarised Fresnel reflection at the true angle of incidence; the share of paths with more
 * inner reflections in closed form after Chiang et al. 2016, "A Practical and Controllable Hair and Fur Model for
 * Production Path Tracing", section 4.
 *
 *     F    Fresnel reflectance at cos = cos th cos x
 *     l    way through the fiber between two meetings with its wall, in diameters: cos gamma_t / cos th_t, where
 *          sin gamma_t = h / eta', eta' = sqrt(eta^2 - sin^2 th) / cos th (Bravais), sin th_t = sin th / eta
 *     T    C_T^l, C_T the share of the light that one diameter lets through
 *     A_R  F     A_TT  (1 - F)^2 T     A_TRT  (1 - F)^2 F T^2     A_rest  (1 - F)^2 F^2 T^3 / (1 - F T)
 *     azimuth from the direction of the incoming ray: p = 0 (R): -2 x; 1 (TT): pi + 2 gamma_t - 2 x; 2 (TRT):
 *          4 gamma_t - 2 x + 2 pi
 * Without absorption the four shares sum to 1 at every offset.
 */
#ifndef SELVEDGE_RENDERER_DIELECTRIC_RAY_H
#define SELVEDGE_RENDERER_DIELECTRIC_RAY_H

#include "renderer/scattering/fresnel.h"

enum dielectric_mode { DIELECTRIC_R, DIELECTRIC_TT, DIELECTRIC_TRT, DIELECTRIC_REST, DIELECTRIC_N_MODE };

/* Quadrature over the offset: x at midpoints of (0, pi/2), where the nodes crowd where Fresnel reflection rises. */
enum { DIELECTRIC_N_OFFSET = 96 };
#define DIELECTRIC_LEAST_COSINE 1e-3 /* of th: at 0 all light is reflected */

/* x, and the weights cos x dx, of sum 1. */
static inline void dielectric_offsets(double x[DIELECTRIC_N_OFFSET], double weight[DIELECTRIC_N_OFFSET])
{
    double sum = 0;
    for (int i = 0; i < DIELECTRIC_N_OFFSET; i++) {
        x[i] = (i + 0.5) * M_PI_2 / DIELECTRIC_N_OFFSET;
        sum += weight[i] = cos(x[i]);
    }
    for (int i = 0; i < DIELECTRIC_N_OFFSET; i++) weight[i] /= sum;
}

struct dielectric_ray {
    double fresnel, length;                /* F, l */
    double gamma_t;                        /* rad */
    double d_fresnel, d_length, d_gamma_t; /* by eta */
};

/* cos_theta > 0; x in [-pi/2, pi/2]; eta > 1. */
static inline struct dielectric_ray dielectric_ray_at(double cos_theta, double x, double eta)
{
    struct dielectric_ray r;
    double h = sin(x), cos2 = cos_theta * cos_theta, sin2 = 1 - cos2, bravais2 = (eta * eta - sin2) / cos2;
    double sin_t = h / sqrt(bravais2), cos_t = sqrt(1 - sin_t * sin_t), cos_theta_t = sqrt(1 - sin2 / (eta * eta));
    r.fresnel = fresnel_unpolarised(cos_theta * cos(x), eta, &r.d_fresnel);
    r.gamma_t = asin(sin_t);
    r.length = cos_t / cos_theta_t;
    r.d_gamma_t = -sin_t / cos_t * eta / (bravais2 * cos2); /* d ln eta' / d eta = eta / (eta'^2 cos^2 th) */
    r.d_length = (-sin_t * r.d_gamma_t - r.length * sin2 / (eta * eta * eta * cos_theta_t)) / cos_theta_t;
    return r;
}

/* Shares of the modes for a ray and one transmittance, and their derivatives by eta and by C_T. ln_c_t = ln C_T. */
struct dielectric_shares {
    double value[DIELECTRIC_N_MODE], d_eta[DIELECTRIC_N_MODE], d_c_t[DIELECTRIC_N_MODE];
};

static inline struct dielectric_shares dielectric_shares_of(const struct dielectric_ray *r, double c_t, double ln_c_t)
{
    struct dielectric_shares a;
    double f = r->fresnel, g = 1 - f, t = exp(ln_c_t * r->length), d_ln_t = ln_c_t * r->d_length;
    double enter = g * g * t, inv = 1 / (1 - f * t);
    /* d A by F, and d ln A by ln T = l ln C_T */
    const double by_f[DIELECTRIC_N_MODE] = {1, -2 * g * t, g * (1 - 3 * f) * t * t,
                                            g * f * t * t * t * inv * (2 - 4 * f + g * f * t * inv)};
    const double by_ln_t[DIELECTRIC_N_MODE] = {0, 1, 2, 3 + f * t * inv};
    a.value[DIELECTRIC_R] = f;
    a.value[DIELECTRIC_TT] = enter;
    a.value[DIELECTRIC_TRT] = enter * f * t;
    a.value[DIELECTRIC_REST] = enter * f * t * f * t * inv;
    for (int p = 0; p < DIELECTRIC_N_MODE; p++) {
        a.d_eta[p] = by_f[p] * r->d_fresnel + a.value[p] * by_ln_t[p] * d_ln_t;
        a.d_c_t[p] = a.value[p] * by_ln_t[p] * r->length / c_t;
    }
    return a;
}

/* Azimuth of mode p (R, TT, TRT) and its derivative by eta. */
static inline double dielectric_azimuth(const struct dielectric_ray *r, int p, double x, double *d_eta)
{
    *d_eta = 2 * p * r->d_gamma_t;
    return 2 * p * r->gamma_t - 2 * x + p * M_PI;
}

#endif
