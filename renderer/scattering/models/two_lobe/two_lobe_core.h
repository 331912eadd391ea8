/* Common part of two_lobe.v1, two_lobe_balanced.v1, two_lobe_diffuse.v1 and textile.v3: state, evaluation with scores,
 * sampling. Included by those files only.
 *
 *     S = F(th_f) M_R / (2 pi) + C_TT (1 - F(th_f)) M_TT f(ph_o; ph_i + pi, gamma_TT)
 *     F(t) = C_R + (1 - C_R)(1 - cos t)^5,   M = g(th_o; -th_i, beta) * (longitudinal scale)
 *     published: th_f = th_i, scale = 1 / G(-th_i, beta);  balanced: th_f = (th_i - th_o) / 2, scale = a(th_i) a(th_o)
 *                (R) and b(th_i) b(th_o) (TT); b depends on both widths (two_lobe_balanced.c)
 *
 * Sampling of wi: a lobe by its energy at th_o and the weights of the channels, th_i from the normal density about
 * -th_o cut to +-pi/2, azimuth uniform or von Mises. pdf() is the exact density of these samples. All functions are
 * inlined with `balanced` constant.
 */
#ifndef SELVEDGE_RENDERER_TWO_LOBE_CORE_H
#define SELVEDGE_RENDERER_TWO_LOBE_CORE_H

#include "renderer/scattering/fiber_direction.h"
#include "renderer/scattering/models/two_lobe/two_lobe_rows.def"
#include "renderer/scattering/scattering.h"
#include "renderer/scattering/von_mises.h"

#include <stdbool.h>
#include <stdlib.h>

enum { TWO_LOBE_N_TABLE = 1024, TWO_LOBE_N_PARAM = surface_two_lobe_n_param, TWO_LOBE_R = 0, TWO_LOBE_TT = 1 };
enum {
    TWO_LOBE_P_C_R = 0,
    TWO_LOBE_P_C_TT = 3,
    TWO_LOBE_P_BETA_R = 6,
    TWO_LOBE_P_BETA_TT = 7,
    TWO_LOBE_P_GAMMA_TT = 8
};

struct two_lobe_normal_entry { /* by |th|: G or the balanced scale, and its derivative by the lobe's own beta */
    float value[2], d_beta[2];
};

/* By |th_o|. Arrays of four floats are computed in one vector register each; the unused fourth energy is 0. */
struct two_lobe_sampling_entry {
    float energy[4]; /* from all around, before colours: integrals of M_R, M_R (1 - cos th)^5, M_TT (1 - (1 - cos th)^5)
                      */
    float near[2],
        far[2]; /* erf of the distance from the lobe's centre to the near and the far pole, in units of sqrt(2) beta */
};

struct scattering_state {
    /* not_c_r = 1 - c_r, rounded once: it is small where R takes nearly all. The fourth entry belongs to no channel: 1,
     * 1, 1, so that the channels are computed in vector registers. */
    float c_r[4], not_c_r[4], c_tt[4];
    float beta[2];
    float peak[2]; /* 1 / (sqrt(2 pi) beta) */
    float inv_2var[2];
    float inv[2], inv_cube[2]; /* 1 / beta, 1 / beta^3 */
    struct von_mises azimuth;
    struct two_lobe_normal_entry normal[TWO_LOBE_N_TABLE + 1];
    struct two_lobe_sampling_entry sampling[TWO_LOBE_N_TABLE + 1];
    float cross[TWO_LOBE_N_TABLE + 1]; /* balanced only, by |th|: d ln of TT's scale / d beta_R */
};

/* Everything but the tables. */
void two_lobe_state_init(struct scattering_state *s, const double *param);
/* All of two_lobe.v1, in memory of the caller. */
void two_lobe_init_published(struct scattering_state *s, const double *param);
/* Corrects the table of a balanced lobe's scale for linear interpolation, which lies above a convex function. */
void two_lobe_level_lines(struct scattering_state *s, int lobe);
/* near and far of the sampling table. */
void two_lobe_fill_reach(struct scattering_state *s);

static inline float two_lobe_table_position(float theta_rad, int *i)
{
    float x = fabsf(theta_rad) * (float)(TWO_LOBE_N_TABLE / M_PI_2);
    *i = x < TWO_LOBE_N_TABLE - 1 ? (int)x : TWO_LOBE_N_TABLE - 1;
    return x - (float)*i;
}

static inline float two_lobe_mix(float a, float b, float t) { return a + t * (b - a); }

