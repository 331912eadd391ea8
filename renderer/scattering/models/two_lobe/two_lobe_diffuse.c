/* two_lobe_diffuse.v1: two_lobe.v1 with scattering inside the fiber (delustrant, lumen, rough walls of dyed fibers).
 *
 *     S = R + C_TT (1 - F(th_i)) [(1 - w) M_TT f(ph_o; ph_i + pi, gamma_TT) + w / pi^2]
 *
 * w is the share of the transmitted light that leaves the fiber in all directions alike; 1 / pi^2 keeps its energy,
 * since the integral of cos th over the sphere is pi^2. The limit w = 0 is two_lobe.v1. The energy bound is the same as
 * for two_lobe.v1: the light that R leaves is split between two terms, and each returns at most its share from the
 * incident side.
 *
 * Sampling of wi: the diffuse term with the probability that its energy asks for, with density cos th_i / pi^2,
 * otherwise as two_lobe.v1.
 */
#include "renderer/scattering/models/two_lobe/two_lobe_core.h"

#include <assert.h>
#include <stddef.h>

enum { N_PARAM = surface_two_lobe_diffuse_n_param, P_W = TWO_LOBE_N_PARAM };

struct diffuse_state {
    struct scattering_state lobes; /* of two_lobe.v1, with C_TT (1 - w) in place of C_TT */
    float w, c_tt[3];
    float energy; /* energy of the diffuse term in uniform light, before colours: integral of (1 - (1 - cos th)^5) */
};

static const struct diffuse_state *diffuse_state_of(const struct scattering_state *s)
{
    return (const struct diffuse_state *)((const char *)s - offsetof(struct diffuse_state, lobes));
}

/* Integral of (1 - (1 - cos th_i)^5) cos th_i / pi^2 over wi. */
static float diffuse_energy(void)
{
    enum { N = 256 };
    double sum = 0;
    for (int i = 0; i < N; i++) {
        double c = cos((i + 0.5) * (M_PI_2 / N));
        sum += (1 - pow(1 - c, 5)) * c * c;
    }
    return (float)(2 * sum * (M_PI_2 / N) * 2 * M_PI / (M_PI * M_PI));
}

static status prepare(const double *param, struct scattering_state **state, struct error *err)
{
    status st = param_check(surface_two_lobe_diffuse_param, N_PARAM, surface_two_lobe_diffuse_id, param, err);
    if (st != STATUS_OK) return st;
    struct diffuse_state *d = malloc(sizeof *d);
    if (d == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    two_lobe_init_published(&d->lobes, param);
    d->w = (float)param[P_W];
    d->energy = diffuse_energy();
    for (int c = 0; c < 3; c++) {
        d->c_tt[c] = (float)param[TWO_LOBE_P_C_TT + c];
        d->lobes.c_tt[c] = (float)(param[TWO_LOBE_P_C_TT + c] * (1 - param[P_W]));
    }
    *state = &d->lobes;
    return STATUS_OK;
}

/* The state begins with its lobes, so it is released as they are. */
static_assert(offsetof(struct diffuse_state, lobes) == 0, "two_lobe_release frees the state by its first member");

/* Adds the diffuse term to S and, if score != NULL, turns the scores of the lobes into the scores of this model. */
static void add_diffuse(const struct diffuse_state *d, const struct fiber_direction *di, const float lobe_rgb[3],
                        const float *lobe_score, float s_rgb[3], float *score)
{
    const float uniform = (float)(M_1_PI * M_1_PI);
    float rest = 1 - two_lobe_schlick(di->cos_theta), diffuse[3];
    for (int c = 0; c < 3; c++) {
        diffuse[c] = d->w * d->c_tt[c] * d->lobes.not_c_r[c] * rest * uniform;
        s_rgb[c] = lobe_rgb[c] + diffuse[c];
    }
    if (score == NULL) return;
    for (int j = 0; j < 3 * N_PARAM; j++) score[j] = 0;
    for (int c = 0; c < 3; c++) {
        const float *from = lobe_score + c * TWO_LOBE_N_PARAM;
        float *h = score + c * N_PARAM, inv = s_rgb[c] > 1e-30f ? 1 / s_rgb[c] : 0, lobes = lobe_rgb[c] * inv;
        float tt = lobe_rgb[c] * from[TWO_LOBE_P_C_TT + c] * d->lobes.c_tt[c]; /* the TT term alone */
        h[TWO_LOBE_P_C_R + c] = lobes * from[TWO_LOBE_P_C_R + c] - d->w * d->c_tt[c] * rest * uniform * inv;
        h[TWO_LOBE_P_C_TT + c] = (tt + diffuse[c]) / d->c_tt[c] * inv;
        for (int p = TWO_LOBE_P_BETA_R; p <= TWO_LOBE_P_GAMMA_TT; p++) h[p] = lobes * from[p];
        h[P_W] = (diffuse[c] / d->w - tt / (1 - d->w)) * inv;
    }
}

static void eval(const struct scattering_state *s, const float wi[3], const float wo[3], float s_rgb[3], float *score)
{
    struct fiber_direction di = fiber_direction_of(wi), dout = fiber_direction_of(wo);
    struct two_lobe_terms t = two_lobe_terms_of(s, &di, &dout);
    float lobe_rgb[3], lobe_score[3 * TWO_LOBE_N_PARAM];
    two_lobe_eval_terms(s, false, &di, &dout, &t, lobe_rgb, score != NULL ? lobe_score : NULL);
    add_diffuse(diffuse_state_of(s), &di, lobe_rgb, lobe_score, s_rgb, score);
}

/* Probability of drawing from the diffuse term, by the roots of the channels' summed squares, as two_lobe_p_r. */
static float diffuse_probability(const struct diffuse_state *d, const float wo[3], const float *weight_rgb)
{
    struct fiber_direction dout = fiber_direction_of(wo);
    struct two_lobe_sampling_entry e = two_lobe_sampling_at(&d->lobes, dout.theta_rad);
    float diffuse = 0, lobes = 0;
    for (int c = 0; c < 3; c++) {
        float weight = weight_rgb != NULL ? weight_rgb[c] : 1;
        float r = d->lobes.c_r[c] * e.energy[0] + d->lobes.not_c_r[c] * e.energy[1];
        float l = weight * (r + d->lobes.c_tt[c] * d->lobes.not_c_r[c] * e.energy[2]);
        float u = weight * d->w * d->c_tt[c] * d->lobes.not_c_r[c] * d->energy;
        lobes += l * l;
        diffuse += u * u;
    }
    diffuse = sqrtf(diffuse);
    float p = diffuse / (diffuse + sqrtf(lobes));
    p = p < 0.9f ? p : 0.9f;
    return p > 0.05f ? p : 0.05f; /* 0/0 too */
}

static float uniform_density(const float wi[3])
{
    return fmaxf(sqrtf(wi[1] * wi[1] + wi[2] * wi[2]), FIBER_COS_MIN) * (float)(M_1_PI * M_1_PI);
}

static float pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb)
{
    float p = diffuse_probability(diffuse_state_of(s), wo, weight_rgb);
    return p * uniform_density(wi) + (1 - p) * two_lobe_pdf(s, wi, wo, weight_rgb);
}

