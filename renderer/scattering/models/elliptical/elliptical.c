/* elliptical.v1: evaluation with scores, and sampling (elliptical.h states the model).
 *
 * Sampling of wi: a mode by its energy at th_o and the weights of the channels; th_i normally distributed about one of
 * both shifted cones, beyond a pole taken as the direction on its other side; an azimuth from N of the mode at th_d =
 * th_o, averaged over the channels, and 2 % uniform. The density does not know a(th) and takes th_d = th_o, so weights
 * are bounded but not constant.
 */
#include "renderer/scattering/models/elliptical/elliptical.h"
#include "renderer/scattering/azimuth_table.h"
#include "renderer/scattering/scattering_state.h"

#include <stdlib.h>

#define LEAST_PROBABILITY 0.03f /* of a mode: no mode is starved, because all carry derivatives */

static status fill(struct scattering_state *s, const double *param, struct thread_pool *pool, struct error *err)
{
    (void)pool;
    struct elliptical_energies *energies = malloc(sizeof *energies);
    if (energies == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    elliptical_lobes_set(s->along, param);
    status st = elliptical_tables(s, param, energies, err);
    if (st == STATUS_OK) st = elliptical_balance(s->along, energies, &s->scale, err);
    free(energies);
    return st;
}

static status prepare(const double *param, struct scattering_state **state, struct error *err)
{
    return scattering_state_new(&scattering_elliptical, param, fill, sizeof **state, NULL, state, err);
}

static void release(struct scattering_state *s) { free(s); }

static struct azimuth_index index_of(const float wi[3], const float wo[3])
{
    return azimuth_index_of(wi, wo, ELLIPTICAL_N_ROW, ELLIPTICAL_N_PHI);
}

static void along(const struct scattering_state *s, const struct azimuth_index *g, float m[ELLIPTICAL_N_LOBE],
                  float (*d)[2])
{
    elliptical_along(s->along, g->in.theta_rad + g->out.theta_rad, m, d);
}

#define BILINEAR(field) AZIMUTH_BILINEAR(corner, g, field)

static struct elliptical_cell cell_at(const struct scattering_state *s, const struct azimuth_index *g)
{
    const struct elliptical_cell *corner[4] = {&s->cell[g->row][g->column], &s->cell[g->row][g->column + 1],
                                               &s->cell[g->row + 1][g->column], &s->cell[g->row + 1][g->column + 1]};
    struct elliptical_cell y;
    for (int p = 0; p < ELLIPTICAL_N_LOBE; p++)
        for (int c = 0; c < 3; c++) y.n[p][c] = BILINEAR(n[p][c]);
    return y;
}

static struct elliptical_slope slope_at(const struct scattering_state *s, const struct azimuth_index *g)
{
    const struct elliptical_slope *corner[4] = {&s->slope[g->row][g->column], &s->slope[g->row][g->column + 1],
                                                &s->slope[g->row + 1][g->column], &s->slope[g->row + 1][g->column + 1]};
    struct elliptical_slope y;
    for (int p = 0; p < ELLIPTICAL_N_LOBE; p++)
        for (int k = 0; k < ELLIPTICAL_N_SLOPE; k++)
            for (int c = 0; c < 3; c++) y.n[p][k][c] = BILINEAR(n[p][k][c]);
    return y;
}

/* Probabilities of the modes at th_o. */
static void mode_probabilities(const struct scattering_state *s, int row, float x, const float *weight_rgb,
                               float p[ELLIPTICAL_N_MODE])
{
    azimuth_mode_probabilities(s->row[row].energy, s->row[row + 1].energy, x, ELLIPTICAL_N_MODE, weight_rgb,
                               LEAST_PROBABILITY, p);
}

static float density(const struct scattering_state *s, const struct azimuth_index *g, const float *weight_rgb,
                     const float m[ELLIPTICAL_N_LOBE])
{
    const struct elliptical_row *a = &s->row[g->out_row], *b = a + 1;
    float p[ELLIPTICAL_N_MODE], sum = 0;
    mode_probabilities(s, g->out_row, g->out_x, weight_rgb, p);
    for (int k = 0; k < ELLIPTICAL_N_LOBE; k++) {
        float before = table_mix(a->density[k][g->column], a->density[k][g->column + 1], g->y);
        float after = table_mix(b->density[k][g->column], b->density[k][g->column + 1], g->y);
        float around = p[k] * 0.5f * table_mix(before, after, g->out_x);
        if (k == ELLIPTICAL_REST - 1) around += p[ELLIPTICAL_REST] * (float)(0.5 / M_PI);
        sum += around * tilted_lobe_density(&s->along[k], g->in.theta_rad, g->out.theta_rad, m[k]);
    }
    return sum / fmaxf(g->in.cos_theta, FIBER_COS_MIN);
}

/* Terms that the scores need of the sum of m N, which is S without the scale. */
struct terms {
    float m[ELLIPTICAL_N_LOBE], d[ELLIPTICAL_N_LOBE][2]; /* along the fiber, and by shift and width */
    struct elliptical_cell n;
    float rest[3], d_scale[ELLIPTICAL_N_SCALE]; /* d ln of the scales of both directions */
};

static void scores(const struct scattering_state *s, const struct azimuth_index *g, const struct terms *t, float *score)
{
    const struct elliptical_slope d = slope_at(s, g);
    const struct elliptical_row *a = &s->row[g->row], *b = a + 1;
    for (int j = 0; j < 3 * ELLIPTICAL_N_PARAM; j++) score[j] = 0;
    for (int c = 0; c < 3; c++) {
        float *h = score + c * ELLIPTICAL_N_PARAM, sum = 0, by[ELLIPTICAL_N_SLOPE] = {0}, by_alpha = 0, by_beta = 0;
        for (int p = 0; p < ELLIPTICAL_N_LOBE; p++) {
            float n = t->n.n[p][c] + (p == ELLIPTICAL_REST - 1 ? t->rest[c] : 0);
            sum += t->m[p] * n;
            by_alpha += t->d[p][0] * n * (float)elliptical_shift[p];
            by_beta += t->d[p][1] * n * (float)elliptical_width[p];
            for (int k = 0; k < ELLIPTICAL_N_SLOPE; k++) by[k] += t->m[p] * d.n[p][k][c];
        }
        for (int k = 0; k <= ELLIPTICAL_D_RATIO; k++)
            by[k] += t->m[ELLIPTICAL_REST - 1] * table_mix(a->d_rest[k][c], b->d_rest[k][c], g->x);
        float inv = sum > 1e-30f ? 1 / sum : 0;
        h[ELLIPTICAL_P_C_T + c] = by[ELLIPTICAL_D_C_T] * inv;
        h[ELLIPTICAL_P_ETA] = by[ELLIPTICAL_D_ETA] * inv + t->d_scale[ELLIPTICAL_S_ETA];
        h[ELLIPTICAL_P_RATIO] = by[ELLIPTICAL_D_RATIO] * inv + t->d_scale[ELLIPTICAL_S_RATIO];
        h[ELLIPTICAL_P_ALPHA] = by_alpha * inv + t->d_scale[ELLIPTICAL_S_ALPHA];
        h[ELLIPTICAL_P_BETA] = by_beta * inv + t->d_scale[ELLIPTICAL_S_BETA];
        h[ELLIPTICAL_P_GAMMA] = by[ELLIPTICAL_D_GAMMA] * inv;
    }
}

/* t->m, and t->d when there are scores, are set. */
static void eval_at(const struct scattering_state *s, const struct azimuth_index *g, struct terms *t, float s_rgb[3],
                    float *score)
{
    for (int k = 0; k < ELLIPTICAL_N_SCALE; k++) t->d_scale[k] = 0;
    float scale = elliptical_scale_at(&s->scale, g->in.theta_rad, t->d_scale) *
                  elliptical_scale_at(&s->scale, g->out.theta_rad, t->d_scale);
    const struct elliptical_row *a = &s->row[g->row], *b = a + 1;
    t->n = cell_at(s, g);
    for (int c = 0; c < 3; c++) {
        t->rest[c] = table_mix(a->rest[c], b->rest[c], g->x);
        float sum = t->m[ELLIPTICAL_REST - 1] * t->rest[c];
        for (int p = 0; p < ELLIPTICAL_N_LOBE; p++) sum += t->m[p] * t->n.n[p][c];
        s_rgb[c] = scale * sum;
    }
    if (score != NULL) scores(s, g, t, score);
}

static float eval_pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb,
                      float s_rgb[3], float *score)
{
    const struct azimuth_index g = index_of(wi, wo);
    struct terms t;
    along(s, &g, t.m, score != NULL ? t.d : NULL);
    eval_at(s, &g, &t, s_rgb, score);
    return density(s, &g, weight_rgb, t.m);
}