/* Scale of both lobes and d ln scale / d beta at one angle. */
static inline void two_lobe_scale_at(const struct scattering_state *s, bool balanced, float theta_rad, float scale[2],
                                     float score[2])
{
    int i;
    float t = two_lobe_table_position(theta_rad, &i);
    const struct two_lobe_normal_entry *a = &s->normal[i], *b = a + 1;
    for (int k = 0; k < 2; k++) {
        float value = two_lobe_mix(a->value[k], b->value[k], t), d = two_lobe_mix(a->d_beta[k], b->d_beta[k], t);
        scale[k] = balanced ? value : 1 / value;
        score[k] = balanced ? d / value : -d / value;
    }
}

static inline float two_lobe_schlick(float cos_theta)
{
    float x = 1 - cos_theta, x2 = x * x;
    return x2 * x2 * x;
}

static inline float two_lobe_cross_at(const struct scattering_state *s, float theta_rad)
{
    int i;
    float t = two_lobe_table_position(theta_rad, &i);
    return two_lobe_mix(s->cross[i], s->cross[i + 1], t);
}

struct two_lobe_terms {
    float g[2]; /* normal densities g(th_o; -th_i, beta) */
    float x2;   /* (th_i + th_o)^2 */
    float one_minus_cos, von_mises;
};

static inline struct two_lobe_terms two_lobe_terms_of(const struct scattering_state *s,
                                                      const struct fiber_direction *di,
                                                      const struct fiber_direction *dout)
{
    struct two_lobe_terms t;
    float x = di->theta_rad + dout->theta_rad;
    t.x2 = x * x;
    t.one_minus_cos = fiber_one_minus_cos_opposite(di, dout);
    for (int k = 0; k < 2; k++) {
        float off = t.x2 * s->inv_2var[k]; /* beyond 104, expf is 0, after a slow test for underflow */
        t.g[k] = off > 104 ? 0 : s->peak[k] * expf(-off);
    }
    t.von_mises = s->azimuth.norm * expf(-s->azimuth.kappa * t.one_minus_cos);
    return t;
}

static inline void two_lobe_eval_terms(const struct scattering_state *s, bool balanced,
                                       const struct fiber_direction *di, const struct fiber_direction *dout,
                                       const struct two_lobe_terms *t, float s_rgb[3], float *score)
{
    float scale[2], d_scale[2], k;
    two_lobe_scale_at(s, balanced, di->theta_rad, scale, d_scale);
    if (balanced) {
        float scale_o[2], d_scale_o[2];
        two_lobe_scale_at(s, true, dout->theta_rad, scale_o, d_scale_o);
        for (int j = 0; j < 2; j++) {
            scale[j] *= scale_o[j];
            d_scale[j] += d_scale_o[j];
        }
        k = two_lobe_schlick(cosf(0.5f * (di->theta_rad - dout->theta_rad)));
    } else {
        k = two_lobe_schlick(di->cos_theta);
    }
    float a = t->g[TWO_LOBE_R] * scale[TWO_LOBE_R] * (float)(0.5 / M_PI);
    float b = t->g[TWO_LOBE_TT] * scale[TWO_LOBE_TT] * t->von_mises;
    float part_r[4], part_tt[4], sum[4];
    for (int c = 0; c < 4; c++) {
        float fresnel = s->c_r[c] + s->not_c_r[c] * k;
        part_r[c] = fresnel * a;
        part_tt[c] = s->c_tt[c] * s->not_c_r[c] * (1 - k) * b;
        sum[c] = part_r[c] + part_tt[c];
    }
    for (int c = 0; c < 3; c++) s_rgb[c] = sum[c];
    if (score == NULL) return;

    float d_width[2];
    for (int j = 0; j < 2; j++) d_width[j] = t->x2 * s->inv_cube[j] - s->inv[j] + d_scale[j];
    float d_cross = balanced ? two_lobe_cross_at(s, di->theta_rad) + two_lobe_cross_at(s, dout->theta_rad) : 0;
    float d_gamma = s->azimuth.score_at_peak - s->azimuth.score_slope * t->one_minus_cos;
    float d_c_r[4], d_c_tt[4], d_beta_r[4], d_beta_tt[4], d_gamma_tt[4];
    for (int c = 0; c < 4; c++) {
        float one = 1 / sum[c], inv = sum[c] > 1e-30f ? one : 0; /* nothing scattered: no weight, no score */
        d_c_r[c] = (1 - k) * (a - s->c_tt[c] * b) * inv;
        d_c_tt[c] = part_tt[c] / s->c_tt[c] * inv;
        d_beta_r[c] = (part_r[c] * d_width[TWO_LOBE_R] + part_tt[c] * d_cross) * inv;
        d_beta_tt[c] = part_tt[c] * inv * d_width[TWO_LOBE_TT];
        d_gamma_tt[c] = part_tt[c] * inv * d_gamma;
    }
    for (int j = 0; j < 3 * TWO_LOBE_N_PARAM; j++) score[j] = 0;
    for (int c = 0; c < 3; c++) {
        float *h = score + c * TWO_LOBE_N_PARAM;
        h[TWO_LOBE_P_C_R + c] = d_c_r[c];
        h[TWO_LOBE_P_C_TT + c] = d_c_tt[c];
        h[TWO_LOBE_P_BETA_R] = d_beta_r[c];
        h[TWO_LOBE_P_BETA_TT] = d_beta_tt[c];
        h[TWO_LOBE_P_GAMMA_TT] = d_gamma_tt[c];
    }
}

