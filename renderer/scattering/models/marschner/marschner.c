/* marschner.v1: R, TT and TRT of a smooth dielectric cylinder (Marschner et al. 2003, "Light scattering from human hair
 * fibers") with the energy-conserving longitudinal lobe of d'Eon et al. 2011 (cone_lobe.h).
 *     S = (A_R N_R M_R + A_TT N_TT M_TT + A_TRT N_TRT M_TRT) / max(cos th_i, cos th_o)
 *   R:   N_R = cos(ph / 2) / 4, exact for a smooth cylinder (every offset h reflects to one ph); A_R = Fresnel at the
 * half angle of wi and wo, which is the angle of incidence. TT:  N_TT = von Mises of width gamma_TT about ph = pi; A_TT
 * = mean over h of (1 - F)^2 T TRT: N_TRT = von Mises of width gamma_TRT about ph = 0; A_TRT = mean over h of (1 - F)^2
 * F T^2 F: unpolarised Fresnel at cos = cos th_d sqrt(1 - h^2); T = C_T^(cos gamma_t / cos th_t), C_T the share of
 * light that one diameter lets through (the absorption is -ln C_T a diameter), sin gamma_t = h / eta' with Bravais'
 * index eta' = sqrt(eta^2 - sin^2 th_d) / cos th_d, sin th_t = sin th_d / eta. Simplified against the papers: TT and
 * TRT leave along the directions of the central ray (h = 0), their spread over h is part of the widths; attenuation is
 * averaged over h instead of following ph (so no caustics); no tilted scales (textile fibers have none); paths of more
 * than one inner reflection are dropped, which only loses energy. Reciprocal. Energy: wide TT and TRT lobes carry the A
 * of one th_d to others, so up to 1.49 of the light leaves at grazing directions (tests/physics/test_energy_bound.c).
 * A(th_d) and its derivatives by C_T and eta are tabulated over cos th_d (eta by central differences in double).
 */
#include "renderer/scattering/cone_lobe.h"
#include "renderer/scattering/fiber_direction.h"
#include "renderer/scattering/fresnel.h"
#include "renderer/scattering/models/marschner/marschner_rows.def"
#include "renderer/scattering/scattering_state.h"
#include "renderer/scattering/von_mises.h"

#include <stdlib.h>

enum { LOBE_R, LOBE_TT, LOBE_TRT, N_LOBE };
enum { N_PARAM = surface_marschner_n_param, P_C_T = 0, P_ETA = 3, P_BETA = 4, P_GAMMA = 7 };
enum { N_TABLE = 256, N_OFFSET = 96 };

struct attenuation_entry { /* at one cos th_d; [0] TT, [1] TRT */
    float value[2][3], d_c_t[2][3], d_eta[2][3];
    float reflected; /* mean Fresnel factor over h: for choosing lobes */
};

struct scattering_state {
    struct cone_lobe longitudinal[N_LOBE];
    struct von_mises azimuth[2]; /* TT, TRT */
    struct attenuation_entry attenuation[N_TABLE + 1];
    float fresnel[N_TABLE + 1][2]; /* by cos of the angle of incidence: F, d F / d eta */
};

/* Means over h: value and d / d C_T of TT and TRT for one transmittance; the mean Fresnel factor. */
static double mean_attenuation(double cos_d, double eta, double c_t, double value[2], double d_c_t[2])
{
    double sin2_d = 1 - cos_d * cos_d, cos_t = sqrt(1 - sin2_d / (eta * eta)), reflected = 0;
    double bravais2 = (eta * eta - sin2_d) / fmax(cos_d * cos_d, 1e-12), ln_c_t = log(c_t);
    for (int k = 0; k < 2; k++) value[k] = d_c_t[k] = 0;
    for (int i = 0; i < N_OFFSET; i++) { /* h = sin x: nodes crowd where Fresnel rises */
        double x = (i + 0.5) * M_PI_2 / N_OFFSET, h = sin(x), weight = cos(x) * M_PI_2 / N_OFFSET;
        double f = fresnel_unpolarised(cos_d * cos(x), eta, NULL), length = sqrt(fmax(0, 1 - h * h / bravais2)) / cos_t;
        double t = exp(ln_c_t * length), tt = (1 - f) * (1 - f) * t * weight, trt = tt * f * t;
        value[0] += tt;
        value[1] += trt;
        d_c_t[0] += tt * length / c_t;
        d_c_t[1] += trt * 2 * length / c_t;
        reflected += f * weight;
    }
    return reflected;
}

