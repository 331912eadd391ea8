/* fur_near.v1: the near field (fur.h states the model). Sampling: a mode by its share at th_d = th_o and the weights of
 * the channels; of R, TT, TRT th_i from M and the azimuth from D about the true Phi(th_d, h); of the rest th_i from the
 * lobe of TRT and any azimuth; of scattered light any direction. */
#include "renderer/scattering/models/dielectric/near_azimuth.h"
#include "renderer/scattering/models/dielectric/near_view.h"
#include "renderer/scattering/models/fur/fur.h"
#include "renderer/scattering/scattering_state.h"

#include <stdlib.h>

#define LEAST_PROBABILITY 0.03 /* of a way to sample: none is starved, because all carry derivatives */
/* Ways to sample: by the lobes, of the rest, of scattered light. */
enum { BY_REST = FUR_N_LOBE, BY_MEDULLA, N_WAY };

struct scattering_state {
    struct fur_along along;
    struct medulla_around around;
    struct near_azimuth azimuth[FUR_N_LOBE];
    double c_t[3], ln_c_t[3];
};

static status fill(struct scattering_state *s, const double *param, struct thread_pool *pool, struct error *err)
{
    medulla_around_init(&s->around, param[FUR_P_G]);
    for (int p = 0; p < FUR_N_LOBE; p++)
        near_azimuth_init(&s->azimuth[p], NEAR_GAUSSIAN, sqrt(p + 1.0) * param[FUR_P_GAMMA]);
    for (int c = 0; c < 3; c++) {
        s->c_t[c] = param[FUR_P_C_T + c];
        s->ln_c_t[c] = log(s->c_t[c]);
    }
    return fur_along_init(&s->along, param, pool, err);
}

static status prepare_shared(const double *param, struct thread_pool *pool, struct scattering_state **state,
                             struct error *err)
{
    return scattering_state_new(&scattering_fur_near, param, fill, sizeof **state, pool, state, err);
}

static status prepare(const double *param, struct scattering_state **state, struct error *err)
{
    return prepare_shared(param, NULL, state, err);
}

static void release(struct scattering_state *s) { free(s); }

/* Factor of the share of each mode, and its derivatives by the parameters that it depends on. */
enum by { BY_ETA, BY_KAPPA, BY_MS, BY_G, BY_ALPHA, BY_BETA, BY_GAMMA, N_BY };
static const int param_of[N_BY] = {FUR_P_ETA, FUR_P_KAPPA, FUR_P_MS, FUR_P_G, FUR_P_ALPHA, FUR_P_BETA, FUR_P_GAMMA};

struct factors {
    struct near_view view;
    struct fur_ray ray; /* at th_d */
    float m[FUR_N_LOBE];
    double d_azimuth[FUR_N_LOBE];                      /* D */
    float d_scale[FUR_N_SCALE], d_wide[FUR_N_MEAN_BY]; /* d ln of the scales of lobes and of scattered light */
    double value[FUR_N_MODE], d[FUR_N_MODE][N_BY];
};

