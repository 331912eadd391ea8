/* Fresnel reflectance of a dielectric for light from outside, the only place where it is computed for plain numbers.
 * (models/elliptical/ellipse_ray.c has the same equations in numbers that carry derivatives.) */
#ifndef SELVEDGE_RENDERER_FRESNEL_H
#define SELVEDGE_RENDERER_FRESNEL_H

#include <math.h>
#include <stddef.h>

/* Reflectances of light that is polarised across (s) and in (p) the plane of incidence, for the cosine of the angle of
 * incidence and an index of refraction of at least 1, and their derivatives by eta when d_eta is not NULL. */
static inline void fresnel_polarised(double cos_i, double eta, double sp[2], double d_eta[2])
{
    double sin2 = 1 - cos_i * cos_i, cos_t = sqrt(1 - sin2 / (eta * eta)), q = eta * cos_t, a = eta * cos_i;
    double s = (cos_i - q) / (cos_i + q), p = (a - cos_t) / (a + cos_t);
    sp[0] = s * s;
    sp[1] = p * p;
    if (d_eta != NULL) {
        double d_cos_t = sin2 / (eta * eta * eta * cos_t), d_q = cos_t + eta * d_cos_t;
        d_eta[0] = -4 * s * cos_i / ((cos_i + q) * (cos_i + q)) * d_q;
        d_eta[1] = 4 * p * (cos_t * cos_i - a * d_cos_t) / ((a + cos_t) * (a + cos_t));
    }
}

/* Reflectance of unpolarised light, and its derivative by eta when d_eta is not NULL. */
static inline double fresnel_unpolarised(double cos_i, double eta, double *d_eta)
{
    double sp[2], d[2];
    fresnel_polarised(cos_i, eta, sp, d_eta != NULL ? d : NULL);
    if (d_eta != NULL) *d_eta = 0.5 * (d[0] + d[1]);
    return 0.5 * (sp[0] + sp[1]);
}

#endif
