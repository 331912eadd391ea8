/* kajiya_kay.v1: diffuse and specular reflection of a fiber (Kajiya and Kay 1989, "Rendering fur with three dimensional
 * textures", section 5), made energy-bounded and differentiable:
 *     S = C_D (1 - C_S) / pi^2 + C_S M(th_i, th_o; beta_S) / (2 pi max(cos th_i, cos th_o))
 * The published diffuse term K_d sin(tangent, light) is K_d cos th_i, which is the projection that every S is
 * multiplied with; 1 / pi^2 makes its energy C_D. The published highlight cos^p(th_i + th_o) becomes the cone lobe
 * (cone_lobe.h), which is exp(p (cos(th_i + th_o) - 1)) to leading order with p = 1 / beta_S^2, the same peak and width
 * as cos^p. Specular takes its share first, the rest is diffuse: energy <= C_S + C_D (1 - C_S) < 1 for all bounds.
 * Reciprocal.
 */
#include "renderer/scattering/cone_lobe.h"
#include "renderer/scattering/fiber_direction.h"
#include "renderer/scattering/models/kajiya_kay/kajiya_kay_rows.def"
#include "renderer/scattering/scattering_state.h"

#include <stdlib.h>

enum { N_PARAM = surface_kajiya_kay_n_param, P_C_D = 0, P_C_S = 3, P_BETA_S = 6 };

struct scattering_state {
    float c_d[3], c_s[3], not_c_s[3];
    struct cone_lobe lobe;
};

static status prepare(const double *param, struct scattering_state **state, struct error *err)
{
    status st =
        param_check(scattering_kajiya_kay.param, scattering_kajiya_kay.n_param, scattering_kajiya_kay.id, param, err);
    if (st != STATUS_OK) return st;
    struct scattering_state *s = malloc(sizeof *s);
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    for (int c = 0; c < 3; c++) {
        s->c_d[c] = (float)param[P_C_D + c];
        s->c_s[c] = (float)param[P_C_S + c];
        s->not_c_s[c] = (float)(1 - param[P_C_S + c]);
    }
    cone_lobe_init(&s->lobe, param[P_BETA_S]);
    *state = s;
    return STATUS_OK;
}

static void release(struct scattering_state *s) { free(s); }

/* Probability of the highlight, by the weights of the channels; neither part gets probability 0. */
static float p_specular(const struct scattering_state *s, const float *weight_rgb)
{
    float a = 0, b = 0;
    for (int c = 0; c < 3; c++) {
        float w = weight_rgb != NULL ? weight_rgb[c] : 1, x = w * s->c_s[c], y = w * s->c_d[c] * s->not_c_s[c];
        a += x * x;
        b += y * y;
    }
    float p = sqrtf(a) / (sqrtf(a) + sqrtf(b));
    p = p < 0.95f ? p : 0.95f;
    return p > 0.05f ? p : 0.05f; /* 0/0 too */
}

static float eval_pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb,
                      float s_rgb[3], float *score)
{
    float cos_i = sqrtf(wi[1] * wi[1] + wi[2] * wi[2]), cos_o = sqrtf(wo[1] * wo[1] + wo[2] * wo[2]), d_beta;
    float m = cone_lobe_eval(&s->lobe, wi[0], cos_i, wo[0], cos_o, score != NULL ? &d_beta : NULL);
    float diffuse = (float)(M_1_PI * M_1_PI), p = p_specular(s, weight_rgb);
    float specular = m * (float)(0.5 * M_1_PI) / fmaxf(fmaxf(cos_i, cos_o), FIBER_COS_MIN);
    for (int c = 0; c < 3; c++) {
        s_rgb[c] = s->c_d[c] * s->not_c_s[c] * diffuse + s->c_s[c] * specular;
        if (score == NULL) continue;
        float *h = score + c * N_PARAM, inv = 1 / s_rgb[c];
        for (int k = 0; k < N_PARAM; k++) h[k] = 0;
        h[P_C_D + c] = s->not_c_s[c] * diffuse * inv;
        h[P_C_S + c] = (specular - s->c_d[c] * diffuse) * inv;
        h[P_BETA_S] = s->c_s[c] * specular * inv * d_beta;
    }
    return p * m * (float)(0.5 * M_1_PI) + (1 - p) * fmaxf(cos_i, FIBER_COS_MIN) * diffuse;
}

SCATTERING_EVAL_AND_PDF

static void sample(const struct scattering_state *s, const float wo[3], const float *weight_rgb, const float u[3],
                   float wi[3])
{
    float p = p_specular(s, weight_rgb), phi = (float)(2 * M_PI) * u[2], cos_o = sqrtf(wo[1] * wo[1] + wo[2] * wo[2]);
    float sin_i = u[0] < p ? cone_lobe_sample(&s->lobe, wo[0], cos_o, u[1], u[0] / p)
                           : sqrtf(u[1]) * cosf((float)(2 * M_PI) * (u[0] - p) / (1 - p)); /* cos^2 th d th */
    float cos_i = sqrtf((1 - sin_i) * (1 + sin_i));
    wi[0] = sin_i;
    wi[1] = cos_i * cosf(phi);
    wi[2] = cos_i * sinf(phi);
}

const struct scattering_model scattering_kajiya_kay = {
    SURFACE_MODEL_ROW(kajiya_kay), .prepare = prepare, .release = release, .eval = eval, .sample = sample, .pdf = pdf,
    .eval_pdf = eval_pdf,
};