/* R, TT, TRT and the rest. */
static void add_lobes(const struct scattering_state *s, bool want, struct factors *f)
{
    float by[FUR_N_LOBE][2];
    for (int q = 0; q < FUR_N_SCALE; q++) f->d_scale[q] = 0;
    const double scale = (double)fur_scale_at(&s->along, f->view.in.theta_rad, f->d_scale) *
                         (double)fur_scale_at(&s->along, f->view.out.theta_rad, f->d_scale);
    for (int p = 0; p < FUR_N_LOBE; p++) {
        f->m[p] =
            tilted_lobe_eval(&s->along.lobe[p], f->view.in.theta_rad + f->view.out.theta_rad, want ? by[p] : NULL);
        double d[2], m = scale * (double)f->m[p], azimuth = 2 * p * f->ray.gamma_t - 2 * f->view.x + p * M_PI;
        double value = near_azimuth_eval(&s->azimuth[p], remainder(f->view.phi - azimuth, 2 * M_PI), want ? d : NULL);
        f->d_azimuth[p] = value;
        f->value[p] = m * value;
        if (!want) continue;
        f->d[p][BY_ETA] = -m * d[0] * 2 * p * f->ray.d_gamma_t;
        f->d[p][BY_GAMMA] = m * d[1] * sqrt(p + 1.0);
        f->d[p][BY_ALPHA] = scale * value * (double)by[p][0] * fur_shift[p];
        f->d[p][BY_BETA] = scale * value * (double)by[p][1] * fur_width[p];
    }
    const double rest = scale * (double)f->m[FUR_TRT] * (0.5 / M_PI);
    f->value[FUR_REST] = rest;
    if (!want) return;
    f->d[FUR_REST][BY_ALPHA] = scale * (0.5 / M_PI) * (double)by[FUR_TRT][0] * fur_shift[FUR_TRT];
    f->d[FUR_REST][BY_BETA] = scale * (0.5 / M_PI) * (double)by[FUR_TRT][1] * fur_width[FUR_TRT];
}

/* TT^s and TRT^s. */
static void add_scattered(const struct scattering_state *s, bool want, struct factors *f)
{
    float half[MEDULLA_N_HALF], d_half[MEDULLA_N_BY][MEDULLA_N_HALF];
    const double through = fabs(f->view.phi) / M_PI, side = f->view.x < 0 ? -1 : 1;
    double d_depth[3], along, d_along[MEDULLA_N_BY], depth = fur_depth(&s->along.fiber, &f->ray, d_depth);
    struct medulla_ray medulla;
    const float in = f->view.in.theta_rad, out = f->view.out.theta_rad;
    medulla_along_at(&s->along.medulla, in + out, in - out, half, want ? d_half : NULL);
    medulla_ray_init(&s->around, depth, f->ray.offset.v, &medulla);
    const double scale =
        (double)fur_scattered_scale(&s->along, &f->view.in, &f->view.out, (float)f->view.cos_d, f->d_wide);
    along = scale * ((1 - through) * (double)half[0] + through * (double)half[1]);
    for (int q = 0; q < MEDULLA_N_BY && want; q++)
        d_along[q] = scale * ((1 - through) * (double)d_half[q][0] + through * (double)d_half[q][1]);
    for (int segment = 1; segment <= FUR_N_SEGMENT; segment++) {
        const int mode = FUR_TT_S + segment - 1;
        double d_azimuth, azimuth = fur_segment_azimuth(&f->ray, segment, f->view.x, &d_azimuth);
        double d[MEDULLA_RAY_N_BY + 1];
        double value = medulla_ray_density(&medulla, side * (f->view.phi - azimuth), want ? d : NULL);
        f->value[mode] = along * value;
        if (!want) continue;
        const double by_depth = along * d[MEDULLA_RAY_BY_DEPTH], by_offset = along * d[MEDULLA_RAY_BY_OFFSET];
        f->d[mode][BY_ETA] =
            by_depth * d_depth[0] + by_offset * f->ray.offset.eta - along * side * d[MEDULLA_RAY_N_BY] * d_azimuth;
        f->d[mode][BY_KAPPA] = by_depth * d_depth[1] + by_offset * f->ray.offset.kappa +
                               value * d_along[MEDULLA_BY_DEPTH] * s->along.fiber.sigma_ms;
        f->d[mode][BY_MS] = by_depth * d_depth[2] + value * d_along[MEDULLA_BY_DEPTH] * s->along.fiber.kappa;
        f->d[mode][BY_G] = along * d[MEDULLA_RAY_BY_G] + value * d_along[MEDULLA_BY_G];
    }
}

