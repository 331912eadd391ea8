/* hair_mixture.v1: two hair materials on one fiber, as other renderers have them. Each is the model of Chiang et al.
 * 2016, "A Practical and Controllable Hair and Fur Model for Production Path Tracing", without tilted scales, as
 * Mitsuba 3 ("hair"), pbrt-v4 ("hair") and Blender (Principled Hair BSDF) have it:
 *
 *     S(wi, wo) cos th_i = sum over materials k of share_k [ sum over R, TT, TRT of M_p(th_i, th_o) A_p(th_o, h)
 *                          D(ph - Phi_p(th_o, h)) + M_TRT A_rest(th_o, h) / (2 pi) ]
 *
 * It differs from chiang.v1 in the published factor 1 / cos th_i, and in attenuation and azimuth at th_o, the angle of
 * the view, in place of the difference angle: S is lossless for light that is followed from the view, and not
 * reciprocal. near_field.h and chiang.c define M, A, D and Phi.
 *
 * Sampling: a material and a mode by their shares at th_o and the weights of the channels, th_i from M, and then the
 * azimuth from D about Phi. Without absorption the weights are 1 wherever no mode has its least probability.
 */
#include "renderer/scattering/models/dielectric/chiang_width.h"
#include "renderer/scattering/models/dielectric/dielectric_along.h"
#include "renderer/scattering/models/dielectric/dielectric_ray.h"
#include "renderer/scattering/models/dielectric/near_azimuth.h"
#include "renderer/scattering/models/dielectric/near_view.h"

#include <stdlib.h>
#include <string.h>

enum { N_MATERIAL = 2, P_COLOR = 0, P_ETA = 3, P_ALONG, P_AROUND, N_OWN, P_SHARE = N_MATERIAL * N_OWN, N_PARAM };
enum { N_MODE = N_MATERIAL * DIELECTRIC_N_MODE };
_Static_assert((int)N_PARAM == (int)surface_hair_mixture_n_param, "the row of the model has these parameters");

#define LEAST_PROBABILITY 0.01 /* of a mode: no mode is starved, because all carry derivatives */

struct material {
    struct cone_lobe longitudinal[DIELECTRIC_N_LOBE];
    struct near_azimuth azimuth;
    double eta, c_t[3], ln_c_t[3];
    double d_beta, d_width; /* of the widths, by beta_M and beta_N */
};

struct scattering_state {
    struct material material[N_MATERIAL];
    double share[N_MATERIAL];
};

static void material_init(struct material *m, const double *param)
{
    double beta_rad = chiang_width_along_rad(param[P_ALONG], &m->d_beta);
    double width = chiang_width_around_rad(param[P_AROUND], &m->d_width);
    for (int p = 0; p < DIELECTRIC_N_LOBE; p++) cone_lobe_init(&m->longitudinal[p], dielectric_width[p] * beta_rad);
    near_azimuth_init(&m->azimuth, NEAR_LOGISTIC, width);
    m->eta = param[P_ETA];
    for (int c = 0; c < 3; c++) {
        m->c_t[c] = param[P_COLOR + c];
        m->ln_c_t[c] = log(m->c_t[c]);
    }
}

static status prepare(const double *param, struct scattering_state **state, struct error *err)
{
    status st = param_check(surface_hair_mixture_param, N_PARAM, surface_hair_mixture_id, param, err);
    if (st != STATUS_OK) return st;
    struct scattering_state *s = calloc(1, sizeof *s);
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    for (int k = 0; k < N_MATERIAL; k++) material_init(&s->material[k], param + (size_t)k * N_OWN);
    s->share[1] = param[P_SHARE];
    s->share[0] = 1 - s->share[1];
    *state = s;
    return STATUS_OK;
}

static void release(struct scattering_state *s) { free(s); }

/* A pair of directions. */
struct pair {
    struct near_view view;
    struct dielectric_ray ray[N_MATERIAL]; /* at th_o */
};

static double cosine_of_view(const struct fiber_direction *out)
{
    return fmax((double)out->cos_theta, NEAR_LEAST_COSINE_D);
}

static struct pair pair_of(const struct scattering_state *s, const float wi[3], const float wo[3])
{
    struct pair g = {.view = near_view_of(wi, wo)};
    for (int k = 0; k < N_MATERIAL; k++)
        g.ray[k] = dielectric_ray_at(cosine_of_view(&g.view.out), g.view.x, s->material[k].eta);
    return g;
}