static inline struct two_lobe_sampling_entry two_lobe_sampling_at(const struct scattering_state *s, float theta_rad)
{
    int i;
    float t = two_lobe_table_position(theta_rad, &i);
    const struct two_lobe_sampling_entry *a = &s->sampling[i], *b = a + 1;
    struct two_lobe_sampling_entry e;
    for (int k = 0; k < 4; k++) e.energy[k] = two_lobe_mix(a->energy[k], b->energy[k], t);
    for (int k = 0; k < 2; k++) {
        e.near[k] = two_lobe_mix(a->near[k], b->near[k], t);
        e.far[k] = two_lobe_mix(a->far[k], b->far[k], t);
    }
    return e;
}

/* Probability of drawing from the R lobe: least summed variance of the channels, so in proportion to the root of the
 * channels' summed squares. Neither lobe is starved: both carry derivatives even where one is dark. */
static inline float two_lobe_p_r(const struct scattering_state *s, const struct two_lobe_sampling_entry *e,
                                 const float *weight_rgb)
{
    float r = 0, tt = 0, r2[4], tt2[4], w[4] = {1, 1, 1, 1};
    for (int c = 0; c < 3 && weight_rgb != NULL; c++) w[c] = weight_rgb[c];
    for (int c = 0; c < 4; c++) {
        float a = w[c] * (s->c_r[c] * e->energy[0] + s->not_c_r[c] * e->energy[1]),
              b = w[c] * s->c_tt[c] * s->not_c_r[c] * e->energy[2];
        r2[c] = a * a;
        tt2[c] = b * b;
    }
    for (int c = 0; c < 3; c++) {
        r += r2[c];
        tt += tt2[c];
    }
    r = sqrtf(r);
    float p = r / (r + sqrtf(tt));
    p = p < 0.95f ? p : 0.95f;
    return p > 0.05f ? p : 0.05f; /* 0/0 too */
}

/* scattering_view.part: the probability of the R lobe, and near and far of the sampling table, R before TT. */
enum { TWO_LOBE_V_P_R, TWO_LOBE_V_NEAR, TWO_LOBE_V_FAR = TWO_LOBE_V_NEAR + 2 };

static inline float two_lobe_pdf_terms(const struct fiber_direction *di, const struct scattering_view *v,
                                       const struct two_lobe_terms *t)
{
    const float *near = v->part + TWO_LOBE_V_NEAR, *far = v->part + TWO_LOBE_V_FAR, p_r = v->part[TWO_LOBE_V_P_R];
    float r = t->g[TWO_LOBE_R] * 2 / (near[TWO_LOBE_R] + far[TWO_LOBE_R]) * (float)(0.5 / M_PI);
    float tt = t->g[TWO_LOBE_TT] * 2 / (near[TWO_LOBE_TT] + far[TWO_LOBE_TT]) * t->von_mises;
    return (p_r * r + (1 - p_r) * tt) / (di->cos_theta > FIBER_COS_MIN ? di->cos_theta : FIBER_COS_MIN);
}

static inline float two_lobe_eval_pdf(const struct scattering_state *s, bool balanced, const float wi[3],
                                      const struct scattering_view *v, float s_rgb[3], float *score)
{
    struct fiber_direction di = fiber_direction_of(wi);
    struct two_lobe_terms t = two_lobe_terms_of(s, &di, &v->out);
    two_lobe_eval_terms(s, balanced, &di, &v->out, &t, s_rgb, score);
    return two_lobe_pdf_terms(&di, v, &t);
}

/* th_i from the normal density about -th_o cut to +-pi/2. */
float two_lobe_sample_theta(const struct scattering_state *s, const float near[2], const float far[2], int lobe,
                            float theta_o, float u);
/* Shared by both models as they are. */
void two_lobe_sample(const struct scattering_state *s, const float wo[3], const float *weight_rgb, const float u[3],
                     float wi[3]);
float two_lobe_pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb);
void two_lobe_view_of(const struct scattering_state *s, const float wo[3], const float *weight_rgb,
                      struct scattering_view *view);
void two_lobe_sample_view(const struct scattering_state *s, const struct scattering_view *view, const float u[3],
                          float wi[3]);
void two_lobe_release(struct scattering_state *s);
/* scattering_model.lobe_rad */
float two_lobe_lobe_rad(const struct scattering_state *s);

#endif
