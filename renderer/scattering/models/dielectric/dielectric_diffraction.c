/* dielectric_diffraction.v1: dielectric.v1 with the light that the fiber diffracts past itself, in closed form, for
 * fibers that are drawn twice as wide as they are. Reciprocal; lossless from both sides where C_T = 1.
 *
 *     S = (S_dielectric.v1 + b(th_i) b(th_o) g(th_o + th_i; beta_D) F(ph - pi; A)) / 2
 *     A = d 0.55 um cos th_d / lambda
 *
 * A fiber much wider than the wavelength takes twice the light that falls on its section out of a beam: half of it
 * by reflection and refraction, half by diffraction (van de Hulst 1957, "Light Scattering by Small Particles",
 * section 8.2). There are two ways to count this without gain or loss. This model intersects fibers at twice their
 * diameter, so that half of the light that they meet passes through the true section and the other half is diffracted.
 * Fibers of their true diameter with dielectric.v1 leave out diffraction, because it turns light by little; a fit in a
 * dense cloth should take that.
 *
 * F is the diffraction by a strip (strip_lobe.h), after the idea of Benamira and Pattanaik 2021, "A Combined
 * Scattering and Diffraction Model for Elliptical Hair Rendering", whose equations differ. d is the true diameter in
 * wavelengths of 0.55 um; a fiber drawn with the radius r has d = r / 0.55 um. g is a Gaussian of width beta_D, which a
 * straight fiber has from the size of the light, and b(th) balances it (lobe_balance.h). Wavelengths are the dominant
 * ones of the primaries of sRGB.
 *
 * Sampling: half of the samples by dielectric.v1. For the others th_i from g and the azimuth from a Lorentz curve of
 * the width of F in the green channel at th_d = th_o.
 */
#include "renderer/scattering/azimuth_table.h"
#include "renderer/scattering/lobe_balance.h"
#include "renderer/scattering/models/dielectric/dielectric_rows.def"
#include "renderer/scattering/models/dielectric/strip_lobe.h"
#include "renderer/scattering/scattering.h"
#include "renderer/scattering/tilted_lobe.h"

#include <stdlib.h>
#include <string.h>

enum {
    N_PARAM = surface_dielectric_diffraction_n_param,
    N_RAY = surface_dielectric_n_param, /* the first are the parameters of dielectric.v1 */
    P_SIZE = N_RAY,
    P_BETA_D
};
static const double wavelength_um[3] = {0.6114, 0.5491, 0.4643};
#define UNIT_UM 0.55
#define BAND 0.075      /* standard deviation of the wave numbers of a channel, relative */
#define LEAST_SIZE 1e-3 /* of A in the density of samples: it is uniform there */
#define SHARE_DIFFRACTED 0.5f

struct scattering_state {
    struct scattering_state *ray; /* of dielectric.v1, which has a struct of its own */
    struct strip_lobe strip;
    struct tilted_lobe along;                                /* g; the shift is 0 */
    float scale[LOBE_BALANCE_N], d_ln_scale[LOBE_BALANCE_N]; /* b by |th|; by beta_D */
    double size;
};

static void release(struct scattering_state *s)
{
    if (s->ray != NULL) scattering_dielectric.release(s->ray);
    free(s);
}

