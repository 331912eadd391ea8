/* fur.v1: evaluation with scores, and sampling (fur.h states the model, fur_far.h its tables). Sampling of wi: a mode
 * by its energy at th_o and the weights of the channels; th_i from the lobe of the mode, or of scattered light any
 * direction; an azimuth from N of the mode at th_d = th_o, averaged over the channels, and 2 % uniform.
 */
#include "renderer/scattering/models/fur/fur_far.h"
#include "renderer/scattering/scattering_state.h"

#include <stdlib.h>

#define LEAST_PROBABILITY 0.03f /* of a mode: no mode is starved, because all carry derivatives */

static const int param_of[FUR_F_N] = {-1,       FUR_P_ETA, FUR_P_KAPPA, FUR_P_LAYERS,
                                      FUR_P_MS, FUR_P_MA,  FUR_P_G,     FUR_P_GAMMA};

static status fill(struct scattering_state *s, const double *param, struct thread_pool *pool, struct error *err)
{
    const status st = fur_along_init(&s->along, param, pool, err);
    return st == STATUS_OK ? fur_far_tables(s, param, pool, err) : st;
}

static status prepare_shared(const double *param, struct thread_pool *pool, struct scattering_state **state,
                             struct error *err)
{
    return scattering_state_new(&scattering_fur, param, fill, sizeof **state, pool, state, err);
}

static status prepare(const double *param, struct scattering_state **state, struct error *err)
{
    return prepare_shared(param, NULL, state, err);
}

static void release(struct scattering_state *s) { free(s); }

/* Probabilities of the modes at th_o. */
static void mode_probabilities(const struct scattering_state *s, int row, float x, const float *weight_rgb,
                               float p[FUR_FAR_N_MODE])
{
    azimuth_mode_probabilities(s->row[row].energy, s->row[row + 1].energy, x, FUR_FAR_N_MODE, weight_rgb,
                               LEAST_PROBABILITY, p);
}

/* A pair of directions: M of each lobe, and the factors of the tables. */
struct terms {
    struct azimuth_index g;
    float m[FUR_N_LOBE], d[FUR_N_LOBE][2];             /* M, and by shift and width */
    float factor[FUR_FAR_N_LOBE];                      /* of N of each lobe in S */
    float d_scale[FUR_N_SCALE], d_wide[FUR_N_MEAN_BY]; /* d ln of the scales of the lobes and of scattered light */
    float d_medulla[MEDULLA_N_BY];                     /* d ln M_s */
};

static void add_medulla(const struct scattering_state *s, float cos_d, struct terms *t)
{
    const struct azimuth_index *g = &t->g;
    const float through = ((float)g->column + g->y) / FUR_N_PHI, in = g->in.theta_rad, out = g->out.theta_rad;
    float half[MEDULLA_N_HALF], d[MEDULLA_N_BY][MEDULLA_N_HALF];
    medulla_along_at(&s->along.medulla, in + out, in - out, half, d);
    const float m = table_mix(half[0], half[1], through);
    for (int q = 0; q < MEDULLA_N_BY; q++) t->d_medulla[q] = table_mix(d[q][0], d[q][1], through) / m;
    t->factor[FUR_FAR_S] = m * fur_scattered_scale(&s->along, &g->in, &g->out, cos_d, t->d_wide);
}

static void terms_of(const struct scattering_state *s, const float wi[3], const float wo[3], struct terms *t)
{
    t->g = azimuth_index_of(wi, wo, FUR_FAR_ROW, FUR_N_PHI);
    for (int k = 0; k < FUR_N_SCALE; k++) t->d_scale[k] = 0;
    const float scale = fur_scale_at(&s->along, t->g.in.theta_rad, t->d_scale) *
                        fur_scale_at(&s->along, t->g.out.theta_rad, t->d_scale);
    for (int p = 0; p < FUR_N_LOBE; p++) {
        t->m[p] = tilted_lobe_eval(&s->along.lobe[p], t->g.in.theta_rad + t->g.out.theta_rad, t->d[p]);
        t->factor[p] = scale * t->m[p];
        t->d[p][0] *= scale * (float)fur_shift[p];
        t->d[p][1] *= scale * (float)fur_width[p];
    }
    add_medulla(s, ((float)t->g.row + t->g.x) / FUR_FAR_ROW, t);
}