/* The factors of each mode of a material along and around the fiber, and their derivatives. */
struct factors {
    float m[DIELECTRIC_N_LOBE], d_m[DIELECTRIC_N_LOBE]; /* d ln M by beta */
    double azimuth[DIELECTRIC_N_LOBE], d_azimuth[DIELECTRIC_N_LOBE][2];
};

static void factors_of(const struct material *m, const struct near_view *v, const struct dielectric_ray *ray,
                       const float wi[3], const float wo[3], bool want_scores, struct factors *f)
{
    for (int p = 0; p < DIELECTRIC_N_LOBE; p++) {
        double d_eta, centre = dielectric_azimuth(ray, p, v->x, &d_eta), by[2] = {0};
        f->m[p] = cone_lobe_eval(&m->longitudinal[p], wi[0], v->in.cos_theta, wo[0], v->out.cos_theta,
                                 want_scores ? &f->d_m[p] : NULL);
        f->d_m[p] = want_scores ? f->d_m[p] * (float)dielectric_width[p] : 0.0f;
        f->azimuth[p] = near_azimuth_eval(&m->azimuth, remainder(v->phi - centre, 2 * M_PI), want_scores ? by : NULL);
        f->d_azimuth[p][0] = -by[0] * d_eta;
        f->d_azimuth[p][1] = by[1] * m->d_width;
    }
}

/* S cos th_i of one material and channel; derivatives by its parameters in d[N_OWN] where wanted. */
static double value_of(const struct material *m, const struct factors *f, const struct dielectric_ray *ray, int c,
                       double *d)
{
    const struct dielectric_shares a = dielectric_shares_of(ray, m->c_t[c], m->ln_c_t[c]);
    double sum = 0;
    if (d != NULL) memset(d, 0, N_OWN * sizeof *d);
    for (int p = 0; p < DIELECTRIC_N_MODE; p++) {
        const int lobe = p < DIELECTRIC_N_LOBE ? p : DIELECTRIC_TRT;
        const double along = (double)f->m[lobe], around = p < DIELECTRIC_N_LOBE ? f->azimuth[p] : 0.5 / M_PI;
        const double value = along * around * a.value[p];
        sum += value;
        if (d == NULL) continue;
        d[P_COLOR + c] += along * around * a.d_c_t[p];
        d[P_ETA] += along * around * a.d_eta[p];
        d[P_ALONG] += value * (double)f->d_m[lobe] * m->d_beta;
        if (p == DIELECTRIC_REST) continue;
        d[P_ETA] += along * f->d_azimuth[p][0] * a.value[p];
        d[P_AROUND] += along * f->d_azimuth[p][1] * a.value[p];
    }
    return sum;
}

static void eval_at(const struct scattering_state *s, const struct pair *g, const struct factors f[N_MATERIAL],
                    float s_rgb[3], float *score)
{
    const double inv_cosine = 1 / fmax((double)g->view.in.cos_theta, NEAR_LEAST_COSINE_D);
    for (int c = 0; c < 3; c++) {
        double own[N_MATERIAL], d[N_MATERIAL][N_OWN], sum = 0;
        for (int k = 0; k < N_MATERIAL; k++) {
            own[k] = value_of(&s->material[k], &f[k], &g->ray[k], c, score != NULL ? d[k] : NULL);
            sum += s->share[k] * own[k];
        }
        s_rgb[c] = (float)(inv_cosine * sum);
        if (score == NULL) continue;
        const double inv = sum > 1e-30 ? 1 / sum : 0;
        float *out = score + (size_t)c * N_PARAM;
        for (int k = 0; k < N_MATERIAL; k++)
            for (int p = 0; p < N_OWN; p++) out[k * N_OWN + p] = (float)(s->share[k] * d[k][p] * inv);
        out[P_SHARE] = (float)((own[1] - own[0]) * inv);
    }
}

static void mode_probabilities(const struct scattering_state *s, const struct dielectric_ray ray[N_MATERIAL],
                               const float *weight_rgb, double p[N_MODE])
{
    double sum = 0;
    memset(p, 0, N_MODE * sizeof *p);
    for (int k = 0; k < N_MATERIAL; k++)
        for (int c = 0; c < 3; c++) {
            const struct material *m = &s->material[k];
            const struct dielectric_shares a = dielectric_shares_of(&ray[k], m->c_t[c], m->ln_c_t[c]);
            const double weight = s->share[k] * (weight_rgb != NULL ? (double)weight_rgb[c] : 1);
            for (int i = 0; i < DIELECTRIC_N_MODE; i++)
                p[k * DIELECTRIC_N_MODE + i] += weight * weight * a.value[i] * a.value[i];
        }
    for (int i = 0; i < N_MODE; i++) sum += p[i] = sqrt(p[i]);
    for (int i = 0; i < N_MODE; i++)
        p[i] = LEAST_PROBABILITY + (1 - N_MODE * LEAST_PROBABILITY) * (sum > 0 ? p[i] / sum : 1.0 / N_MODE);
}

