/* Exits of a ray that meets a fiber with a medulla at the offset h = sin x from its axis, with derivatives (Yan, Jensen
 * and Ramamoorthi 2017, "An Efficient and Practical Near and Far Field Fur Reflectance Model", section 4; Yan 2018,
 * "Physically-based Modeling and Rendering of Complex Visual Appearance", sections 4.3 and 4.8). The section is two
 * concentric circles, of radius 1 and kappa, and of the same index of refraction. Lengths are in radii of the fiber.
 *
 *     F      reflectance of l layers of cuticle: F_1 = F_s / (1 + F_s) + F_p / (1 + F_p), F = l F_1 / (1 + (l - 1) F_1)
 *     s_m    half of the way in the medulla, sqrt(kappa^2 - sin^2 gamma_t); s_c = cos gamma_t - s_m, in the cortex
 *     E      share that one crossing leaves unscattered: exp(-2 (s_c sigma_c + s_m (sigma_ma + sigma_ms)) / cos th_t)
 *     s      share that one crossing scatters: 1 - exp(-2 s_m sigma_ms / cos th_t)
 *     u      exp(-s_c sigma_c / cos th_t), the way to the medulla
 *     v      exp(-(kappa sigma_ma + (1 - kappa) sigma_c) / cos th_t), the way of scattered light out of the fiber
 *
 *     R     F                 TT     (1 - F)^2 E          TRT   (1 - F)^2 F E^2
 *     TT^s  (1 - F) u v s     TRT^s  (1 - F) F E u v s
 *     rest  (1 - F) F^2 E^2 [(1 - F) E + u v s] / (1 - F E)
 *
 * Without absorption the shares sum to 1 at every offset.
 *
 * Differs from the publication: TT^s begins with 1 - F where their table 3 prints F, as their equation (20) and the sum
 * of energies demand; the rest, all longer paths, is kept; ways are divided by cos th_t, sin th_t = sin th_d / eta, and
 * not by cos th_d, which the refracted ray never has; F is taken at the true angle of incidence and not at gamma_i with
 * the index eta'; and s_m is rounded off within 5 % of the medulla's edge, where its slope has no bound: s_m^2 = (q +
 * sqrt(q^2 + e^2)) / 2, q = kappa^2 - sin^2 gamma_t.
 */
#ifndef SELVEDGE_RENDERER_FUR_RAY_H
#define SELVEDGE_RENDERER_FUR_RAY_H

#include "renderer/scattering/models/dielectric/dielectric_ray.h"

#include <math.h>

enum fur_mode { FUR_R, FUR_TT, FUR_TRT, FUR_TT_S, FUR_TRT_S, FUR_REST, FUR_N_MODE };
/* Quantities that the shares depend on. FUR_BY_C: ln C_T of one channel, C_T = exp(-2 sigma_c). */
enum fur_by { FUR_BY_C, FUR_BY_ETA, FUR_BY_KAPPA, FUR_BY_LAYERS, FUR_BY_MS, FUR_BY_MA, FUR_N_BY };
#define FUR_EDGE 1e-2         /* e */
#define FUR_LEAST_COSINE 1e-3 /* of th_d: at 0 all light is reflected */

struct fur_fiber {
    double eta, kappa, layers, sigma_ms, sigma_ma;
};

/* A length and its derivatives by eta and kappa. */
struct fur_length {
    double v, eta, kappa;
};

struct fur_ray {
    double fresnel, d_fresnel[2];              /* F; by eta and by the number of layers */
    double gamma_t, d_gamma_t;                 /* rad; by eta */
    double slant, d_slant;                     /* 1 / cos th_t; by eta */
    struct fur_length cortex, medulla, offset; /* s_c / cos th_t, s_m / cos th_t, asin(|h'|) */
};

/* cos_theta > 0; x in [-pi/2, pi/2]. */
static inline struct fur_ray fur_ray_at(const struct fur_fiber *f, double cos_theta, double x)
{
    struct fur_ray r;
    double eta = f->eta, cos2 = cos_theta * cos_theta, sin2 = 1 - cos2, bravais2 = (eta * eta - sin2) / cos2;
    double b = sin(x) / sqrt(bravais2), cosine = sqrt(1 - b * b), d_b = -b * eta / (bravais2 * cos2);
    double f_sp[2], d_sp[2], one = 0, d_one = 0;
    fresnel_polarised(cos_theta * cos(x), eta, f_sp, d_sp);
    for (int k = 0; k < 2; k++) {
        one += f_sp[k] / (1 + f_sp[k]);
        d_one += d_sp[k] / ((1 + f_sp[k]) * (1 + f_sp[k]));
    }
    double stack = 1 / (1 + (f->layers - 1) * one);
    r.fresnel = f->layers * one * stack;
    r.d_fresnel[0] = f->layers * stack * stack * d_one;
    r.d_fresnel[1] = one * (1 - one) * stack * stack;
    r.gamma_t = asin(b);
    r.d_gamma_t = d_b / cosine;
    r.slant = 1 / sqrt(1 - sin2 / (eta * eta));
    r.d_slant = -r.slant * r.slant * r.slant * sin2 / (eta * eta * eta);
    double q = f->kappa * f->kappa - b * b, root = sqrt(q * q + FUR_EDGE * FUR_EDGE);
    double s_m = q > 0 ? sqrt(0.5 * (q + root)) : FUR_EDGE * sqrt(0.5 / (root - q)), slope = 0.5 * s_m / root;
    double by_eta = -2 * b * d_b * slope, by_kappa = 2 * f->kappa * slope, s_c = cosine - s_m, size = b * b + s_m * s_m;
    r.medulla = (struct fur_length){s_m * r.slant, by_eta * r.slant + s_m * r.d_slant, by_kappa * r.slant};
    r.cortex = (struct fur_length){s_c * r.slant, (-b * d_b / cosine - by_eta) * r.slant + s_c * r.d_slant,
                                   -by_kappa * r.slant};
    r.offset = (struct fur_length){atan2(fabs(b), s_m), copysign(1, b) * (s_m * d_b - b * by_eta) / size,
                                   -fabs(b) * by_kappa / size};
    return r;
}

