/* wave_silk.v2, wave_trilobal.v2, wave_cotton.v2: evaluation with scores, and sampling (wave_fiber.h states the model).
 *
 * Sampling of wi: th_i normally distributed about the cone of the mirror, beyond a pole taken as the direction on its
 * other side; a channel by its light that leaves and its weight; an azimuth from N of this channel at th_d = th_o, and
 * 2 % uniform. The density does not know a(th) and takes th_d = th_o, so weights are bounded but not constant.
 */
#include "renderer/scattering/models/wave/wave_fiber.h"
#include "renderer/scattering/azimuth_table.h"
#include "renderer/scattering/models/wave/speckle_tables.h"
#include "renderer/scattering/scattering_state.h"

#include <stdlib.h>

#define LEAST_PROBABILITY 0.03f /* of a channel */

static status balance(struct scattering_state *s, double beta, struct error *err)
{
    struct lobe_balance *b = malloc(sizeof *b);
    double a[LOBE_BALANCE_N], d_ln_a[LOBE_BALANCE_N];
    if (b == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    lobe_balance_init(b);
    lobe_balance_r(b, beta, a, d_ln_a);
    free(b);
    for (int i = 0; i < LOBE_BALANCE_N; i++) {
        s->scale[i] = (float)a[i];
        s->d_ln_scale[i] = (float)d_ln_a[i];
    }
    return STATUS_OK;
}

static status fill(struct scattering_state *s, const struct wave_table *table, const double *param, struct error *err)
{
    s->along = (struct tilted_lobe){.shift = 0, .width = (float)param[WAVE_P_BETA]};
    const status st = wave_fiber_tables(s, table, param, err);
    return st == STATUS_OK ? balance(s, param[WAVE_P_BETA], err) : st;
}

static void release(struct scattering_state *s) { free(s); }

static struct azimuth_index index_of(const float wi[3], const float wo[3])
{
    return azimuth_index_of(wi, wo, WAVE_N_ROW, WAVE_N_PHI);
}

/* a(th); adds d ln a by beta. */
static float scale_at(const struct scattering_state *s, float theta_rad, float *d_ln)
{
    int i;
    float t = table_position(fabsf(theta_rad) * (float)((LOBE_BALANCE_N - 1) / M_PI_2), LOBE_BALANCE_N - 1, &i);
    *d_ln += table_mix(s->d_ln_scale[i], s->d_ln_scale[i + 1], t);
    return table_mix(s->scale[i], s->scale[i + 1], t);
}

#define BILINEAR(field) AZIMUTH_BILINEAR(corner, g, field)

/* m: g(th_i + th_o), and its derivative by beta when there are scores. */
static void eval_at(const struct scattering_state *s, const struct azimuth_index *g, const float m[2], float s_rgb[3],
                    float *score)
{
    const struct wave_cell *corner[4] = {&s->cell[g->row][g->column], &s->cell[g->row][g->column + 1],
                                         &s->cell[g->row + 1][g->column], &s->cell[g->row + 1][g->column + 1]};
    float by_beta = 0, scale = scale_at(s, g->in.theta_rad, &by_beta) * scale_at(s, g->out.theta_rad, &by_beta);
    if (score != NULL) by_beta += m[0] > 1e-30f ? m[1] / m[0] : 0;
    for (int c = 0; c < 3; c++) {
        const float n = BILINEAR(n[c]);
        s_rgb[c] = scale * m[0] * n;
        if (score == NULL) continue;
        float *h = score + c * WAVE_N_PARAM;
        for (int k = 0; k < 3; k++) h[WAVE_P_C_T + k] = k == c ? BILINEAR(d[WAVE_D_C_T][c]) / n : 0;
        h[WAVE_P_BETA] = by_beta;
        h[WAVE_P_GAMMA] = BILINEAR(d[WAVE_D_GAMMA][c]) / n;
    }
}

/* g(th_i + th_o), and its derivative by beta when wanted. */
static void along(const struct scattering_state *s, const struct azimuth_index *g, float m[2], bool scores)
{
    float d[2];
    m[0] = tilted_lobe_eval(&s->along, g->in.theta_rad + g->out.theta_rad, scores ? d : NULL);
    m[1] = scores ? d[1] : 0;
}

/* Probabilities of the channels at th_o. */
static void channel_probabilities(const struct scattering_state *s, int row, float x, const float *weight_rgb,
                                  float p[3])
{
    azimuth_mode_probabilities(s->row[row].energy, s->row[row + 1].energy, x, 3, weight_rgb, LEAST_PROBABILITY, p);
}

static float density(const struct scattering_state *s, const struct azimuth_index *g, const float *weight_rgb, float m)
{
    const struct wave_row *a = &s->row[g->out_row], *b = a + 1;
    float p[3], around = 0;
    channel_probabilities(s, g->out_row, g->out_x, weight_rgb, p);
    for (int c = 0; c < 3; c++) {
        float before = table_mix(a->density[c][g->column], a->density[c][g->column + 1], g->y);
        float after = table_mix(b->density[c][g->column], b->density[c][g->column + 1], g->y);
        around += p[c] * 0.5f * table_mix(before, after, g->out_x);
    }
    return around * tilted_lobe_density(&s->along, g->in.theta_rad, g->out.theta_rad, m) /
           fmaxf(g->in.cos_theta, FIBER_COS_MIN);
}

static float eval_pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb,
                      float s_rgb[3], float *score)
{
    const struct azimuth_index g = index_of(wi, wo);
    float m[2];
    along(s, &g, m, score != NULL);
    eval_at(s, &g, m, s_rgb, score);
    return density(s, &g, weight_rgb, m[0]);
}