static void factors_of(const struct scattering_state *s, const float wi[3], const float wo[3], bool want,
                       struct factors *f)
{
    f->view = near_view_of(wi, wo);
    f->ray = fur_ray_at(&s->along.fiber, f->view.cos_d, f->view.x);
    if (want)
        for (int k = 0; k < FUR_N_MODE; k++)
            for (int q = 0; q < N_BY; q++) f->d[k][q] = 0;
    add_lobes(s, want, f);
    add_scattered(s, want, f);
}

/* Scores of one channel, `a` the shares of the modes. */
static void scores(const struct scattering_state *s, const struct factors *f, const struct fur_shares *a, int c,
                   float *score)
{
    static const int of_share[FUR_N_BY] = {-1, FUR_P_ETA, FUR_P_KAPPA, FUR_P_LAYERS, FUR_P_MS, FUR_P_MA};
    static const int of_scale[FUR_N_SCALE] = {FUR_P_ETA, FUR_P_KAPPA, FUR_P_LAYERS, FUR_P_MS,
                                              FUR_P_G,   FUR_P_ALPHA, FUR_P_BETA};
    double part[FUR_N_PART][FUR_N_BY], weight[FUR_N_PART] = {0}, by[FUR_N_PARAM] = {0}, sum = 0, lobes = 0, wide = 0;
    fur_parts(&s->along.fiber, &f->ray, s->ln_c_t[c], part);
    for (int k = 0; k < FUR_N_MODE; k++) {
        const double light = a->value[k] * f->value[k];
        sum += light;
        *(k == FUR_TT_S || k == FUR_TRT_S ? &wide : &lobes) += light;
        for (int p = 0; p < FUR_N_PART; p++) weight[p] += f->value[k] * a->d[k][p];
        for (int q = 0; q < N_BY; q++) by[param_of[q]] += a->value[k] * f->d[k][q];
    }
    for (int q = 0; q < FUR_N_BY; q++) {
        double slope = 0;
        for (int p = 0; p < FUR_N_PART; p++) slope += weight[p] * part[p][q];
        by[q == FUR_BY_C ? FUR_P_C_T + c : of_share[q]] += q == FUR_BY_C ? slope / s->c_t[c] : slope;
    }
    for (int q = 0; q < FUR_N_SCALE; q++) by[of_scale[q]] += lobes * (double)f->d_scale[q];
    for (int q = 0; q < FUR_N_MEAN_BY; q++) by[of_scale[q]] += wide * (double)f->d_wide[q];
    for (int k = 0; k < FUR_N_PARAM; k++) score[k] = (float)(sum > 1e-30 ? by[k] / sum : 0);
}

static void eval_at(const struct scattering_state *s, const struct factors *f, float s_rgb[3], float *score)
{
    for (int c = 0; c < 3; c++) {
        const struct fur_shares a = fur_shares_of(&s->along.fiber, &f->ray, s->ln_c_t[c]);
        double sum = 0;
        for (int k = 0; k < FUR_N_MODE; k++) sum += a.value[k] * f->value[k];
        s_rgb[c] = (float)sum;
        if (score != NULL) scores(s, f, &a, c, score + (size_t)c * FUR_N_PARAM);
    }
}

/* Probabilities of the ways to sample for a view. */
static void probabilities(const struct scattering_state *s, const struct fiber_direction *out, double x,
                          const float *weight_rgb, double p[N_WAY])
{
    static const int way[FUR_N_MODE] = {FUR_R, FUR_TT, FUR_TRT, BY_MEDULLA, BY_MEDULLA, BY_REST};
    const struct fur_ray ray = fur_ray_at(&s->along.fiber, fmax((double)out->cos_theta, NEAR_LEAST_COSINE_D), x);
    double sum = 0;
    for (int k = 0; k < N_WAY; k++) p[k] = 0;
    for (int c = 0; c < 3; c++) {
        const struct fur_shares a = fur_shares_of(&s->along.fiber, &ray, s->ln_c_t[c]);
        double weight = weight_rgb != NULL ? (double)weight_rgb[c] : 1, energy[N_WAY] = {0};
        for (int k = 0; k < FUR_N_MODE; k++) energy[way[k]] += weight * a.value[k];
        for (int k = 0; k < N_WAY; k++) p[k] += energy[k] * energy[k];
    }
    for (int k = 0; k < N_WAY; k++) sum += p[k] = sqrt(p[k]);
    for (int k = 0; k < N_WAY; k++) {
        double share = sum > 0 ? p[k] / sum : 1.0 / N_WAY;
        p[k] = LEAST_PROBABILITY + (1 - N_WAY * LEAST_PROBABILITY) * share;
    }
}