static status balance(struct scattering_state *s, struct error *err)
{
    struct {
        struct lobe_balance solver;
        double b[LOBE_BALANCE_N], d[LOBE_BALANCE_N];
    } *w = malloc(sizeof *w);
    if (w == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    lobe_balance_init(&w->solver);
    lobe_balance_r(&w->solver, (double)s->along.width, w->b, w->d);
    for (int i = 0; i < LOBE_BALANCE_N; i++) {
        s->scale[i] = (float)w->b[i];
        s->d_ln_scale[i] = (float)w->d[i];
    }
    free(w);
    return STATUS_OK;
}

static status prepare(const double *param, struct scattering_state **state, struct error *err)
{
    status st =
        param_check(surface_dielectric_diffraction_param, N_PARAM, surface_dielectric_diffraction_id, param, err);
    if (st != STATUS_OK) return st;
    struct scattering_state *s = calloc(1, sizeof *s);
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    s->size = param[P_SIZE];
    s->along.width = (float)param[P_BETA_D];
    strip_lobe_init(&s->strip, BAND);
    st = balance(s, err);
    if (st == STATUS_OK) st = scattering_dielectric.prepare(param, &s->ray, err);
    if (st != STATUS_OK) {
        release(s);
        return st;
    }
    *state = s;
    return STATUS_OK;
}

/* Two directions, and the quantities that the strip needs. */
struct pair {
    struct fiber_direction in, out;
    double cos_d, sine, tangent; /* of th_d; of the azimuth from straight on: its sine, and the tangent of its half */
    float m;                     /* g */
};

static struct pair pair_of(const struct scattering_state *s, const float wi[3], const float wo[3])
{
    struct pair g = {.in = fiber_direction_of(wi), .out = fiber_direction_of(wo)};
    const double c = (double)g.in.cos_theta + (double)g.out.cos_theta, u = (double)wi[0] + (double)wo[0];
    const double turned = fmin((double)fiber_one_minus_cos_opposite(&g.in, &g.out), 2);
    g.cos_d = 0.5 * sqrt(c * c + u * u);
    g.sine = sqrt(turned * (2 - turned));
    g.tangent = turned < 1 ? sqrt(turned / (2 - turned)) : 2;
    g.m = tilted_lobe_eval(&s->along, g.in.theta_rad + g.out.theta_rad, NULL);
    return g;
}

static float scale_at(const struct scattering_state *s, float theta_rad, float *d_ln)
{
    int i;
    const float t = table_position(fabsf(theta_rad) * (float)((LOBE_BALANCE_N - 1) / M_PI_2), LOBE_BALANCE_N - 1, &i);
    *d_ln += table_mix(s->d_ln_scale[i], s->d_ln_scale[i + 1], t);
    return table_mix(s->scale[i], s->scale[i + 1], t);
}

/* Turns S and its scores of dielectric.v1, ray_score[3][N_RAY], into S and the scores of this model. */
static void add_strip(const struct scattering_state *s, const struct pair *g, float s_rgb[3], const float *ray_score,
                      float *score)
{
    float d_scale = 0, d_along[2];
    const float scale = scale_at(s, g->in.theta_rad, &d_scale) * scale_at(s, g->out.theta_rad, &d_scale);
    if (score != NULL) {
        const float m = tilted_lobe_eval(&s->along, g->in.theta_rad + g->out.theta_rad, d_along);
        d_scale += m > 0 ? d_along[1] / m : 0;
    }
    for (int c = 0; c < 3; c++) {
        double slope = 0, strip = 0;
        if (g->tangent <= 1)
            strip = strip_lobe_eval(&s->strip, s->size * UNIT_UM / wavelength_um[c] * g->cos_d, g->sine,
                                    score != NULL ? &slope : NULL);
        const float diffracted = scale * g->m * (float)strip, sum = s_rgb[c] + diffracted;
        s_rgb[c] = 0.5f * sum;
        if (score == NULL) continue;
        float *h = score + c * N_PARAM, share = sum > 1e-30f ? diffracted / sum : 0;
        for (int k = 0; k < N_RAY; k++) h[k] = (1 - share) * ray_score[c * N_RAY + k];
        h[P_SIZE] = share * (float)(slope / s->size);
        h[P_BETA_D] = share * d_scale;
    }
}

static float density(const struct scattering_state *s, const struct pair *g, float ray)
{
    const double a = fmax(s->size * (double)g->out.cos_theta, LEAST_SIZE);
    const float along = tilted_lobe_density(&s->along, g->in.theta_rad, g->out.theta_rad, g->m);
    const float strip = along * (float)strip_lobe_density(a, g->tangent) / fmaxf(g->in.cos_theta, FIBER_COS_MIN);
    return (1 - SHARE_DIFFRACTED) * ray + SHARE_DIFFRACTED * strip;
}

static float eval_pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb,
                      float s_rgb[3], float *score)
{
    float ray_score[3 * N_RAY];
    const struct pair g = pair_of(s, wi, wo);
    const float ray =
        scattering_dielectric.eval_pdf(s->ray, wi, wo, weight_rgb, s_rgb, score != NULL ? ray_score : NULL);
    add_strip(s, &g, s_rgb, ray_score, score);
    return density(s, &g, ray);
}

static void eval(const struct scattering_state *s, const float wi[3], const float wo[3], float s_rgb[3], float *score)
{
    float ray_score[3 * N_RAY];
    const struct pair g = pair_of(s, wi, wo);
    scattering_dielectric.eval(s->ray, wi, wo, s_rgb, score != NULL ? ray_score : NULL);
    add_strip(s, &g, s_rgb, ray_score, score);
}

static float pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb)
{
    const struct pair g = pair_of(s, wi, wo);
    return density(s, &g, scattering_dielectric.pdf(s->ray, wi, wo, weight_rgb));
}

static void sample(const struct scattering_state *s, const float wo[3], const float *weight_rgb, const float u[3],
                   float wi[3])
{
    if (u[0] >= SHARE_DIFFRACTED) {
        const float rest[3] = {table_stretch(u[0] - SHARE_DIFFRACTED, 1 - SHARE_DIFFRACTED), u[1], u[2]};
        scattering_dielectric.sample(s->ray, wo, weight_rgb, rest, wi);
        return;
    }
    const struct fiber_direction out = fiber_direction_of(wo);
    const float theta = tilted_lobe_sample(&s->along, out.theta_rad, u[1]);
    const double t = strip_lobe_sample(fmax(s->size * (double)out.cos_theta, LEAST_SIZE), (double)u[2]);
    const double inv = 1 / (1 + t * t); /* cos d = (1 - t^2) / (1 + t^2); the azimuth is d + pi */
    fiber_direction_beyond(&out, sinf(theta), fmaxf(cosf(theta), 0), (float)((t * t - 1) * inv), (float)(-2 * t * inv),
                           wi);
}

const struct scattering_model scattering_dielectric_diffraction = {
    SURFACE_MODEL_ROW(dielectric_diffraction),
    .prepare = prepare,
    .release = release,
    .eval = eval,
    .sample = sample,
    .pdf = pdf,
    .eval_pdf = eval_pdf,
};
