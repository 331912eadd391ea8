/* textile.v3: evaluation with scores, and sampling (textile.h states the model).
 *
 * Sampling of wi: one of four terms, by its energy at th_o and the weights of the channels. R with the azimuth of a
 * smooth cylinder; R with a uniform azimuth, which also serves Schlick's rise, whose azimuth has no peak; TT; D, with
 * density cos th_i (1 - (2 h - 1) cos ph) / pi^2.
 */
#include "renderer/scattering/models/textile/textile.h"

#include <assert.h>
#include <stddef.h>

enum term { SMOOTH_R, UNIFORM_R, LOBE_TT, DIFFUSE, N_TERM };
#define LEAST_PROBABILITY 0.03f /* of a term: no term is starved, because all carry derivatives */

static const struct textile_state *textile_of(const struct scattering_state *s)
{
    return (const struct textile_state *)((const char *)s - offsetof(struct textile_state, lobes));
}

static_assert(offsetof(struct textile_state, lobes) == 0, "two_lobe_release frees the state by its first member");

static status prepare(const double *param, struct scattering_state **state, struct error *err)
{
    status st = param_check(surface_textile_param, TEXTILE_N_PARAM, surface_textile_id, param, err);
    if (st != STATUS_OK) return st;
    struct textile_state *t = malloc(sizeof *t);
    if (t == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    two_lobe_state_init(&t->lobes, param);
    t->w = (float)param[TEXTILE_P_W];
    t->s = (float)param[TEXTILE_P_S];
    t->f = (float)param[TEXTILE_P_F];
    t->forward = 2 * (float)param[TEXTILE_P_H] - 1;
    textile_section(t);
    st = textile_balance(t, param, err);
    if (st != STATUS_OK) {
        free(t);
        return st;
    }
    *state = &t->lobes;
    return STATUS_OK;
}

static struct textile_entry entry_at(const struct textile_state *t, float theta_rad)
{
    int i;
    float x = two_lobe_table_position(theta_rad, &i);
    const struct textile_entry *a = &t->entry[i], *b = a + 1;
    struct textile_entry e = {.q = two_lobe_mix(a->q, b->q, x), .cross_s = two_lobe_mix(a->cross_s, b->cross_s, x)};
    for (int k = 0; k < 2; k++) e.d_q[k] = two_lobe_mix(a->d_q[k], b->d_q[k], x);
    return e;
}

/* Quantities of the flat section for one direction. */
struct side {
    float v, d_ln_v, t, d_ln_t[TEXTILE_N_SLOPE]; /* d_ln_v: by f */
};

static struct side side_of(const struct textile_state *t, const struct fiber_direction *d)
{
    float cos2 = d->azimuth[0] * d->azimuth[0], x = fabsf(d->azimuth[0]) * TEXTILE_N_SECTION, f2 = t->f * t->f;
    int i = x < TEXTILE_N_SECTION - 1 ? (int)x : TEXTILE_N_SECTION - 1;
    const struct textile_section_entry *a = &t->section[i], *b = a + 1;
    x -= (float)i;
    float v2 = f2 + (1 - f2) * cos2;
    struct side y = {.v = sqrtf(v2), .d_ln_v = t->f * (1 - cos2) / v2, .t = two_lobe_mix(a->t, b->t, x)};
    for (int k = 0; k < TEXTILE_N_SLOPE; k++) y.d_ln_t[k] = two_lobe_mix(a->d_t[k], b->d_t[k], x) / y.t;
    return y;
}

/* The three terms without colours, and the quantities that their derivatives need. */
struct terms {
    float r, azimuth, rise;           /* R = r azimuth (C_R + (1 - C_R) rise) */
    float tt_whole, tt, d;            /* TT = tt = tt_whole (1 - K) */
    float d_tt[TEXTILE_N_SLOPE], d_d; /* d ln TT by way of t, and d ln D by f */
    float d_h;                        /* d ln D by h */
    float cos_half_azimuth;           /* cos(ph / 2) */
    float cos_d;                      /* cos((th_i - th_o) / 2) */
    float d_scale[2];                 /* d ln of the scales of R and TT by their own widths */
};

static struct terms terms_of(const struct textile_state *t, const struct fiber_direction *di,
                             const struct fiber_direction *dout, const struct two_lobe_terms *l)
{
    float scale_i[2], scale_o[2], score_i[2], score_o[2];
    struct terms m;
    two_lobe_scale_at(&t->lobes, true, di->theta_rad, scale_i, score_i);
    two_lobe_scale_at(&t->lobes, true, dout->theta_rad, scale_o, score_o);
    m.cos_d = cosf(0.5f * (di->theta_rad - dout->theta_rad));
    m.cos_half_azimuth = sqrtf(0.5f * l->one_minus_cos); /* 1 - cos(ph - pi) = 2 cos^2(ph / 2) */
    m.azimuth = (1 - t->s) * (float)(0.5 / M_PI) + t->s * 0.25f * m.cos_half_azimuth;
    m.rise = two_lobe_schlick(m.cos_d * m.cos_half_azimuth);
    m.r = l->g[TWO_LOBE_R] * scale_i[TWO_LOBE_R] * scale_o[TWO_LOBE_R];
    const struct side in = side_of(t, di), out = side_of(t, dout);
    m.tt_whole = l->g[TWO_LOBE_TT] * scale_i[TWO_LOBE_TT] * scale_o[TWO_LOBE_TT] * l->von_mises * in.t * out.t;
    for (int k = 0; k < TEXTILE_N_SLOPE; k++) m.d_tt[k] = in.d_ln_t[k] + out.d_ln_t[k];
    m.tt = m.tt_whole * (1 - textile_polynomial(t->share, m.cos_d));
    m.d = entry_at(t, di->theta_rad).q * entry_at(t, dout->theta_rad).q * t->inv_z;
    const float cos_azimuth = l->one_minus_cos - 1, around = 1 - t->forward * cos_azimuth;
    m.d *= in.v * out.v * t->inv_mean_v * around;
    m.d_h = -2 * cos_azimuth / around;
    m.d_d = in.d_ln_v + out.d_ln_v - t->d_ln_mean_v;
    for (int k = 0; k < 2; k++) m.d_scale[k] = score_i[k] + score_o[k];
    return m;
}

/* Derivatives of the terms by the parameters that are not colours, besides the factors of colours. */
struct slopes {
    float r[2];  /* d ln R by beta_R and by s */
    float tt[4]; /* d TT by beta_R, s, beta_TT, gamma_TT */
    float d[2];  /* d D by beta_R and by s */
};

static struct slopes slopes_of(const struct textile_state *t, const struct fiber_direction *di,
                               const struct fiber_direction *dout, const struct two_lobe_terms *l,
                               const struct terms *m)
{
    const struct scattering_state *s = &t->lobes;
    struct textile_entry ei = entry_at(t, di->theta_rad), eo = entry_at(t, dout->theta_rad);
    float width[2];
    for (int k = 0; k < 2; k++) width[k] = l->x2 * s->inv_cube[k] - s->inv[k] + m->d_scale[k];
    struct slopes y;
    y.r[0] = width[TWO_LOBE_R];
    y.r[1] = (0.25f * m->cos_half_azimuth - (float)(0.5 / M_PI)) / m->azimuth;
    y.tt[0] = m->tt * (two_lobe_cross_at(s, di->theta_rad) + two_lobe_cross_at(s, dout->theta_rad));
    y.tt[1] = m->tt * (ei.cross_s + eo.cross_s) - m->tt_whole * textile_polynomial(t->d_share, m->cos_d);
    y.tt[2] = m->tt * width[TWO_LOBE_TT];
    y.tt[3] =
        m->tt * (s->azimuth.score_at_peak - s->azimuth.score_slope * l->one_minus_cos + m->d_tt[TEXTILE_BY_GAMMA]);
    for (int k = 0; k < 2; k++) y.d[k] = m->d * (ei.d_q[k] + eo.d_q[k]);
    return y;
}

static void eval_terms(const struct textile_state *t, const struct fiber_direction *di,
                       const struct fiber_direction *dout, const struct two_lobe_terms *l, float s_rgb[3], float *score)
{
    const struct scattering_state *s = &t->lobes;
    const struct terms m = terms_of(t, di, dout, l);
    float inside = m.tt + t->w * m.d, base = m.r * m.azimuth, part_r[3];
    for (int c = 0; c < 3; c++) {
        part_r[c] = base * (s->c_r[c] + s->not_c_r[c] * m.rise);
        s_rgb[c] = part_r[c] + s->c_tt[c] * s->not_c_r[c] * inside;
    }
    if (score == NULL) return;
    const struct slopes y = slopes_of(t, di, dout, l, &m);
    for (int j = 0; j < 3 * TEXTILE_N_PARAM; j++) score[j] = 0;
    for (int c = 0; c < 3; c++) {
        float *h = score + c * TEXTILE_N_PARAM, inv = s_rgb[c] > 1e-30f ? 1 / s_rgb[c] : 0;
        float body = s->c_tt[c] * s->not_c_r[c] * inv, diffuse = t->w * body;
        h[TWO_LOBE_P_C_R + c] = (base * (1 - m.rise) - s->c_tt[c] * inside) * inv;
        h[TWO_LOBE_P_C_TT + c] = s->not_c_r[c] * inside * inv;
        h[TWO_LOBE_P_BETA_R] = part_r[c] * inv * y.r[0] + body * y.tt[0] + diffuse * y.d[0];
        h[TWO_LOBE_P_BETA_TT] = body * y.tt[2];
        h[TWO_LOBE_P_GAMMA_TT] = body * y.tt[3];
        h[TEXTILE_P_W] = body * (m.d + m.tt * m.d_tt[TEXTILE_BY_W]);
        h[TEXTILE_P_F] = body * m.tt * m.d_tt[TEXTILE_BY_F] + diffuse * m.d * m.d_d;
        h[TEXTILE_P_H] = diffuse * m.d * m.d_h;
        h[TEXTILE_P_S] = part_r[c] * inv * y.r[1] + body * y.tt[1] + diffuse * y.d[1];
    }
}

/* Probabilities of the terms: least summed variance of the channels, so in proportion to the root of their summed
 * squares. */
static void choose(const struct textile_state *t, const struct two_lobe_sampling_entry *e, float cos_psi,
                   const float *weight_rgb, float p[N_TERM])
{
    const struct scattering_state *s = &t->lobes;
    float f2 = t->f * t->f, diffuse = t->w * sqrtf(f2 + (1 - f2) * cos_psi * cos_psi);
    float square[N_TERM] = {0}, sum = 0;
    for (int c = 0; c < 3; c++) {
        float weight = weight_rgb != NULL ? weight_rgb[c] : 1, body = s->c_tt[c] * s->not_c_r[c] * e->energy[2];
        const float energy[N_TERM] = {t->s * s->c_r[c], (1 - t->s) * s->c_r[c] + s->not_c_r[c] * e->energy[1],
                                      (1 - diffuse) * body, diffuse * body};
        for (int k = 0; k < N_TERM; k++) square[k] += weight * energy[k] * weight * energy[k];
    }
    for (int k = 0; k < N_TERM; k++) sum += p[k] = sqrtf(square[k]);
    for (int k = 0; k < N_TERM; k++) {
        float share = sum > 0 ? p[k] / sum : 1.0f / N_TERM;
        p[k] = LEAST_PROBABILITY + (1 - N_TERM * LEAST_PROBABILITY) * share;
    }
}

static float pdf_terms(const struct textile_state *t, const struct fiber_direction *di,
                       const struct fiber_direction *dout, const float *weight_rgb, const struct two_lobe_terms *l)
{
    struct two_lobe_sampling_entry e = two_lobe_sampling_at(&t->lobes, dout->theta_rad);
    float p[N_TERM], density[2], cos_i = fmaxf(di->cos_theta, FIBER_COS_MIN);
    choose(t, &e, dout->azimuth[0], weight_rgb, p);
    for (int k = 0; k < 2; k++) density[k] = l->g[k] * 2 / (e.near[k] + e.far[k]);
    float azimuth = p[SMOOTH_R] * 0.25f * sqrtf(0.5f * l->one_minus_cos) + p[UNIFORM_R] * (float)(0.5 / M_PI);
    float lobes = density[TWO_LOBE_R] * azimuth + p[LOBE_TT] * density[TWO_LOBE_TT] * l->von_mises;
    float around = 1 - t->forward * (l->one_minus_cos - 1);
    return lobes / cos_i + p[DIFFUSE] * cos_i * around * (float)(M_1_PI * M_1_PI);
}

static void eval(const struct scattering_state *s, const float wi[3], const float wo[3], float s_rgb[3], float *score)
{
    struct fiber_direction di = fiber_direction_of(wi), dout = fiber_direction_of(wo);
    struct two_lobe_terms l = two_lobe_terms_of(s, &di, &dout);
    eval_terms(textile_of(s), &di, &dout, &l, s_rgb, score);
}

static float pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb)
{
    struct fiber_direction di = fiber_direction_of(wi), dout = fiber_direction_of(wo);
    struct two_lobe_terms l = two_lobe_terms_of(s, &di, &dout);
    return pdf_terms(textile_of(s), &di, &dout, weight_rgb, &l);
}

