/* dielectric.v1: evaluation with scores, and sampling (dielectric.h states the model).
 *
 * Sampling of wi: a mode by its energy at th_o and the weights of the channels; th_i from M, an azimuth from N of the
 * mode at th_d = th_o, averaged over the channels, and 2 % uniform. The density does not know a(th) and takes
 * th_d = th_o, so weights are bounded but not constant.
 */
#include "renderer/scattering/models/dielectric/dielectric.h"
#include "renderer/scattering/azimuth_table.h"
#include "renderer/scattering/scattering_state.h"

#include <stdlib.h>

#define LEAST_PROBABILITY 0.03f /* of a mode: no mode is starved, because all carry derivatives */

static status fill(struct scattering_state *s, const double *param, struct thread_pool *pool, struct error *err)
{
    (void)pool;
    const status st = dielectric_tables(s, param, err);
    if (st != STATUS_OK) return st;
    return dielectric_along_init(&s->along, param[DIELECTRIC_P_ETA], param[DIELECTRIC_P_BETA], err);
}

static status prepare(const double *param, struct scattering_state **state, struct error *err)
{
    return scattering_state_new(&scattering_dielectric, param, fill, sizeof **state, NULL, state, err);
}

static void release(struct scattering_state *s) { free(s); }

static struct azimuth_index index_of(const float wi[3], const float wo[3])
{
    return azimuth_index_of(wi, wo, DIELECTRIC_N_ROW, DIELECTRIC_N_PHI);
}

#define BILINEAR(field) AZIMUTH_BILINEAR(corner, g, field)

static struct dielectric_cell cell_at(const struct scattering_state *s, const struct azimuth_index *g)
{
    const struct dielectric_cell *corner[4] = {&s->cell[g->row][g->column], &s->cell[g->row][g->column + 1],
                                               &s->cell[g->row + 1][g->column], &s->cell[g->row + 1][g->column + 1]};
    struct dielectric_cell y = {.r = BILINEAR(r)};
    for (int p = 0; p < 2; p++)
        for (int c = 0; c < 3; c++) y.inner[p][c] = BILINEAR(inner[p][c]);
    return y;
}

static struct dielectric_slope slope_at(const struct scattering_state *s, const struct azimuth_index *g)
{
    const struct dielectric_slope *corner[4] = {&s->slope[g->row][g->column], &s->slope[g->row][g->column + 1],
                                                &s->slope[g->row + 1][g->column], &s->slope[g->row + 1][g->column + 1]};
    struct dielectric_slope y;
    for (int k = 0; k < 2; k++) y.r[k] = BILINEAR(r[k]);
    for (int p = 0; p < 2; p++)
        for (int k = 0; k < 3; k++)
            for (int c = 0; c < 3; c++) y.inner[p][k][c] = BILINEAR(inner[p][k][c]);
    return y;
}

/* Probabilities of the modes at th_o. */
static void mode_probabilities(const struct scattering_state *s, int row, float x, const float *weight_rgb,
                               float p[DIELECTRIC_N_MODE])
{
    azimuth_mode_probabilities(s->row[row].energy, s->row[row + 1].energy, x, DIELECTRIC_N_MODE, weight_rgb,
                               LEAST_PROBABILITY, p);
}

static float density(const struct scattering_state *s, const struct azimuth_index *g, const float *weight_rgb,
                     const float m[DIELECTRIC_N_LOBE])
{
    const struct dielectric_row *a = &s->row[g->out_row], *b = a + 1;
    float p[DIELECTRIC_N_MODE];
    mode_probabilities(s, g->out_row, g->out_x, weight_rgb, p);
    float sum = p[DIELECTRIC_REST] * m[DIELECTRIC_TRT] * (float)(0.5 / M_PI);
    for (int k = 0; k < DIELECTRIC_N_LOBE; k++) {
        float before = table_mix(a->density[k][g->column], a->density[k][g->column + 1], g->y);
        float after = table_mix(b->density[k][g->column], b->density[k][g->column + 1], g->y);
        sum += p[k] * m[k] * 0.5f * table_mix(before, after, g->out_x);
    }
    return sum;
}

/* Terms that the scores need of the sum of m N, which is S without the scale. */
struct terms {
    const float *m, *d_beta; /* of the longitudinal lobes */
    struct dielectric_cell n;
    float rest[3], d_scale[2]; /* d ln of the scales of both directions by eta and by beta */
};

