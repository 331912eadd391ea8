/* chiang.v1 and chiang_albedo.v1: the near-field model of Chiang et al. 2016, "A Practical and Controllable Hair and
 * Fur Model for Production Path Tracing", with R, TT, TRT and the residual lobe of all longer paths.
 *
 * The longitudinal roughness beta_M gives the width of R (chiang_width.h); TT has half of it, TRT and all longer paths
 * twice. The azimuthal roughness beta_N gives the scale of the logistic lobe.
 *
 * chiang.v1 takes the absorption as C_T, the share of the light that one diameter lets through: C_T = exp(-2 sigma),
 * sigma an absorption per radius. chiang_albedo.v1 takes the color of a mass of such fibers, from which their section
 * 4.2 finds the absorption: sigma = (ln C / g(beta_N))^2, with g the polynomial of fifth degree below.
 *
 * Differs from the publication: the factor 1 / cos th_i is replaced by the scale a(th_i) a(th_o), attenuation and
 * azimuth are taken at the difference angle (near_field.h), and the surface has no tilted scales.
 */
#include "renderer/scattering/models/dielectric/chiang_width.h"
#include "renderer/scattering/models/dielectric/near_field.h"

#include <stdlib.h>

/* g and its derivative. */
static double albedo_polynomial(double b, double *d)
{
    static const double factor[6] = {5.969, -0.215, 2.532, -10.73, 5.574, 0.245};
    double g = 0;
    *d = 0;
    for (int i = 5; i >= 0; i--) {
        *d = *d * b + g;
        g = g * b + factor[i];
    }
    return g;
}

/* Sets everything but C_T and its derivatives. */
static struct scattering_state *start(const double *param, double *beta_rad, struct error *err)
{
    struct scattering_state *s = calloc(1, sizeof *s);
    if (s == NULL) {
        error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
        return NULL;
    }
    *beta_rad = chiang_width_along_rad(param[NEAR_P_ALONG], &s->d_beta);
    double d_width, width = chiang_width_around_rad(param[NEAR_P_AROUND], &d_width);
    for (int p = 0; p < DIELECTRIC_N_LOBE; p++) {
        near_azimuth_init(&s->azimuth[p], NEAR_LOGISTIC, width);
        s->d_width[p] = d_width;
    }
    s->eta = param[NEAR_P_ETA];
    return s;
}

static status prepare(const double *param, struct scattering_state **state, struct error *err)
{
    double beta_rad;
    status st = param_check(surface_chiang_param, NEAR_N_PARAM, surface_chiang_id, param, err);
    if (st != STATUS_OK) return st;
    struct scattering_state *s = start(param, &beta_rad, err);
    if (s == NULL) return STATUS_NO_MEMORY;
    for (int c = 0; c < 3; c++) {
        s->c_t[c] = param[NEAR_P_COLOR + c];
        s->d_c_t[c] = 1;
    }
    return near_field_finish(s, beta_rad, state, err);
}

static status prepare_albedo(const double *param, struct scattering_state **state, struct error *err)
{
    double beta_rad;
    status st = param_check(surface_chiang_albedo_param, NEAR_N_PARAM, surface_chiang_albedo_id, param, err);
    if (st != STATUS_OK) return st;
    struct scattering_state *s = start(param, &beta_rad, err);
    if (s == NULL) return STATUS_NO_MEMORY;
    double d_g, g = albedo_polynomial(param[NEAR_P_AROUND], &d_g);
    for (int c = 0; c < 3; c++) {
        double color = param[NEAR_P_COLOR + c], root = log(color) / g;
        s->c_t[c] = exp(-2 * root * root);
        s->d_c_t[c] = s->c_t[c] * -4 * root / (g * color);
        s->d_c_t_around[c] = s->c_t[c] * 4 * root * root * d_g / g;
    }
    return near_field_finish(s, beta_rad, state, err);
}

const struct scattering_model scattering_chiang = {
    SURFACE_MODEL_ROW(chiang),
    .prepare = prepare,
    NEAR_FIELD_FUNCTIONS,
};

const struct scattering_model scattering_chiang_albedo = {
    SURFACE_MODEL_ROW(chiang_albedo),
    .prepare = prepare_albedo,
    NEAR_FIELD_FUNCTIONS,
};