static float eval_pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb,
                      float s_rgb[3], float *score)
{
    struct fiber_direction di = fiber_direction_of(wi), dout = fiber_direction_of(wo);
    struct two_lobe_terms l = two_lobe_terms_of(s, &di, &dout);
    eval_terms(textile_of(s), &di, &dout, &l, s_rgb, score);
    return pdf_terms(textile_of(s), &di, &dout, weight_rgb, &l);
}

/* Picks a term, and stretches u to [0, 1) within its interval. */
static enum term pick(const float p[N_TERM], float *u)
{
    int k = 0;
    while (k < N_TERM - 1 && *u >= p[k]) *u -= p[k++];
    *u = fminf(*u / p[k], 0x1.fffffep-1f);
    return (enum term)k;
}

/* cos^2 th d th: the sine of th is distributed as one coordinate of a point in the unit disk. The other one, over its
 * largest value cos th, is uniform whatever the first. It decides whether the azimuth, uniform at first, is turned
 * round: of two opposite azimuths, whose densities sum to 1 / pi, either is taken by its own share. */
static void sample_diffuse(const struct textile_state *t, const struct fiber_direction *dout, float u, const float v[2],
                           float wi[3])
{
    float r = sqrtf(u), z = r * cosf((float)(2 * M_PI) * v[0]), other = r * sinf((float)(2 * M_PI) * v[0]);
    float cos_theta = sqrtf(fmaxf(0, (1 - z) * (1 + z)));
    float x = cosf((float)(2 * M_PI) * v[1]), y = sinf((float)(2 * M_PI) * v[1]);
    float cos_azimuth = x * dout->azimuth[0] + y * dout->azimuth[1];
    float side = other < -cos_theta * t->forward * cos_azimuth ? cos_theta : -cos_theta;
    wi[0] = z;
    wi[1] = side * x;
    wi[2] = side * y;
}

