/* isotropic.v1: a fiber that scatters the same radiance into every direction, S = C / pi^2. Reciprocal, and with C = 1
 * lossless from both sides (the integral of cos th over the sphere is pi^2): the yardstick of furnace tests and the
 * plainest model to fit.
 */
#include "renderer/scattering/fiber_direction.h"
#include "renderer/scattering/models/isotropic/isotropic_rows.def"
#include "renderer/scattering/scattering.h"

#include <stdlib.h>

struct scattering_state {
    float c[3];
};

static status prepare(const double *param, struct scattering_state **state, struct error *err)
{
    status st =
        param_check(scattering_isotropic.param, scattering_isotropic.n_param, scattering_isotropic.id, param, err);
    if (st != STATUS_OK) return st;
    struct scattering_state *s = malloc(sizeof *s);
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    for (int c = 0; c < 3; c++) s->c[c] = (float)param[c];
    *state = s;
    return STATUS_OK;
}

static void release(struct scattering_state *s) { free(s); }

static void eval(const struct scattering_state *s, const float wi[3], const float wo[3], float s_rgb[3], float *score)
{
    (void)wi;
    (void)wo;
    for (int c = 0; c < 3; c++) s_rgb[c] = s->c[c] * (float)(M_1_PI * M_1_PI);
    if (score == NULL) return;
    for (int c = 0; c < 3; c++)
        for (int p = 0; p < 3; p++) score[3 * c + p] = c == p ? 1 / s->c[c] : 0;
}

static float pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb)
{
    (void)weight_rgb;
    (void)s;
    (void)wo;
    return fmaxf(sqrtf(wi[1] * wi[1] + wi[2] * wi[2]), FIBER_COS_MIN) * (float)(M_1_PI * M_1_PI);
}

/* cos^2 th d th: the sine of th is distributed as one coordinate of a point in the unit disk. */
static void sample(const struct scattering_state *s, const float wo[3], const float *weight_rgb, const float u[3],
                   float wi[3])
{
    (void)s;
    (void)wo;
    (void)weight_rgb;
    float z = sqrtf(u[0]) * cosf((float)(2 * M_PI) * u[1]), cos_theta = sqrtf(fmaxf(0, (1 - z) * (1 + z)));
    float phi = (float)(2 * M_PI) * u[2];
    wi[0] = z;
    wi[1] = cos_theta * cosf(phi);
    wi[2] = cos_theta * sinf(phi);
}

static float eval_pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb,
                      float s_rgb[3], float *score)
{
    eval(s, wi, wo, s_rgb, score);
    return pdf(s, wi, wo, weight_rgb);
}

const struct scattering_model scattering_isotropic = {
    SURFACE_MODEL_ROW(isotropic), .prepare = prepare, .release = release, .eval = eval, .sample = sample, .pdf = pdf,
    .eval_pdf = eval_pdf,
};