static void sample(const struct scattering_state *s, const float wo[3], const float *weight_rgb, const float u[3],
                   float wi[3])
{
    float p = diffuse_probability(diffuse_state_of(s), wo, weight_rgb);
    if (u[0] >= p) {
        const float rest[3] = {fminf((u[0] - p) / (1 - p), 0x1.fffffep-1f), u[1], u[2]};
        two_lobe_sample(s, wo, weight_rgb, rest, wi);
        return;
    }
    /* cos^2 th d th: the sine of th is distributed as one coordinate of a point in the unit disk */
    float z = sqrtf(u[0] / p) * cosf((float)(2 * M_PI) * u[1]), cos_theta = sqrtf(fmaxf(0, (1 - z) * (1 + z)));
    wi[0] = z;
    wi[1] = cos_theta * cosf((float)(2 * M_PI) * u[2]);
    wi[2] = cos_theta * sinf((float)(2 * M_PI) * u[2]);
}

static float eval_pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb,
                      float s_rgb[3], float *score)
{
    struct fiber_direction di = fiber_direction_of(wi);
    struct scattering_view v;
    two_lobe_view_of(s, wo, weight_rgb, &v);
    struct two_lobe_terms t = two_lobe_terms_of(s, &di, &v.out);
    const struct diffuse_state *d = diffuse_state_of(s);
    float lobe_rgb[3], lobe_score[3 * TWO_LOBE_N_PARAM];
    two_lobe_eval_terms(s, false, &di, &v.out, &t, lobe_rgb, score != NULL ? lobe_score : NULL);
    add_diffuse(d, &di, lobe_rgb, lobe_score, s_rgb, score);
    float p = diffuse_probability(d, wo, weight_rgb);
    return p * uniform_density(wi) + (1 - p) * two_lobe_pdf_terms(&di, &v, &t);
}

const struct scattering_model scattering_two_lobe_diffuse = {
    SURFACE_MODEL_ROW(two_lobe_diffuse),
    .prepare = prepare,
    .release = two_lobe_release,
    .eval = eval,
    .sample = sample,
    .pdf = pdf,
    .eval_pdf = eval_pdf,
    .lobe_rad = two_lobe_lobe_rad,
};