static float density(const struct scattering_state *s, const struct azimuth_index *g, const float *weight_rgb,
                     const float m[FUR_N_LOBE])
{
    const struct fur_row *a = &s->row[g->out_row], *b = a + 1;
    float p[FUR_FAR_N_MODE], lobes = 0, scattered = 0;
    mode_probabilities(s, g->out_row, g->out_x, weight_rgb, p);
    for (int k = 0; k < FUR_FAR_N_LOBE; k++) {
        float before = table_mix(a->density[k][g->column], a->density[k][g->column + 1], g->y);
        float after = table_mix(b->density[k][g->column], b->density[k][g->column + 1], g->y);
        float around = p[k] * 0.5f * table_mix(before, after, g->out_x);
        if (k == FUR_FAR_S) {
            scattered = 0.5f * around;
            continue;
        }
        if (k == FUR_TRT) around += p[FUR_FAR_REST] * (float)(0.5 / M_PI);
        lobes += around * tilted_lobe_density(&s->along.lobe[k], g->in.theta_rad, g->out.theta_rad, m[k]);
    }
    return lobes / fmaxf(g->in.cos_theta, FIBER_COS_MIN) + scattered;
}

#define BILINEAR(field) AZIMUTH_BILINEAR(corner, &t->g, field)

static void scores(const struct scattering_state *s, const struct terms *t, float (*n)[3], const float rest[3],
                   float *score)
{
    static const int of_scale[FUR_N_SCALE] = {FUR_P_ETA, FUR_P_KAPPA, FUR_P_LAYERS, FUR_P_MS,
                                              FUR_P_G,   FUR_P_ALPHA, FUR_P_BETA};
    const struct azimuth_index *g = &t->g;
    const struct fur_slope *corner[4] = {&s->slope[g->row][g->column], &s->slope[g->row][g->column + 1],
                                         &s->slope[g->row + 1][g->column], &s->slope[g->row + 1][g->column + 1]};
    const struct fur_row *a = &s->row[g->row], *b = a + 1;
    float by[FUR_F_N][3] = {{0}};
    for (int p = 0; p < FUR_FAR_N_LOBE; p++)
        for (int q = 0; q < FUR_F_N; q++)
            for (int c = 0; c < 3; c++) by[q][c] += t->factor[p] * BILINEAR(n[p][q][c]);
    for (int q = 0; q < FUR_F_G; q++)
        for (int c = 0; c < 3; c++) by[q][c] += t->factor[FUR_TRT] * table_mix(a->d_rest[q][c], b->d_rest[q][c], g->x);
    for (int c = 0; c < 3; c++) {
        float *h = score + c * FUR_N_PARAM, lobes = t->factor[FUR_TRT] * rest[c];
        for (int k = 0; k < FUR_N_PARAM; k++) h[k] = 0;
        for (int p = 0; p < FUR_N_LOBE; p++) {
            float around = n[p][c] + (p == FUR_TRT ? rest[c] : 0);
            lobes += t->factor[p] * n[p][c];
            h[FUR_P_ALPHA] += t->d[p][0] * around;
            h[FUR_P_BETA] += t->d[p][1] * around;
        }
        const float wide = t->factor[FUR_FAR_S] * n[FUR_FAR_S][c], sum = lobes + wide, inv = sum > 1e-30f ? 1 / sum : 0;
        for (int q = 0; q < FUR_F_N; q++) h[q == FUR_F_C ? FUR_P_C_T + c : param_of[q]] += by[q][c];
        for (int k = 0; k < FUR_N_SCALE; k++) h[of_scale[k]] += lobes * t->d_scale[k];
        for (int k = 0; k < FUR_N_MEAN_BY; k++) h[of_scale[k]] += wide * t->d_wide[k];
        h[FUR_P_KAPPA] += wide * t->d_medulla[MEDULLA_BY_DEPTH] * (float)s->along.fiber.sigma_ms;
        h[FUR_P_MS] += wide * t->d_medulla[MEDULLA_BY_DEPTH] * (float)s->along.fiber.kappa;
        h[FUR_P_G] += wide * t->d_medulla[MEDULLA_BY_G];
        for (int k = 0; k < FUR_N_PARAM; k++) h[k] *= inv;
    }
}

