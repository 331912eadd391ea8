/* near_field.h states the model. Sampling: a mode by its share at th_d = th_o and the weights of the channels, th_i
 * from M, and then the azimuth from D about the true Phi(th_d, h). */
#include "renderer/scattering/models/dielectric/near_field.h"
#include "renderer/scattering/models/dielectric/dielectric_ray.h"
#include "renderer/scattering/models/dielectric/near_view.h"

#include <stdlib.h>
#include <string.h>

#define LEAST_PROBABILITY 0.03 /* of a mode: no mode is starved, because all carry derivatives */

status near_field_finish(struct scattering_state *s, double beta_rad, struct scattering_state **state,
                         struct error *err)
{
    for (int c = 0; c < 3; c++) s->ln_c_t[c] = log(s->c_t[c]);
    status st = dielectric_along_init(&s->along, s->eta, beta_rad, err);
    if (st == STATUS_OK)
        *state = s;
    else
        free(s);
    return st;
}

void near_field_release(struct scattering_state *s) { free(s); }

/* A pair of directions. */
struct pair {
    struct near_view view;
    struct dielectric_ray ray; /* at th_d */
};

static struct pair pair_of(const struct scattering_state *s, const float wi[3], const float wo[3])
{
    struct pair g = {.view = near_view_of(wi, wo)};
    g.ray = dielectric_ray_at(g.view.cos_d, g.view.x, s->eta);
    return g;
}

/* D of each lobe, and its derivatives by eta and by its width when `d` is not NULL. */
static void azimuths(const struct scattering_state *s, const struct pair *g, double value[DIELECTRIC_N_LOBE],
                     double (*d)[2])
{
    for (int p = 0; p < DIELECTRIC_N_LOBE; p++) {
        double d_eta, centre = dielectric_azimuth(&g->ray, p, g->view.x, &d_eta), by[2];
        value[p] = near_azimuth_eval(&s->azimuth[p], remainder(g->view.phi - centre, 2 * M_PI), d != NULL ? by : NULL);
        if (d == NULL) continue;
        d[p][0] = -by[0] * d_eta;
        d[p][1] = by[1] * s->d_width[p];
    }
}

/* Probabilities of the modes for a view. */
static void mode_probabilities(const struct scattering_state *s, const struct fiber_direction *out, double x,
                               const float *weight_rgb, double p[DIELECTRIC_N_MODE])
{
    struct dielectric_ray ray = dielectric_ray_at(fmax((double)out->cos_theta, NEAR_LEAST_COSINE_D), x, s->eta);
    double sum = 0;
    memset(p, 0, DIELECTRIC_N_MODE * sizeof *p);
    for (int c = 0; c < 3; c++) {
        struct dielectric_shares a = dielectric_shares_of(&ray, s->c_t[c], s->ln_c_t[c]);
        double weight = weight_rgb != NULL ? (double)weight_rgb[c] : 1;
        for (int k = 0; k < DIELECTRIC_N_MODE; k++) p[k] += weight * weight * a.value[k] * a.value[k];
    }
    for (int k = 0; k < DIELECTRIC_N_MODE; k++) sum += p[k] = sqrt(p[k]);
    for (int k = 0; k < DIELECTRIC_N_MODE; k++) {
        double share = sum > 0 ? p[k] / sum : 1.0 / DIELECTRIC_N_MODE;
        p[k] = LEAST_PROBABILITY + (1 - DIELECTRIC_N_MODE * LEAST_PROBABILITY) * share;
    }
}

static float density(const struct scattering_state *s, const struct pair *g, const float *weight_rgb,
                     const float m[DIELECTRIC_N_LOBE], const double azimuth[DIELECTRIC_N_LOBE])
{
    double p[DIELECTRIC_N_MODE];
    mode_probabilities(s, &g->view.out, g->view.x, weight_rgb, p);
    double sum = p[DIELECTRIC_REST] * (double)m[DIELECTRIC_TRT] * (0.5 / M_PI);
    for (int k = 0; k < DIELECTRIC_N_LOBE; k++) sum += p[k] * (double)m[k] * azimuth[k];
    return (float)sum;
}

/* The factors of S of each mode: those along and around the fiber. */
struct factors {
    float m[DIELECTRIC_N_LOBE], d_beta[DIELECTRIC_N_LOBE];
    double azimuth[DIELECTRIC_N_LOBE], d_azimuth[DIELECTRIC_N_LOBE][2];
};

static void factors_of(const struct scattering_state *s, const struct pair *g, const float wi[3], const float wo[3],
                       bool want_scores, struct factors *f)
{
    dielectric_longitudinal(&s->along, wi[0], g->view.in.cos_theta, wo[0], g->view.out.cos_theta, f->m,
                            want_scores ? f->d_beta : NULL);
    azimuths(s, g, f->azimuth, want_scores ? f->d_azimuth : NULL);
}