static void eval(const struct scattering_state *s, const float wi[3], const float wo[3], float s_rgb[3], float *score)
{
    const struct azimuth_index g = index_of(wi, wo);
    float m[2];
    along(s, &g, m, score != NULL);
    eval_at(s, &g, m, s_rgb, score);
}

static float pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb)
{
    const struct azimuth_index g = index_of(wi, wo);
    float m[2];
    along(s, &g, m, false);
    return density(s, &g, weight_rgb, m[0]);
}

static void sample(const struct scattering_state *s, const float wo[3], const float *weight_rgb, const float u[3],
                   float wi[3])
{
    struct fiber_direction out = fiber_direction_of(wo);
    float p[3], rest = u[0];
    int row, c = 0;
    float x = table_position(out.cos_theta * WAVE_N_ROW, WAVE_N_ROW, &row);
    channel_probabilities(s, row, x, weight_rgb, p);
    while (c < 2 && rest >= p[c]) rest -= p[c++];
    const struct wave_row *a = &s->row[row], *b = a + 1;
    float theta = tilted_lobe_sample(&s->along, out.theta_rad, u[1]);
    float phi = azimuth_draw_side(a->density[c], a->below[c], b->density[c], b->below[c], WAVE_N_PHI, x, u[2]);
    fiber_direction_beyond(&out, sinf(theta), fmaxf(cosf(theta), 0), cosf(phi), sinf(phi), wi);
}

#define WAVE_MODEL(name, speckle_table)                                                                                \
    static status fill_##name(struct scattering_state *s, const double *param, struct thread_pool *pool,               \
                              struct error *err)                                                                       \
    {                                                                                                                  \
        (void)pool;                                                                                                    \
        return fill(s, &name##_table, param, err);                                                                     \
    }                                                                                                                  \
    static status prepare_##name(const double *param, struct scattering_state **state, struct error *err)              \
    {                                                                                                                  \
        return scattering_state_new(&scattering_##name, param, fill_##name, sizeof **state, NULL, state, err);         \
    }                                                                                                                  \
    const struct scattering_model scattering_##name = {                                                                \
        SURFACE_MODEL_ROW(name),                                                                                       \
        .prepare = prepare_##name,                                                                                     \
        .speckle = speckle_table,                                                                                      \
        .release = release,                                                                                            \
        .eval = eval,                                                                                                  \
        .sample = sample,                                                                                              \
        .pdf = pdf,                                                                                                    \
        .eval_pdf = eval_pdf,                                                                                          \
    };

WAVE_MODEL(wave_silk, &wave_silk_speckle)
WAVE_MODEL(wave_trilobal, &wave_trilobal_speckle)
WAVE_MODEL(wave_cotton, &wave_cotton_speckle)