static void scores(const struct scattering_state *s, const struct azimuth_index *g, const struct terms *t, float *score)
{
    const float *m = t->m, *d_beta = t->d_beta;
    const struct dielectric_slope d = slope_at(s, g);
    const struct dielectric_row *a = &s->row[g->row], *b = a + 1;
    const float m_rest = m[DIELECTRIC_TRT];
    for (int j = 0; j < 3 * DIELECTRIC_N_PARAM; j++) score[j] = 0;
    for (int c = 0; c < 3; c++) {
        float *h = score + c * DIELECTRIC_N_PARAM, part[DIELECTRIC_N_LOBE] = {m[0] * t->n.r};
        for (int p = 0; p < 2; p++) part[1 + p] = m[1 + p] * t->n.inner[p][c];
        float sum = part[0] + part[1] + part[2] + m_rest * t->rest[c], inv = sum > 1e-30f ? 1 / sum : 0;
        float by_c_t = m_rest * table_mix(a->d_rest[0][c], b->d_rest[0][c], g->x);
        float by_eta = m_rest * table_mix(a->d_rest[1][c], b->d_rest[1][c], g->x) + m[0] * d.r[0],
              by_gamma = m[0] * d.r[1];
        float by_beta = m_rest * t->rest[c] * d_beta[DIELECTRIC_TRT];
        for (int p = 0; p < 2; p++) {
            by_c_t += m[1 + p] * d.inner[p][0][c];
            by_eta += m[1 + p] * d.inner[p][1][c];
            by_gamma += m[1 + p] * d.inner[p][2][c];
        }
        for (int p = 0; p < DIELECTRIC_N_LOBE; p++) by_beta += part[p] * d_beta[p];
        h[DIELECTRIC_P_C_T + c] = by_c_t * inv;
        h[DIELECTRIC_P_ETA] = by_eta * inv + t->d_scale[0];
        h[DIELECTRIC_P_BETA] = by_beta * inv + t->d_scale[1];
        h[DIELECTRIC_P_GAMMA] = by_gamma * inv;
    }
}

static void eval_at(const struct scattering_state *s, const struct azimuth_index *g, const float m[DIELECTRIC_N_LOBE],
                    const float *d_beta, float s_rgb[3], float *score)
{
    float d_in[2], d_out[2],
        scale = dielectric_scale_at(&s->along, g->in.theta_rad, d_in) *
                dielectric_scale_at(&s->along, g->out.theta_rad, d_out);
    const struct dielectric_row *a = &s->row[g->row], *b = a + 1;
    struct terms t = {
        .m = m, .d_beta = d_beta, .n = cell_at(s, g), .d_scale = {d_in[0] + d_out[0], d_in[1] + d_out[1]}};
    for (int c = 0; c < 3; c++) {
        t.rest[c] = table_mix(a->rest[c], b->rest[c], g->x);
        float sum = m[0] * t.n.r + m[DIELECTRIC_TRT] * t.rest[c];
        for (int p = 0; p < 2; p++) sum += m[1 + p] * t.n.inner[p][c];
        s_rgb[c] = scale * sum;
    }
    if (score != NULL) scores(s, g, &t, score);
}

static float eval_pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb,
                      float s_rgb[3], float *score)
{
    const struct azimuth_index g = index_of(wi, wo);
    float m[DIELECTRIC_N_LOBE], d_beta[DIELECTRIC_N_LOBE];
    dielectric_longitudinal(&s->along, wi[0], g.in.cos_theta, wo[0], g.out.cos_theta, m, score != NULL ? d_beta : NULL);
    eval_at(s, &g, m, d_beta, s_rgb, score);
    return density(s, &g, weight_rgb, m);
}

static void eval(const struct scattering_state *s, const float wi[3], const float wo[3], float s_rgb[3], float *score)
{
    const struct azimuth_index g = index_of(wi, wo);
    float m[DIELECTRIC_N_LOBE], d_beta[DIELECTRIC_N_LOBE];
    dielectric_longitudinal(&s->along, wi[0], g.in.cos_theta, wo[0], g.out.cos_theta, m, score != NULL ? d_beta : NULL);
    eval_at(s, &g, m, d_beta, s_rgb, score);
}

static float pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb)
{
    const struct azimuth_index g = index_of(wi, wo);
    float m[DIELECTRIC_N_LOBE];
    dielectric_longitudinal(&s->along, wi[0], g.in.cos_theta, wo[0], g.out.cos_theta, m, NULL);
    return density(s, &g, weight_rgb, m);
}

static void sample(const struct scattering_state *s, const float wo[3], const float *weight_rgb, const float u[3],
                   float wi[3])
{
    struct fiber_direction out = fiber_direction_of(wo);
    float p[DIELECTRIC_N_MODE], rest = u[0], phi = u[2];
    int row, k = 0;
    float x = table_position(out.cos_theta * DIELECTRIC_N_ROW, DIELECTRIC_N_ROW, &row);
    mode_probabilities(s, row, x, weight_rgb, p);
    while (k < DIELECTRIC_N_MODE - 1 && rest >= p[k]) rest -= p[k++];
    rest = table_stretch(rest, p[k]);
    int lobe = k < DIELECTRIC_N_LOBE ? k : DIELECTRIC_TRT;
    float sin_i = cone_lobe_sample(&s->along.longitudinal[lobe], wo[0], out.cos_theta, u[1], rest);
    const struct dielectric_row *a = &s->row[row], *b = a + 1;
    if (k == DIELECTRIC_REST)
        phi *= (float)(2 * M_PI);
    else
        phi = azimuth_draw_side(a->density[k], a->below[k], b->density[k], b->below[k], DIELECTRIC_N_PHI, x, phi);
    fiber_direction_beyond(&out, sin_i, sqrtf((1 - sin_i) * (1 + sin_i)), cosf(phi), sinf(phi), wi);
}

const struct scattering_model scattering_dielectric = {
    SURFACE_MODEL_ROW(dielectric), .prepare = prepare, .release = release, .eval = eval, .sample = sample, .pdf = pdf,
    .eval_pdf = eval_pdf,
};