/* Scores of one channel: `sum` is S without the scale, `a` the shares of the modes. */
static void scores(const struct scattering_state *s, const struct factors *f, const struct dielectric_shares *a,
                   double sum, const double d_scale[2], int c, float *score)
{
    double by_c_t = 0, by_eta = 0, by_beta = 0, by_around = 0, inv = sum > 1e-30 ? 1 / sum : 0;
    for (int p = 0; p < DIELECTRIC_N_MODE; p++) {
        int lobe = p < DIELECTRIC_N_LOBE ? p : DIELECTRIC_TRT;
        double m = (double)f->m[lobe], d = p < DIELECTRIC_N_LOBE ? f->azimuth[p] : 0.5 / M_PI;
        by_c_t += m * d * a->d_c_t[p];
        by_eta += m * d * a->d_eta[p];
        by_beta += m * d * a->value[p] * (double)f->d_beta[lobe];
        if (p == DIELECTRIC_REST) continue;
        by_eta += m * f->d_azimuth[p][0] * a->value[p];
        by_around += m * f->d_azimuth[p][1] * a->value[p];
    }
    for (int k = 0; k < NEAR_N_PARAM; k++) score[k] = 0;
    score[NEAR_P_COLOR + c] = (float)(by_c_t * inv * s->d_c_t[c]);
    score[NEAR_P_ETA] = (float)(by_eta * inv + d_scale[0]);
    score[NEAR_P_ALONG] = (float)((by_beta * inv + d_scale[1]) * s->d_beta);
    score[NEAR_P_AROUND] = (float)((by_around + by_c_t * s->d_c_t_around[c]) * inv);
}

static void eval_at(const struct scattering_state *s, const struct pair *g, const struct factors *f, float s_rgb[3],
                    float *score)
{
    float d_in[2], d_out[2];
    double scale = (double)dielectric_scale_at(&s->along, g->view.in.theta_rad, d_in) *
                   (double)dielectric_scale_at(&s->along, g->view.out.theta_rad, d_out);
    const double d_scale[2] = {(double)(d_in[0] + d_out[0]), (double)(d_in[1] + d_out[1])};
    for (int c = 0; c < 3; c++) {
        struct dielectric_shares a = dielectric_shares_of(&g->ray, s->c_t[c], s->ln_c_t[c]);
        double sum = (double)f->m[DIELECTRIC_TRT] * a.value[DIELECTRIC_REST] * (0.5 / M_PI);
        for (int p = 0; p < DIELECTRIC_N_LOBE; p++) sum += (double)f->m[p] * f->azimuth[p] * a.value[p];
        s_rgb[c] = (float)(scale * sum);
        if (score != NULL) scores(s, f, &a, sum, d_scale, c, score + (size_t)c * NEAR_N_PARAM);
    }
}

float near_field_eval_pdf(const struct scattering_state *s, const float wi[3], const float wo[3],
                          const float *weight_rgb, float s_rgb[3], float *score)
{
    const struct pair g = pair_of(s, wi, wo);
    struct factors f;
    factors_of(s, &g, wi, wo, score != NULL, &f);
    eval_at(s, &g, &f, s_rgb, score);
    return density(s, &g, weight_rgb, f.m, f.azimuth);
}

void near_field_eval(const struct scattering_state *s, const float wi[3], const float wo[3], float s_rgb[3],
                     float *score)
{
    const struct pair g = pair_of(s, wi, wo);
    struct factors f;
    factors_of(s, &g, wi, wo, score != NULL, &f);
    eval_at(s, &g, &f, s_rgb, score);
}

float near_field_pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb)
{
    const struct pair g = pair_of(s, wi, wo);
    struct factors f;
    factors_of(s, &g, wi, wo, false, &f);
    return density(s, &g, weight_rgb, f.m, f.azimuth);
}

void near_field_sample(const struct scattering_state *s, const float wo[3], const float *weight_rgb, const float u[3],
                       float wi[3])
{
    const struct fiber_direction out = fiber_direction_of(wo);
    const double x = near_offset_angle(&out);
    double p[DIELECTRIC_N_MODE], rest = (double)u[0], phi = 2 * M_PI * (double)u[2];
    int k = 0;
    mode_probabilities(s, &out, x, weight_rgb, p);
    while (k < DIELECTRIC_N_MODE - 1 && rest >= p[k]) rest -= p[k++];
    float left = fminf((float)(rest / p[k]), 0x1.fffffep-1f); /* the unused part of u[0] is uniform again */
    const struct cone_lobe *lobe = &s->along.longitudinal[k < DIELECTRIC_N_LOBE ? k : DIELECTRIC_TRT];
    float sin_i = cone_lobe_sample(lobe, wo[0], out.cos_theta, u[1], left);
    float cos_i = sqrtf((1 - sin_i) * (1 + sin_i));
    if (k < DIELECTRIC_N_LOBE) {
        double d_eta, cos_d = near_cosine_d((double)sin_i, (double)cos_i, (double)wo[0], (double)out.cos_theta);
        struct dielectric_ray ray = dielectric_ray_at(cos_d, x, s->eta);
        phi = dielectric_azimuth(&ray, k, x, &d_eta) + near_azimuth_sample(&s->azimuth[k], u[2]);
    }
    near_direction(&out, sin_i, cos_i, phi, wi);
}