static float density(const struct scattering_state *s, const struct pair *g, const struct factors f[N_MATERIAL],
                     const float *weight_rgb)
{
    double p[N_MODE], sum = 0;
    mode_probabilities(s, g->ray, weight_rgb, p);
    for (int i = 0; i < N_MODE; i++) {
        const struct factors *own = &f[i / DIELECTRIC_N_MODE];
        const int mode = i % DIELECTRIC_N_MODE, lobe = mode < DIELECTRIC_N_LOBE ? mode : DIELECTRIC_TRT;
        sum += p[i] * (double)own->m[lobe] * (mode < DIELECTRIC_N_LOBE ? own->azimuth[mode] : 0.5 / M_PI);
    }
    return (float)sum;
}

static void all_factors(const struct scattering_state *s, const struct pair *g, const float wi[3], const float wo[3],
                        bool want_scores, struct factors f[N_MATERIAL])
{
    for (int k = 0; k < N_MATERIAL; k++) factors_of(&s->material[k], &g->view, &g->ray[k], wi, wo, want_scores, &f[k]);
}

static float eval_pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb,
                      float s_rgb[3], float *score)
{
    const struct pair g = pair_of(s, wi, wo);
    struct factors f[N_MATERIAL];
    all_factors(s, &g, wi, wo, score != NULL, f);
    eval_at(s, &g, f, s_rgb, score);
    return density(s, &g, f, weight_rgb);
}

static void eval(const struct scattering_state *s, const float wi[3], const float wo[3], float s_rgb[3], float *score)
{
    const struct pair g = pair_of(s, wi, wo);
    struct factors f[N_MATERIAL];
    all_factors(s, &g, wi, wo, score != NULL, f);
    eval_at(s, &g, f, s_rgb, score);
}

static float pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb)
{
    const struct pair g = pair_of(s, wi, wo);
    struct factors f[N_MATERIAL];
    all_factors(s, &g, wi, wo, false, f);
    return density(s, &g, f, weight_rgb);
}

static void sample(const struct scattering_state *s, const float wo[3], const float *weight_rgb, const float u[3],
                   float wi[3])
{
    const struct fiber_direction out = fiber_direction_of(wo);
    const double x = near_offset_angle(&out);
    struct dielectric_ray ray[N_MATERIAL];
    double p[N_MODE], rest = (double)u[0], phi = 2 * M_PI * (double)u[2];
    int i = 0;
    for (int k = 0; k < N_MATERIAL; k++) ray[k] = dielectric_ray_at(cosine_of_view(&out), x, s->material[k].eta);
    mode_probabilities(s, ray, weight_rgb, p);
    while (i < N_MODE - 1 && rest >= p[i]) rest -= p[i++];
    const float left = fminf((float)(rest / p[i]), 0x1.fffffep-1f); /* the unused part of u[0] is uniform again */
    const struct material *m = &s->material[i / DIELECTRIC_N_MODE];
    const int mode = i % DIELECTRIC_N_MODE, lobe = mode < DIELECTRIC_N_LOBE ? mode : DIELECTRIC_TRT;
    const float sin_i = cone_lobe_sample(&m->longitudinal[lobe], wo[0], out.cos_theta, u[1], left);
    const float cos_i = sqrtf((1 - sin_i) * (1 + sin_i));
    if (mode < DIELECTRIC_N_LOBE) {
        double d_eta;
        phi = dielectric_azimuth(&ray[i / DIELECTRIC_N_MODE], mode, x, &d_eta) + near_azimuth_sample(&m->azimuth, u[2]);
    }
    near_direction(&out, sin_i, cos_i, phi, wi);
}

const struct scattering_model scattering_hair_mixture = {
    SURFACE_MODEL_ROW(hair_mixture),
    .near_field = true,
    .prepare = prepare,
    .release = release,
    .eval = eval,
    .sample = sample,
    .pdf = pdf,
    .eval_pdf = eval_pdf,
};