/* Shares, and their derivatives by F, ln E, ln u, ln v and s. */
enum fur_part { FUR_F, FUR_LN_E, FUR_LN_U, FUR_LN_V, FUR_S, FUR_N_PART };
struct fur_shares {
    double value[FUR_N_MODE], d[FUR_N_MODE][FUR_N_PART];
};

static inline struct fur_shares fur_shares_of(const struct fur_fiber *f, const struct fur_ray *r, double ln_c)
{
    double sigma = f->sigma_ms + f->sigma_ma, e = exp(ln_c * r->cortex.v - 2 * r->medulla.v * sigma);
    double out = exp(0.5 * ln_c * r->cortex.v + (0.5 * ln_c * (1 - f->kappa) - f->kappa * f->sigma_ma) * r->slant);
    double s = -expm1(-2 * r->medulla.v * f->sigma_ms), y = r->fresnel, g = 1 - y, us = out * s;
    double p = g * y * y * e * e / (1 - y * e), q = g * e + us;
    double p_y = (y * (2 - 3 * y) * e * e + p * e) / (1 - y * e);
    return (struct fur_shares){
        {y, g * g * e, g * g * y * e * e, g * us, g * y * e * us, p * q},
        {{1, 0, 0, 0, 0},
         {-2 * g * e, g * g * e, 0, 0, 0},
         {g * (1 - 3 * y) * e * e, 2 * g * g * y * e * e, 0, 0, 0},
         {-us, 0, g * us, g * us, g * out},
         {(1 - 2 * y) * e * us, g * y * e * us, g * y * e * us, g * y * e * us, g * y * e * out},
         {p_y * q - p * e, p * q * (2 + y * e / (1 - y * e)) + p * g * e, p * us, p * us, p * out}}};
}

/* Derivatives of the parts: part[FUR_N_PART][FUR_N_BY]. */
static inline void fur_parts(const struct fur_fiber *f, const struct fur_ray *r, double ln_c,
                             double part[FUR_N_PART][FUR_N_BY])
{
    const struct fur_length *c = &r->cortex, *m = &r->medulla;
    double sigma = f->sigma_ms + f->sigma_ma, left = exp(-2 * m->v * f->sigma_ms);
    double way = 0.5 * ln_c * (1 - f->kappa) - f->kappa * f->sigma_ma;
    const double all[FUR_N_PART][FUR_N_BY] = {
        {0, r->d_fresnel[0], 0, r->d_fresnel[1], 0, 0},
        {c->v, ln_c * c->eta - 2 * sigma * m->eta, ln_c * c->kappa - 2 * sigma * m->kappa, 0, -2 * m->v, -2 * m->v},
        {0.5 * c->v, 0.5 * ln_c * c->eta, 0.5 * ln_c * c->kappa, 0, 0, 0},
        {0.5 * (1 - f->kappa) * r->slant, way * r->d_slant, -(0.5 * ln_c + f->sigma_ma) * r->slant, 0, 0,
         -f->kappa * r->slant},
        {0, 2 * f->sigma_ms * m->eta * left, 2 * f->sigma_ms * m->kappa * left, 0, 2 * m->v * left, 0}};
    for (int p = 0; p < FUR_N_PART; p++)
        for (int k = 0; k < FUR_N_BY; k++) part[p][k] = all[p][k];
}

/* Derivatives of one share from the derivatives of the parts. */
static inline void fur_share_slopes(const struct fur_shares *a, int mode, double part[FUR_N_PART][FUR_N_BY],
                                    double d[FUR_N_BY])
{
    for (int k = 0; k < FUR_N_BY; k++) {
        d[k] = 0;
        for (int p = 0; p < FUR_N_PART; p++) d[k] += a->d[mode][p] * part[p][k];
    }
}

/* Returns the azimuth, less the azimuth of the ray, that points back along segment p = 1, 2 inside; by eta in
 * *d_eta. */
static inline double fur_segment_azimuth(const struct fur_ray *r, int p, double x, double *d_eta)
{
    *d_eta = (2 * p - 1) * r->d_gamma_t;
    return (2 * p - 1) * r->gamma_t - x + (p - 1) * M_PI;
}

/* Optical radius of the medulla for a ray, and its derivatives by eta, kappa and sigma_ms. */
static inline double fur_depth(const struct fur_fiber *f, const struct fur_ray *r, double d[3])
{
    d[0] = f->kappa * f->sigma_ms * r->d_slant;
    d[1] = f->sigma_ms * r->slant;
    d[2] = f->kappa * r->slant;
    return f->kappa * f->sigma_ms * r->slant;
}

#endif