static void eval_at(const struct scattering_state *s, const struct terms *t, float s_rgb[3], float *score)
{
    const struct azimuth_index *g = &t->g;
    const struct fur_cell *corner[4] = {&s->cell[g->row][g->column], &s->cell[g->row][g->column + 1],
                                        &s->cell[g->row + 1][g->column], &s->cell[g->row + 1][g->column + 1]};
    const struct fur_row *a = &s->row[g->row], *b = a + 1;
    float n[FUR_FAR_N_LOBE][3], rest[3];
    for (int c = 0; c < 3; c++) {
        rest[c] = table_mix(a->rest[c], b->rest[c], g->x);
        s_rgb[c] = t->factor[FUR_TRT] * rest[c];
        for (int p = 0; p < FUR_FAR_N_LOBE; p++) s_rgb[c] += t->factor[p] * (n[p][c] = BILINEAR(n[p][c]));
    }
    if (score != NULL) scores(s, t, n, rest, score);
}

static float eval_pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb,
                      float s_rgb[3], float *score)
{
    struct terms t;
    terms_of(s, wi, wo, &t);
    eval_at(s, &t, s_rgb, score);
    return density(s, &t.g, weight_rgb, t.m);
}

static void eval(const struct scattering_state *s, const float wi[3], const float wo[3], float s_rgb[3], float *score)
{
    struct terms t;
    terms_of(s, wi, wo, &t);
    eval_at(s, &t, s_rgb, score);
}

static float pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb)
{
    const struct azimuth_index g = azimuth_index_of(wi, wo, FUR_FAR_ROW, FUR_N_PHI);
    float m[FUR_N_LOBE];
    for (int p = 0; p < FUR_N_LOBE; p++)
        m[p] = tilted_lobe_eval(&s->along.lobe[p], g.in.theta_rad + g.out.theta_rad, NULL);
    return density(s, &g, weight_rgb, m);
}

static void sample(const struct scattering_state *s, const float wo[3], const float *weight_rgb, const float u[3],
                   float wi[3])
{
    struct fiber_direction out = fiber_direction_of(wo);
    float p[FUR_FAR_N_MODE], rest = u[0], phi = u[2], sin_i = 2 * u[1] - 1, cos_i = sqrtf((1 - sin_i) * (1 + sin_i));
    int row, k = 0;
    float x = table_position(out.cos_theta * FUR_FAR_ROW, FUR_FAR_ROW, &row);
    mode_probabilities(s, row, x, weight_rgb, p);
    while (k < FUR_FAR_N_MODE - 1 && rest >= p[k]) rest -= p[k++];
    if (k != FUR_FAR_S) {
        float theta = tilted_lobe_sample(&s->along.lobe[k == FUR_FAR_REST ? FUR_TRT : k], out.theta_rad, u[1]);
        sin_i = sinf(theta);
        cos_i = fmaxf(cosf(theta), 0);
    }
    const struct fur_row *a = &s->row[row], *b = a + 1;
    if (k == FUR_FAR_REST)
        phi *= (float)(2 * M_PI);
    else
        phi = azimuth_draw_side(a->density[k], a->below[k], b->density[k], b->below[k], FUR_N_PHI, x, phi);
    fiber_direction_beyond(&out, sin_i, cos_i, cosf(phi), sinf(phi), wi);
}

const struct scattering_model scattering_fur = {
    SURFACE_MODEL_ROW(fur), .prepare = prepare, .release = release,   .eval = eval,
    .sample = sample,       .pdf = pdf,         .eval_pdf = eval_pdf,
};
