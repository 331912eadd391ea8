/* microfacet_ellipse.v1: evaluation with scores, and sampling (microfacet.h states the model).
 *
 * Sampling of wi: a lobe by its energy at th_o and the weights of the channels; an azimuth from the lobe at th_d =
 * th_o, averaged over the channels, and 2 % uniform; th_i normally distributed about one of both shifted cones, with
 * shift and width of this azimuth, beyond a pole taken as the direction on its other side. The density does not know
 * a(th) and takes th_d = th_o, so weights are bounded but not constant.
 */
#include "renderer/scattering/models/microfacet/microfacet.h"
#include "renderer/scattering/azimuth_table.h"
#include "renderer/scattering/scattering_state.h"
#include "renderer/scattering/tilted_lobe.h"

#include <stdlib.h>

#define MOST_WIDTH 0.8f         /* of samples along the fiber: they go beyond one pole, not beyond both */
#define LEAST_PROBABILITY 0.04f /* of a lobe: no lobe is starved, because all carry derivatives */

static status fill(struct scattering_state *s, const double *param, struct thread_pool *pool, struct error *err)
{
    (void)pool;
    struct microfacet_clear *clear = malloc((MICROFACET_N_ROW + 1) * sizeof *clear);
    if (clear == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    const double tilt = tan(param[MICROFACET_P_TAU]);
    s->surface = (struct microfacet_surface){(float)param[MICROFACET_P_ETA], (float)param[MICROFACET_P_ROUGHNESS],
                                             (float)tilt, (float)(1 + tilt * tilt)};
    status st = microfacet_tables(s, param, clear, err);
    if (st == STATUS_OK) st = microfacet_balance(s, clear, err);
    free(clear);
    return st;
}

static status prepare(const double *param, struct scattering_state **state, struct error *err)
{
    return scattering_state_new(&scattering_microfacet_ellipse, param, fill, sizeof **state, NULL, state, err);
}

static void release(struct scattering_state *s) { free(s); }

static struct azimuth_index index_of(const float wi[3], const float wo[3])
{
    return azimuth_index_of(wi, wo, MICROFACET_N_ROW, MICROFACET_N_PHI);
}

/* a(th); adds d ln a to d_ln. */
static float scale_at(const struct scattering_state *s, float theta_rad, float d_ln[MICROFACET_N_SCALE])
{
    enum { N = MICROFACET_N_SCALE_NODE };
    int i;
    const float t = table_position(fabsf(theta_rad) * (float)((N - 1) / M_PI_2), N - 1, &i);
    for (int k = 0; k < MICROFACET_N_SCALE; k++) d_ln[k] += table_mix(s->d_ln_scale[k][i], s->d_ln_scale[k][i + 1], t);
    return table_mix(s->scale[i], s->scale[i + 1], t);
}

#define BILINEAR(field) AZIMUTH_BILINEAR(corner, g, field)

static struct microfacet_cell cell_at(const struct scattering_state *s, const struct azimuth_index *g)
{
    const struct microfacet_cell *corner[4] = {&s->cell[g->row][g->column], &s->cell[g->row][g->column + 1],
                                               &s->cell[g->row + 1][g->column], &s->cell[g->row + 1][g->column + 1]};
    struct microfacet_cell y;
    for (int p = 0; p < MICROFACET_N_INNER; p++) {
        y.shift[p] = BILINEAR(shift[p]);
        y.width[p] = BILINEAR(width[p]);
        for (int c = 0; c < 3; c++) y.n[p][c] = BILINEAR(n[p][c]);
    }
    return y;
}

static struct microfacet_slope slope_at(const struct scattering_state *s, const struct azimuth_index *g)
{
    const struct microfacet_slope *corner[4] = {&s->slope[g->row][g->column], &s->slope[g->row][g->column + 1],
                                                &s->slope[g->row + 1][g->column], &s->slope[g->row + 1][g->column + 1]};
    struct microfacet_slope y;
    for (int p = 0; p < MICROFACET_N_INNER; p++) {
        for (int k = 0; k < MICROFACET_N_SCALE; k++) y.shift[p][k] = BILINEAR(shift[p][k]);
        for (int k = 0; k < MICROFACET_N_BY; k++) {
            y.width[p][k] = BILINEAR(width[p][k]);
            for (int c = 0; c < 3; c++) y.n[p][k][c] = BILINEAR(n[p][k][c]);
        }
        for (int c = 0; c < 3; c++) y.by_c_t[p][c] = BILINEAR(by_c_t[p][c]);
    }
    return y;
}

/* Terms that the scores need of S. S without the scale is their sum. */
struct terms {
    struct microfacet_cell cell;
    float r, d_r[MICROFACET_R_N_BY], seen, d_seen; /* R if no facet were hidden; visible share, and by r */
    float m[MICROFACET_N_INNER + 1], d[MICROFACET_N_INNER + 1][2]; /* M; by shift and width; the last is the rest's */
    float rest[3], d_scale[MICROFACET_N_SCALE];                    /* d ln of the scales of both directions */
};

static void scores(const struct scattering_state *s, const struct azimuth_index *g, const struct terms *t,
                   const float sum[3], float *score)
{
    enum { REST = MICROFACET_N_INNER };
    const struct microfacet_slope d = slope_at(s, g);
    const struct microfacet_row *a = &s->row[g->row], *b = a + 1;
    float of_r[MICROFACET_N_SCALE] = {0};
    for (int j = 0; j < 3 * MICROFACET_N_PARAM; j++) score[j] = 0;
    of_r[MICROFACET_BY_ETA] = t->seen * t->d_r[MICROFACET_R_BY_ETA];
    of_r[MICROFACET_BY_ROUGHNESS] = t->seen * t->d_r[MICROFACET_R_BY_ROUGHNESS] + t->d_seen * t->r;
    of_r[MICROFACET_BY_TAU] = t->seen * t->d_r[MICROFACET_R_BY_TAU];
    for (int c = 0; c < 3; c++) {
        float *h = score + c * MICROFACET_N_PARAM, by_c_t = t->m[REST] * table_mix(a->by_c_t[c], b->by_c_t[c], g->x);
        const float inv = sum[c] > 1e-30f ? 1 / sum[c] : 0;
        for (int p = 0; p < MICROFACET_N_INNER; p++) by_c_t += t->m[p] * d.by_c_t[p][c];
        h[MICROFACET_P_C_T + c] = by_c_t * inv;
        for (int k = 0; k < MICROFACET_N_SCALE; k++) {
            float by = of_r[k];
            for (int p = 0; p < MICROFACET_N_INNER; p++) {
                by += t->cell.n[p][c] * t->d[p][0] * d.shift[p][k];
                if (k < MICROFACET_N_BY) by += t->m[p] * d.n[p][k][c] + t->cell.n[p][c] * t->d[p][1] * d.width[p][k];
            }
            if (k < MICROFACET_N_BY)
                by += t->m[REST] * table_mix(a->d_rest[k][c], b->d_rest[k][c], g->x) +
                      t->rest[c] * t->d[REST][1] * table_mix(a->d_width[k], b->d_width[k], g->x);
            h[MICROFACET_P_ETA + k] = by * inv + t->d_scale[k];
        }
    }
}

static void eval_at(const struct scattering_state *s, const float wi[3], const float wo[3],
                    const struct azimuth_index *g, float s_rgb[3], float *score)
{
    enum { REST = MICROFACET_N_INNER };
    struct terms t = {.d_scale = {0}};
    const struct microfacet_row *a = &s->row[g->row], *b = a + 1;
    const float x = g->in.theta_rad + g->out.theta_rad;
    const float scale = scale_at(s, g->in.theta_rad, t.d_scale) * scale_at(s, g->out.theta_rad, t.d_scale);
    const struct microfacet_half half = microfacet_half_of(wi, wo);
    float sum[3];
    t.cell = cell_at(s, g);
    t.r = microfacet_reflected(&s->surface, half.t, half.cos_half, score != NULL ? t.d_r : NULL);
    t.seen = microfacet_seen_at(a, g->x, half.cos_alpha, &t.d_seen);
    for (int p = 0; p <= REST; p++) {
        const struct tilted_lobe lobe = p < REST ? (struct tilted_lobe){t.cell.shift[p], t.cell.width[p]}
                                                 : (struct tilted_lobe){0, table_mix(a->width, b->width, g->x)};
        t.m[p] = tilted_lobe_eval(&lobe, x, score != NULL ? t.d[p] : NULL);
    }
    for (int c = 0; c < 3; c++) {
        t.rest[c] = table_mix(a->rest[c], b->rest[c], g->x);
        sum[c] = t.seen * t.r + t.m[REST] * t.rest[c];
        for (int p = 0; p < MICROFACET_N_INNER; p++) sum[c] += t.m[p] * t.cell.n[p][c];
        s_rgb[c] = scale * sum[c];
    }
    if (score != NULL) scores(s, g, &t, sum, score);
}

/* ---- samples ---- */

/* Between rows, of the light that leaves along wo. */
static void lobe_probabilities(const struct scattering_state *s, int row, float x, const float *weight_rgb,
                               float p[MICROFACET_N_LOBE])
{
    azimuth_mode_probabilities(s->row[row].energy, s->row[row + 1].energy, x, MICROFACET_N_LOBE, weight_rgb,
                               LEAST_PROBABILITY, p);
}

/* The lobe k along the fiber at th_d = th_o and between two azimuths. */
static struct tilted_lobe lobe_along(const struct scattering_state *s, int k, int row, float x, int column, float y)
{
    const struct microfacet_row *a = &s->row[row], *b = a + 1;
    if (k == MICROFACET_REST) return (struct tilted_lobe){0, fminf(table_mix(a->width, b->width, x), MOST_WIDTH)};
    const struct azimuth_index index = {.x = x, .y = y}, *g = &index;
    if (k == MICROFACET_R) {
        const float shift = table_mix(table_mix(a->shift_r[column], a->shift_r[column + 1], y),
                                      table_mix(b->shift_r[column], b->shift_r[column + 1], y), x);
        const float width = table_mix(table_mix(a->width_r[column], a->width_r[column + 1], y),
                                      table_mix(b->width_r[column], b->width_r[column + 1], y), x);
        return (struct tilted_lobe){shift, fminf(width, MOST_WIDTH)};
    }
    const struct microfacet_cell *corner[4] = {&s->cell[row][column], &s->cell[row][column + 1],
                                               &s->cell[row + 1][column], &s->cell[row + 1][column + 1]};
    const int p = k - MICROFACET_INNER;
    return (struct tilted_lobe){fabsf(BILINEAR(shift[p])), fminf(BILINEAR(width[p]), MOST_WIDTH)};
}

static float density(const struct scattering_state *s, const struct azimuth_index *g, const float *weight_rgb)
{
    const struct microfacet_row *a = &s->row[g->out_row], *b = a + 1;
    float p[MICROFACET_N_LOBE], sum = 0;
    lobe_probabilities(s, g->out_row, g->out_x, weight_rgb, p);
    for (int k = 0; k < MICROFACET_N_LOBE; k++) {
        float around = (float)(1 / M_PI);
        if (k < MICROFACET_REST) {
            const float before = table_mix(a->density[k][g->column], a->density[k][g->column + 1], g->y);
            const float after = table_mix(b->density[k][g->column], b->density[k][g->column + 1], g->y);
            around = table_mix(before, after, g->out_x);
        }
        const struct tilted_lobe lobe = lobe_along(s, k, g->out_row, g->out_x, g->column, g->y);
        const float m = tilted_lobe_eval(&lobe, g->in.theta_rad + g->out.theta_rad, NULL);
        sum += p[k] * 0.5f * around * tilted_lobe_density(&lobe, g->in.theta_rad, g->out.theta_rad, m);
    }
    return sum / fmaxf(g->in.cos_theta, FIBER_COS_MIN);
}

static float eval_pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb,
                      float s_rgb[3], float *score)
{
    const struct azimuth_index g = index_of(wi, wo);
    eval_at(s, wi, wo, &g, s_rgb, score);
    return density(s, &g, weight_rgb);
}