static void eval(const struct scattering_state *s, const float wi[3], const float wo[3], float s_rgb[3], float *score)
{
    const struct azimuth_index g = index_of(wi, wo);
    struct terms t;
    along(s, &g, t.m, score != NULL ? t.d : NULL);
    eval_at(s, &g, &t, s_rgb, score);
}

static float pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb)
{
    const struct azimuth_index g = index_of(wi, wo);
    float m[ELLIPTICAL_N_LOBE];
    along(s, &g, m, NULL);
    return density(s, &g, weight_rgb, m);
}

static void sample(const struct scattering_state *s, const float wo[3], const float *weight_rgb, const float u[3],
                   float wi[3])
{
    struct fiber_direction out = fiber_direction_of(wo);
    float p[ELLIPTICAL_N_MODE], rest = u[0], phi = u[2];
    int row, k = 0;
    float x = table_position(out.cos_theta * ELLIPTICAL_N_ROW, ELLIPTICAL_N_ROW, &row);
    mode_probabilities(s, row, x, weight_rgb, p);
    while (k < ELLIPTICAL_N_MODE - 1 && rest >= p[k]) rest -= p[k++];
    float theta = tilted_lobe_sample(&s->along[k < ELLIPTICAL_REST ? k : ELLIPTICAL_REST - 1], out.theta_rad, u[1]);
    const struct elliptical_row *a = &s->row[row], *b = a + 1;
    if (k == ELLIPTICAL_REST)
        phi *= (float)(2 * M_PI);
    else
        phi = azimuth_draw_side(a->density[k], a->below[k], b->density[k], b->below[k], ELLIPTICAL_N_PHI, x, phi);
    fiber_direction_beyond(&out, sinf(theta), fmaxf(cosf(theta), 0), cosf(phi), sinf(phi), wi);
}

const struct scattering_model scattering_elliptical = {
    SURFACE_MODEL_ROW(elliptical), .prepare = prepare, .release = release, .eval = eval, .sample = sample, .pdf = pdf,
    .eval_pdf = eval_pdf,
};