static void sample(const struct scattering_state *s, const float wo[3], const float *weight_rgb, const float u[3],
                   float wi[3])
{
    const struct textile_state *t = textile_of(s);
    struct fiber_direction dout = fiber_direction_of(wo);
    struct two_lobe_sampling_entry e = two_lobe_sampling_at(s, dout.theta_rad);
    float p[N_TERM], rest = u[0], phi; /* phi: from the azimuth of wo */
    choose(t, &e, dout.azimuth[0], weight_rgb, p);
    enum term k = pick(p, &rest);
    if (k == DIFFUSE) {
        sample_diffuse(t, &dout, rest, u + 1, wi);
        return;
    }
    float theta =
        two_lobe_sample_theta(s, e.near, e.far, k == LOBE_TT ? TWO_LOBE_TT : TWO_LOBE_R, dout.theta_rad, u[1]);
    if (k == SMOOTH_R)
        phi = 2 * asinf(2 * u[2] - 1); /* the integral of cos(ph / 2) / 4 from -pi is (1 + sin(ph / 2)) / 2 */
    else
        phi = k == LOBE_TT ? (float)M_PI + von_mises_sample(&s->azimuth, u[2]) : (float)(2 * M_PI) * u[2];
    float cos_theta = fmaxf(cosf(theta), 0), x = cosf(phi), y = sinf(phi);
    wi[0] = sinf(theta);
    wi[1] = cos_theta * (x * dout.azimuth[0] - y * dout.azimuth[1]);
    wi[2] = cos_theta * (y * dout.azimuth[0] + x * dout.azimuth[1]);
}

const struct scattering_model scattering_textile = {
    SURFACE_MODEL_ROW(textile),  .across_width = true, .flat_section = true, .prepare = prepare,
    .release = two_lobe_release, .eval = eval,         .sample = sample,     .pdf = pdf,
    .eval_pdf = eval_pdf,
};