static void eval(const struct scattering_state *s, const float wi[3], const float wo[3], float s_rgb[3], float *score)
{
    const struct azimuth_index g = index_of(wi, wo);
    eval_at(s, wi, wo, &g, s_rgb, score);
}

static float pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb)
{
    const struct azimuth_index g = index_of(wi, wo);
    return density(s, &g, weight_rgb);
}

static void sample(const struct scattering_state *s, const float wo[3], const float *weight_rgb, const float u[3],
                   float wi[3])
{
    const struct fiber_direction out = fiber_direction_of(wo);
    float p[MICROFACET_N_LOBE], rest = u[0], phi;
    int row, column, k = 0;
    const float x = table_position(out.cos_theta * MICROFACET_N_ROW, MICROFACET_N_ROW, &row);
    lobe_probabilities(s, row, x, weight_rgb, p);
    while (k < MICROFACET_N_LOBE - 1 && rest >= p[k]) rest -= p[k++];
    const struct microfacet_row *a = &s->row[row], *b = a + 1;
    if (k == MICROFACET_REST)
        phi = (2 * u[2] - 1) * (float)M_PI;
    else
        phi = azimuth_draw_side(a->density[k], a->below[k], b->density[k], b->below[k], MICROFACET_N_PHI, x, u[2]);
    const float y = table_position(fabsf(phi) * (float)(MICROFACET_N_PHI / M_PI), MICROFACET_N_PHI, &column);
    const struct tilted_lobe lobe = lobe_along(s, k, row, x, column, y);
    const float theta = tilted_lobe_sample(&lobe, out.theta_rad, u[1]);
    fiber_direction_beyond(&out, sinf(theta), fmaxf(cosf(theta), 0), cosf(phi), sinf(phi), wi);
}

const struct scattering_model scattering_microfacet_ellipse = {
    SURFACE_MODEL_ROW(microfacet_ellipse),
    .prepare = prepare,
    .release = release,
    .eval = eval,
    .sample = sample,
    .pdf = pdf,
    .eval_pdf = eval_pdf,
};