static void fill_tables(struct scattering_state *s, const double *param)
{
    const double eta = param[P_ETA], step = 1e-5;
    for (int i = 0; i <= N_TABLE; i++) {
        double cos_d = (double)i / N_TABLE;
        struct attenuation_entry *e = &s->attenuation[i];
        s->fresnel[i][0] = (float)fresnel_unpolarised(cos_d, eta, NULL);
        s->fresnel[i][1] =
            (float)((fresnel_unpolarised(cos_d, eta + step, NULL) - fresnel_unpolarised(cos_d, eta - step, NULL)) /
                    (2 * step));
        for (int c = 0; c < 3; c++) {
            double value[2], d_c_t[2], more[2], less[2], unused[2], c_t = param[P_C_T + c];
            e->reflected = (float)mean_attenuation(cos_d, eta, c_t, value, d_c_t);
            mean_attenuation(cos_d, eta + step, c_t, more, unused);
            mean_attenuation(cos_d, eta - step, c_t, less, unused);
            for (int k = 0; k < 2; k++) {
                e->value[k][c] = (float)value[k];
                e->d_c_t[k][c] = (float)d_c_t[k];
                e->d_eta[k][c] = (float)((more[k] - less[k]) / (2 * step));
            }
        }
    }
}

static status prepare(const double *param, struct scattering_state **state, struct error *err)
{
    status st =
        param_check(scattering_marschner.param, scattering_marschner.n_param, scattering_marschner.id, param, err);
    if (st != STATUS_OK) return st;
    struct scattering_state *s = malloc(sizeof *s);
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    for (int k = 0; k < N_LOBE; k++) cone_lobe_init(&s->longitudinal[k], param[P_BETA + k]);
    for (int k = 0; k < 2; k++) von_mises_init(&s->azimuth[k], param[P_GAMMA + k]);
    fill_tables(s, param);
    *state = s;
    return STATUS_OK;
}

static void release(struct scattering_state *s) { free(s); }

static inline float table_position(float cosine, int *i)
{
    float x = fminf(cosine, 1) * N_TABLE;
    *i = x < N_TABLE - 1 ? (int)x : N_TABLE - 1;
    return x - (float)*i;
}

static inline float mix(float a, float b, float t) { return a + t * (b - a); }

/* Probabilities of the lobes at th_o, by their energy and the weights of the channels; no lobe gets probability 0. */
static void lobe_shares(const struct scattering_state *s, float cos_o, const float *weight_rgb, float p[N_LOBE])
{
    int i;
    float t = table_position(cos_o, &i), sum = 0;
    const struct attenuation_entry *a = &s->attenuation[i], *b = a + 1;
    for (int k = 0; k < N_LOBE; k++) {
        p[k] = 0;
        for (int c = 0; c < 3; c++) {
            float w = weight_rgb != NULL ? weight_rgb[c] : 1;
            float e =
                w * (k == LOBE_R ? mix(a->reflected, b->reflected, t) : mix(a->value[k - 1][c], b->value[k - 1][c], t));
            p[k] += e * e;
        }
        p[k] = sqrtf(p[k]);
        sum += p[k];
    }
    for (int k = 0; k < N_LOBE; k++) p[k] = sum > 0 ? 0.1f + 0.7f * p[k] / sum : 1.0f / N_LOBE;
}

/* Angles between two directions, and the quantities that follow from them. */
struct geometry {
    float cos_i, cos_o, cos_d, cos_half; /* cos th_i, cos th_o, cos th_d, cos of the angle of incidence */
    float azimuth[N_LOBE];               /* N of each lobe */
    float one_minus_cos[2];              /* from the centre of TT and TRT */
};

static struct geometry geometry_of(const struct scattering_state *s, const float wi[3], const float wo[3])
{
    struct fiber_direction di = fiber_direction_of(wi), dout = fiber_direction_of(wo);
    struct geometry g = {.cos_i = di.cos_theta, .cos_o = dout.cos_theta};
    float c = g.cos_i + g.cos_o, x = wi[0] + wo[0], y = wi[1] + wo[1], z = wi[2] + wo[2];
    g.cos_d = 0.5f * sqrtf(c * c + x * x);
    g.cos_half = 0.5f * sqrtf(x * x + y * y + z * z);
    g.one_minus_cos[0] = fiber_one_minus_cos_opposite(&di, &dout); /* 1 + cos ph */
    float a = di.azimuth[0] - dout.azimuth[0], b = di.azimuth[1] - dout.azimuth[1];
    g.one_minus_cos[1] = 0.5f * (a * a + b * b);
    g.azimuth[LOBE_R] = 0.25f * sqrtf(0.5f * g.one_minus_cos[0]);
    for (int k = 0; k < 2; k++)
        g.azimuth[LOBE_TT + k] = s->azimuth[k].norm * expf(-s->azimuth[k].kappa * g.one_minus_cos[k]);
    return g;
}

