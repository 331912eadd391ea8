/* chiang.v1 and chiang_albedo.v1: the near-field model of Chiang et al. 2016, "A Practical and Controllable Hair and
 * Fur Model for Production Path Tracing", with R, TT, TRT and the residual lobe of all longer paths.
 *
 * The longitudinal roughness b = beta_M gives the variance v = (0.726 b + 0.812 b^2 + 3.7 b^20)^2 of R; TT has v / 4,
 * TRT and all longer paths 4 v. The azimuthal roughness b = beta_N gives the scale of the logistic lobe, sqrt(pi / 8)
 * (0.265 b + 1.194 b^2 + 5.372 b^22).
 *
 * chiang.v1 takes the absorption as C_T, the share of the light that one diameter lets through: C_T = exp(-2 sigma),
 * sigma an absorption per radius. chiang_albedo.v1 takes the color of a mass of such fibers, from which their section
 * 4.2 finds the absorption: sigma = (ln C / g(beta_N))^2, with g the polynomial of fifth degree below.
 *
 * Differs from the publication: the factor 1 / cos th_i is replaced by the scale a(th_i) a(th_o), attenuation and
 * azimuth are taken at the difference angle (near_field.h), and the surface has no tilted scales.
 */
#include "renderer/scattering/models/dielectric/near_field.h"

#include <stdlib.h>

/* a b + c b^2 + d b^n and its derivative. */
static double roughness(double b, const double factor[3], double n, double *d)
{
    *d = factor[0] + 2 * factor[1] * b + n * factor[2] * pow(b, n - 1);
    return factor[0] * b + factor[1] * b * b + factor[2] * pow(b, n);
}

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
    static const double along[3] = {0.726, 0.812, 3.7}, around[3] = {0.265, 1.194, 5.372};
    struct scattering_state *s = calloc(1, sizeof *s);
    if (s == NULL) {
        error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
        return NULL;
    }
    *beta_rad = roughness(param[NEAR_P_ALONG], along, 20, &s->d_beta);
    double d_width, width = sqrt(M_PI / 8) * roughness(param[NEAR_P_AROUND], around, 22, &d_width);
    for (int p = 0; p < DIELECTRIC_N_LOBE; p++) {
        near_azimuth_init(&s->azimuth[p], NEAR_LOGISTIC, width);
        s->d_width[p] = sqrt(M_PI / 8) * d_width;
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
