/* A smooth round dielectric fiber seen from close: the light that leaves depends on the offset h of the seen place
 * across the fiber. Shared by dielectric_near.v1, chiang.v1 and chiang_albedo.v1.
 *
 *     S(wi, wo) = a(th_i) a(th_o) [ sum over R, TT, TRT of M_p(th_i, th_o) A_p(th_d, h) D(ph - Phi_p(th_d, h))
 *                                   + M_TRT A_rest(th_d, h) / (2 pi) ]
 *     ph = ph_i - ph_o,  h = sin ph_o
 *
 * v of the fiber frame is the normal of the surface at the hit (scattering_model.near_field), so the azimuth of wo is
 * the angle between the view and the normal, and h follows from it. A ray that is followed backwards from the camera
 * meets the fiber at h and leaves with share A_p at the azimuth Phi_p (dielectric_ray.h); by reciprocity, light from
 * there reaches the camera with the same share. The mean of S over h is the far field; with the wrapped Gaussian for D
 * it is S of dielectric.v1. Lobes and scales along the fiber are the same. Since a(th) balances the mean over h, the
 * mean is lossless and reciprocal; a single h gains or loses light where its mixture of modes differs from the mean's,
 * which tests/physics/test_near_field.c bounds.
 *
 * Everything is computed for each pair of directions; the only table holds a(th). Double precision, since a narrow lobe
 * multiplies the rounding error of an angle.
 */
#ifndef SELVEDGE_RENDERER_NEAR_FIELD_H
#define SELVEDGE_RENDERER_NEAR_FIELD_H

#include "renderer/scattering/models/dielectric/dielectric_along.h"
#include "renderer/scattering/models/dielectric/near_azimuth.h"
#include "renderer/scattering/scattering.h"

/* Every model has these parameters in this order, with meanings of its own for colors and widths. */
enum { NEAR_P_COLOR = 0, NEAR_P_ETA = 3, NEAR_P_ALONG, NEAR_P_AROUND, NEAR_N_PARAM };

struct scattering_state {
    struct dielectric_along along;
    struct near_azimuth azimuth[DIELECTRIC_N_LOBE];
    double eta, c_t[3], ln_c_t[3];
    /* Chain rule: d beta by the parameter along; d width of each lobe, and d C_T of each channel, by that around; d C_T
     * by the color. */
    double d_beta, d_width[DIELECTRIC_N_LOBE], d_c_t_around[3], d_c_t[3];
};

/* Sets lobes and scale; the rest has been set. Takes ownership of s: STATUS_NO_MEMORY releases it. */
status near_field_finish(struct scattering_state *s, double beta_rad, struct scattering_state **state,
                         struct error *err);

/* The functions of a scattering_model (scattering.h). */
void near_field_release(struct scattering_state *s);
void near_field_eval(const struct scattering_state *s, const float wi[3], const float wo[3], float s_rgb[3],
                     float *score);
void near_field_sample(const struct scattering_state *s, const float wo[3], const float *weight_rgb, const float u[3],
                       float wi[3]);
float near_field_pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb);
float near_field_eval_pdf(const struct scattering_state *s, const float wi[3], const float wo[3],
                          const float *weight_rgb, float s_rgb[3], float *score);

#define NEAR_FIELD_FUNCTIONS                                                                                           \
    .near_field = true, .release = near_field_release, .eval = near_field_eval, .sample = near_field_sample,           \
    .pdf = near_field_pdf, .eval_pdf = near_field_eval_pdf

#endif