static float eval_pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb,
                      float s_rgb[3], float *score)
{
    struct geometry g = geometry_of(s, wi, wo);
    float density[N_LOBE], d_beta[N_LOBE], share[N_LOBE], pdf = 0;
    lobe_shares(s, g.cos_o, weight_rgb, share);
    for (int k = 0; k < N_LOBE; k++) {
        density[k] = g.azimuth[k] * cone_lobe_eval(&s->longitudinal[k], wi[0], g.cos_i, wo[0], g.cos_o,
                                                   score != NULL ? &d_beta[k] : NULL);
        pdf += share[k] * density[k];
    }
    int i, j;
    float t = table_position(g.cos_d, &i), tf = table_position(g.cos_half, &j);
    const struct attenuation_entry *a = &s->attenuation[i], *b = a + 1;
    float inv_cos = 1 / fmaxf(fmaxf(g.cos_i, g.cos_o), FIBER_COS_MIN);
    float fresnel = mix(s->fresnel[j][0], s->fresnel[j + 1][0], tf);
    for (int c = 0; c < 3; c++) {
        float part[N_LOBE] = {fresnel * density[LOBE_R] * inv_cos};
        for (int k = 0; k < 2; k++) part[1 + k] = mix(a->value[k][c], b->value[k][c], t) * density[1 + k] * inv_cos;
        s_rgb[c] = part[0] + part[1] + part[2];
        if (score == NULL) continue;
        float *h = score + c * N_PARAM, inv = s_rgb[c] > 1e-30f ? 1 / s_rgb[c] : 0;
        for (int p = 0; p < N_PARAM; p++) h[p] = 0;
        h[P_ETA] = mix(s->fresnel[j][1], s->fresnel[j + 1][1], tf) * density[LOBE_R] * inv_cos * inv;
        for (int k = 0; k < N_LOBE; k++) h[P_BETA + k] = part[k] * inv * d_beta[k];
        for (int k = 0; k < 2; k++) {
            float each = density[1 + k] * inv_cos * inv;
            h[P_C_T + c] += mix(a->d_c_t[k][c], b->d_c_t[k][c], t) * each;
            h[P_ETA] += mix(a->d_eta[k][c], b->d_eta[k][c], t) * each;
            h[P_GAMMA + k] =
                part[1 + k] * inv * (s->azimuth[k].score_at_peak - s->azimuth[k].score_slope * g.one_minus_cos[k]);
        }
    }
    return pdf;
}

SCATTERING_EVAL_AND_PDF

static void sample(const struct scattering_state *s, const float wo[3], const float *weight_rgb, const float u[3],
                   float wi[3])
{
    struct fiber_direction dout = fiber_direction_of(wo);
    float share[N_LOBE], left = u[0], delta;
    lobe_shares(s, dout.cos_theta, weight_rgb, share);
    int k = 0;
    while (k < N_LOBE - 1 && left >= share[k]) left -= share[k++];
    left = fminf(left / share[k], 1); /* the unused part of u[0] is uniform again */
    float sin_i = cone_lobe_sample(&s->longitudinal[k], wo[0], dout.cos_theta, u[1], left);
    if (k == LOBE_R) /* up to the last 1e-6, where its density vanishes */
        delta = 2 * asinf((2 * u[2] - 1) * (1 - 1e-6f));
    else
        delta = von_mises_sample(&s->azimuth[k - LOBE_TT], u[2]) + (k == LOBE_TT ? (float)M_PI : 0);
    float cos_i = sqrtf((1 - sin_i) * (1 + sin_i)), c = cosf(delta), d = sinf(delta);
    wi[0] = sin_i;
    wi[1] = cos_i * (c * dout.azimuth[0] - d * dout.azimuth[1]);
    wi[2] = cos_i * (d * dout.azimuth[0] + c * dout.azimuth[1]);
}

const struct scattering_model scattering_marschner = {
    SURFACE_MODEL_ROW(marschner), .prepare = prepare, .release = release, .eval = eval, .sample = sample, .pdf = pdf,
    .eval_pdf = eval_pdf,
};