static float density(const struct scattering_state *s, const struct factors *f, const float *weight_rgb)
{
    const struct near_view *g = &f->view;
    double p[N_WAY], sum = 0, trt = 0;
    probabilities(s, &g->out, g->x, weight_rgb, p);
    for (int k = 0; k < FUR_N_LOBE; k++) {
        trt = (double)tilted_lobe_density(&s->along.lobe[k], g->in.theta_rad, g->out.theta_rad, f->m[k]);
        sum += p[k] * trt * f->d_azimuth[k];
    }
    sum = (sum + p[BY_REST] * trt * (0.5 / M_PI)) / (double)fmaxf(g->in.cos_theta, FIBER_COS_MIN);
    return (float)(sum + p[BY_MEDULLA] * (0.25 / M_PI));
}

static float eval_pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb,
                      float s_rgb[3], float *score)
{
    struct factors f;
    factors_of(s, wi, wo, score != NULL, &f);
    eval_at(s, &f, s_rgb, score);
    return density(s, &f, weight_rgb);
}

static void eval(const struct scattering_state *s, const float wi[3], const float wo[3], float s_rgb[3], float *score)
{
    struct factors f;
    factors_of(s, wi, wo, score != NULL, &f);
    eval_at(s, &f, s_rgb, score);
}

static float pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb)
{
    struct factors f;
    f.view = near_view_of(wi, wo);
    f.ray = fur_ray_at(&s->along.fiber, f.view.cos_d, f.view.x);
    add_lobes(s, false, &f);
    return density(s, &f, weight_rgb);
}

static void sample(const struct scattering_state *s, const float wo[3], const float *weight_rgb, const float u[3],
                   float wi[3])
{
    const struct fiber_direction out = fiber_direction_of(wo);
    const double x = near_offset_angle(&out);
    double p[N_WAY], rest = (double)u[0], phi = 2 * M_PI * (double)u[2];
    int k = 0;
    probabilities(s, &out, x, weight_rgb, p);
    while (k < N_WAY - 1 && rest >= p[k]) rest -= p[k++];
    float sin_i = 2 * u[1] - 1, cos_i = sqrtf((1 - sin_i) * (1 + sin_i));
    if (k != BY_MEDULLA) {
        float theta = tilted_lobe_sample(&s->along.lobe[k == BY_REST ? FUR_TRT : k], out.theta_rad, u[1]);
        sin_i = sinf(theta);
        cos_i = fmaxf(cosf(theta), 0); /* near a pole the sine does not know it */
    }
    if (k < FUR_N_LOBE) {
        double cos_d = near_cosine_d((double)sin_i, (double)cos_i, (double)wo[0], (double)out.cos_theta);
        const struct fur_ray ray = fur_ray_at(&s->along.fiber, cos_d, x);
        phi = 2 * k * ray.gamma_t - 2 * x + k * M_PI + near_azimuth_sample(&s->azimuth[k], u[2]);
    }
    near_direction(&out, sin_i, cos_i, phi, wi);
}

const struct scattering_model scattering_fur_near = {
    SURFACE_MODEL_ROW(fur_near), .near_field = true, .prepare = prepare, .prepare_shared = prepare_shared,
    .release = release,          .eval = eval,       .sample = sample,   .pdf = pdf,
    .eval_pdf = eval_pdf,
};
