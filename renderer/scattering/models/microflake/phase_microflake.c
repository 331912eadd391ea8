/* microflake.v1: specular flakes about a fiber (Jakob et al. 2010, "A radiative transfer framework for rendering
 * materials with anisotropic structure", sections 4-5; distribution of Zhao et al. 2011, equation 1, as the fabric
 * thesis uses it in 5.7). With t = m . dir: D(m) = k exp(-t^2 / (2 gamma^2)),   k = 1 / ((2 pi)^(3/2) gamma erf(1 /
 * (sqrt 2 gamma))) s(w) = integral of |w . m| D(m) dm,   f = alpha D(h) / (2 s(wo)),   h half way between wi and wo
 * Normalised with s(wo): dwi = 4 |wo . h| dh over the half sphere around wo makes the integral of f over wi exactly
 * alpha. (Written with s(wi) it would integrate to 1 over wo; s(wo) f is symmetric, so both say the same.) The integral
 * over the azimuth of m is closed: with a = t cos, b = sqrt(1 - t^2) sin of the angle between w and dir, integral of |a
 * + b cos ph| dph = 2 pi |a| when |a| >= b, else 4 (sqrt(b^2 - a^2) + a asin(a / b)). The remaining integral, over t,
 * goes into a table over the sine of this angle, together with its derivative by gamma. Sampling: a flake from D,
 * mirrored to wo's side; density of wi = D(h) / (2 |wo . h|), weight alpha |wo . h| / s(wo).
 */
#include "renderer/scattering/models/microflake/microflake_rows.def"
#include "renderer/scattering/phase_model.h"
#include "renderer/scattering/von_mises.h"

#include <math.h>
#include <stdlib.h>

enum { N_PARAM = volume_microflake_n_param, P_GAMMA = 3, N_NODE = 128 };

struct phase_state {
    float alpha[3];
    float k, inv_2var, gamma, inv_cube, d_ln_k; /* d ln k / d gamma */
    float erf_end;                              /* erf(1 / (sqrt 2 gamma)) */
    struct phase_extinction extinction;
};

static float azimuth_integral(float a, float b)
{
    if (a >= b) return (float)(2 * M_PI) * a;
    return 4 * (sqrtf((b - a) * (b + a)) + a * asinf(a / b));
}

static void fill_extinction(struct phase_state *s, double gamma, double k, double d_ln_k)
{
    double end = fmin(1, 7 * gamma), step = end / N_NODE, weight[N_NODE + 1], d_weight[N_NODE + 1];
    for (int j = 0; j <= N_NODE; j++) { /* twice: t and -t */
        double t = j * step;
        weight[j] = 2 * k * exp(-t * t / (2 * gamma * gamma)) * step / 3 * (j == 0 || j == N_NODE ? 1 : j % 2 ? 4 : 2);
        d_weight[j] = weight[j] * (t * t / (gamma * gamma * gamma) + d_ln_k);
    }
    struct phase_extinction *e = &s->extinction;
    e->i_param = P_GAMMA;
    e->largest = 0;
    for (int i = 0; i <= PHASE_N_EXTINCTION; i++) {
        double sum = 0, d_sum = 0, sine = (double)i / PHASE_N_EXTINCTION, cosine = sqrt(1 - sine * sine);
        for (int j = 0; j <= N_NODE; j++) {
            double t = j * step;
            double x = (double)azimuth_integral((float)(t * cosine), (float)(sqrt(1 - t * t) * sine));
            sum += weight[j] * x;
            d_sum += d_weight[j] * x;
        }
        e->value[i] = (float)sum;
        e->d_value[i] = (float)d_sum;
        e->largest = fmaxf(e->largest, e->value[i]);
    }
}

static status prepare(const double *param, struct phase_state **state, struct error *err)
{
    status st = param_check(phase_microflake.param, phase_microflake.n_param, phase_microflake.id, param, err);
    if (st != STATUS_OK) return st;
    struct phase_state *s = calloc(1, sizeof *s);
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare phase function: out of memory");
    double gamma = param[P_GAMMA], x = M_SQRT1_2 / gamma, end = erf(x);
    double k = 1 / (pow(2 * M_PI, 1.5) * gamma * end);
    double d_ln_k = -1 / gamma + M_2_SQRTPI * exp(-x * x) * x / (gamma * end);
    for (int c = 0; c < 3; c++) s->alpha[c] = (float)param[c];
    s->k = (float)k;
    s->gamma = (float)gamma;
    s->inv_2var = (float)(0.5 / (gamma * gamma));
    s->inv_cube = (float)(1 / (gamma * gamma * gamma));
    s->d_ln_k = (float)d_ln_k;
    s->erf_end = (float)end;
    fill_extinction(s, gamma, k, d_ln_k);
    *state = s;
    return STATUS_OK;
}

static void release(struct phase_state *s) { free(s); }

static const struct phase_extinction *extinction(const struct phase_state *s) { return &s->extinction; }

static void sample(const struct phase_state *s, const float wo[3], const float *weight_rgb, const float u[3],
                   float wi[3])
{
    (void)weight_rgb;
    float t = (float)M_SQRT2 * s->gamma * erf_inverse((2 * u[0] - 1) * s->erf_end);
    t = fminf(fmaxf(t, -1), 1);
    float b = sqrtf((1 - t) * (1 + t)), phi = (float)(2 * M_PI) * u[1];
    float m[3] = {t, b * cosf(phi), b * sinf(phi)};
    float twice = 2 * (wo[0] * m[0] + wo[1] * m[1] + wo[2] * m[2]), length2 = 0;
    for (int a = 0; a < 3; a++) {
        wi[a] = twice * m[a] - wo[a];
        length2 += wi[a] * wi[a];
    }
    for (int a = 0; a < 3; a++) wi[a] /= sqrtf(length2);
}

static float eval_pdf(const struct phase_state *s, const float wi[3], const float wo[3], const float *weight_rgb,
                      float f_rgb[3], float *score)
{
    (void)weight_rgb;
    float x = wi[0] + wo[0], y = wi[1] + wo[1], z = wi[2] + wo[2], length2 = x * x + y * y + z * z;
    float t2 = length2 > 1e-12f ? x * x / length2 : 0; /* straight on: a flake seen edge-on, half vector undefined */
    float wo_h = fmaxf(0.5f * sqrtf(length2), 1e-5f), d_sigma;
    float sigma = phase_extinction_at(&s->extinction, sqrtf(wo[1] * wo[1] + wo[2] * wo[2]), &d_sigma);
    float d = s->k * expf(-t2 * s->inv_2var), f = 0.5f * d / sigma;
    float d_ln_gamma = t2 * s->inv_cube + s->d_ln_k - d_sigma / sigma;
    for (int c = 0; c < 3; c++) {
        f_rgb[c] = s->alpha[c] * f;
        if (score == NULL) continue;
        for (int p = 0; p < 3; p++) score[N_PARAM * c + p] = c == p ? 1 / s->alpha[c] : 0;
        score[N_PARAM * c + P_GAMMA] = f > 1e-30f ? d_ln_gamma : 0;
    }
    return 0.5f * d / wo_h;
}

const struct phase_model phase_microflake = {
    VOLUME_MODEL_ROW(microflake), .prepare = prepare, .release = release,
    .extinction = extinction,     .sample = sample,   .eval_pdf = eval_pdf,
};
