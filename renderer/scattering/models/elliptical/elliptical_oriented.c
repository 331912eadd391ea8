/* elliptical_oriented.v1: evaluation with scores, and sampling (elliptical_oriented.h states the model).
 *
 * Sampling of wi: a mode by its energy towards wo and the weights of the channels; th_i normally distributed about one
 * of both shifted cones, beyond a pole taken as the direction on its other side; an azimuth from F of the mode at th_d
 * = th_o and the azimuths of wo on both sides of its own in the table, averaged over the channels, and 2 % uniform. */
#include "renderer/scattering/models/elliptical/elliptical_oriented.h"
#include "renderer/scattering/azimuth_table.h"
#include "renderer/scattering/scattering_state.h"

#include <stdlib.h>
#include <string.h>

#define LEAST_PROBABILITY 0.03f /* of a mode: no mode is starved, because all carry derivatives */

static status fill(struct scattering_state *s, const double *param, struct thread_pool *pool, struct error *err)
{
    struct elliptical_energies *energies = malloc(sizeof *energies);
    struct oriented_row *row = malloc((ELLIPTICAL_N_ROW + 1) * sizeof *row);
    status st = STATUS_OK;
    if (energies == NULL || row == NULL)
        st = error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    elliptical_lobes_set(s->along, param);
    s->ratio = (float)param[ELLIPTICAL_P_RATIO];
    if (st == STATUS_OK) st = oriented_tables(s, param, pool, row, energies, err);
    if (st == STATUS_OK) st = elliptical_balance(s->along, energies, &s->scale, err);
    if (st == STATUS_OK) st = oriented_balance(s, row, err);
    free(energies);
    free(row);
    return st;
}

static status prepare_shared(const double *param, struct thread_pool *pool, struct scattering_state **state,
                             struct error *err)
{
    return scattering_state_new(&scattering_elliptical_oriented, param, fill, sizeof **state, pool, state, err);
}

static status prepare(const double *param, struct scattering_state **state, struct error *err)
{
    return prepare_shared(param, NULL, state, err);
}

static void release(struct scattering_state *s) { free(s); }

/* A direction, and its azimuth from the long axis, which is w of the fiber frame. */
struct seen {
    struct fiber_direction direction;
    float azimuth_rad;
    int node, row;      /* of the azimuth folded to a quarter turn, and of cos th */
    float y, x, mirror; /* beyond the nodes; -1 where folding has mirrored azimuths */
};

static struct seen seen_of(const float w[3])
{
    struct seen s = {.direction = fiber_direction_of(w)};
    s.azimuth_rad = atan2f(s.direction.azimuth[0], s.direction.azimuth[1]);
    const float folded = remainderf(s.azimuth_rad, (float)M_PI);
    s.mirror = folded < 0 ? -1 : 1;
    s.y = table_position(fabsf(folded) * (float)(ORIENTED_N_TURN / M_PI_2), ORIENTED_N_TURN, &s.node);
    s.x = table_position(s.direction.cos_theta * ELLIPTICAL_N_ROW, ELLIPTICAL_N_ROW, &s.row);
    return s;
}

/* A pair of directions in the tables. */
struct table_index {
    struct seen in, out;
    int row, psi, delta;
    float x, y, z, turn_rad; /* between rows, psi and Delta; ph_o - ph_i within half a turn */
};

static struct table_index index_of(const float wi[3], const float wo[3])
{
    struct table_index g = {.in = seen_of(wi), .out = seen_of(wo)};
    const float c = g.in.direction.cos_theta + g.out.direction.cos_theta, u = wi[0] + wo[0];
    g.turn_rad = remainderf(g.out.azimuth_rad - g.in.azimuth_rad, (float)(2 * M_PI));
    const float psi = fabsf(remainderf(g.in.azimuth_rad + 0.5f * g.turn_rad, (float)M_PI));
    g.x = table_position(0.5f * sqrtf(c * c + u * u) * ELLIPTICAL_N_ROW, ELLIPTICAL_N_ROW, &g.row);
    g.y = table_position(psi * (float)(ORIENTED_N / M_PI_2), ORIENTED_N, &g.psi);
    g.z = table_position(fabsf(g.turn_rad) * (float)(ORIENTED_N / M_PI), ORIENTED_N, &g.delta);
    return g;
}

/* Sum of the eight corners of a table of cells or slopes with their weights, as numbers in a row. */
#define CORNERS(table, type, sum)                                                                                      \
    do {                                                                                                               \
        for (int corner_ = 0; corner_ < 8; corner_++) {                                                                \
            const int a_ = corner_ >> 2, b_ = (corner_ >> 1) & 1, c_ = corner_ & 1;                                    \
            const float w_ = (a_ ? g->x : 1 - g->x) * (b_ ? g->y : 1 - g->y) * (c_ ? g->z : 1 - g->z);                 \
            const float *from_ = (const float *)&s->table[g->row + a_][g->psi + b_][g->delta + c_];                    \
            for (size_t i_ = 0; i_ < sizeof(type) / sizeof(float); i_++) ((float *)(sum))[i_] += w_ * from_[i_];       \
        }                                                                                                              \
    } while (0)

/* M of each lobe along the fiber, F from the table, and the factors that scale them. */
struct terms {
    float m[ELLIPTICAL_N_LOBE], d[ELLIPTICAL_N_LOBE][2];
    struct elliptical_cell f;
    float d_scale[ELLIPTICAL_N_SCALE];
    struct oriented_scale balance;
    float width, width_by_ratio;
};

/* Multiplies out->m by m at one direction, and adds the derivatives of its logarithm. */
static void multiply_balance(const struct scattering_state *s, const struct seen *v, struct oriented_scale *out)
{
    int t;
    const float x =
        table_position(fabsf(v->direction.theta_rad) * (float)(ORIENTED_N_THETA / M_PI_2), ORIENTED_N_THETA, &t);
    struct oriented_scale sum = {0};
    for (int corner = 0; corner < 4; corner++) {
        const int a = corner >> 1, b = corner & 1;
        const float w = (a ? x : 1 - x) * (b ? v->y : 1 - v->y);
        const struct oriented_scale *from = &s->balance[t + a][v->node + b];
        sum.m += w * from->m;
        for (int k = 0; k < ORIENTED_N_M; k++) sum.d_ln[k] += w * from->m * from->d_ln[k];
    }
    out->m *= sum.m;
    for (int k = 0; k < ORIENTED_N_M; k++) out->d_ln[k] += sum.d_ln[k] / sum.m;
}

static void scores(const struct scattering_state *s, const struct table_index *g, const struct terms *t, float *score)
{
    struct elliptical_slope d = {0};
    CORNERS(slope, struct elliptical_slope, &d);
    for (int j = 0; j < 3 * ELLIPTICAL_N_PARAM; j++) score[j] = 0;
    const float *balance = t->balance.d_ln;
    for (int c = 0; c < 3; c++) {
        float *h = score + c * ELLIPTICAL_N_PARAM, sum = 0, by[ELLIPTICAL_N_SLOPE] = {0}, by_alpha = 0, by_beta = 0;
        for (int p = 0; p < ELLIPTICAL_N_LOBE; p++) {
            const float f = t->f.n[p][c];
            sum += t->m[p] * f;
            by_alpha += t->d[p][0] * f * (float)elliptical_shift[p];
            by_beta += t->d[p][1] * f * (float)elliptical_width[p];
            for (int k = 0; k < ELLIPTICAL_N_SLOPE; k++) by[k] += t->m[p] * d.n[p][k][c];
        }
        const float inv = sum > 1e-30f ? 1 / sum : 0;
        h[ELLIPTICAL_P_C_T + c] = by[ELLIPTICAL_D_C_T] * inv;
        h[ELLIPTICAL_P_ETA] = by[ELLIPTICAL_D_ETA] * inv + t->d_scale[ELLIPTICAL_S_ETA] + balance[ORIENTED_M_ETA];
        h[ELLIPTICAL_P_RATIO] = by[ELLIPTICAL_D_RATIO] * inv + t->d_scale[ELLIPTICAL_S_RATIO] +
                                balance[ORIENTED_M_RATIO] - t->width_by_ratio / t->width;
        h[ELLIPTICAL_P_ALPHA] = by_alpha * inv + t->d_scale[ELLIPTICAL_S_ALPHA] + balance[ORIENTED_M_ALPHA];
        h[ELLIPTICAL_P_BETA] = by_beta * inv + t->d_scale[ELLIPTICAL_S_BETA] + balance[ORIENTED_M_BETA];
        h[ELLIPTICAL_P_GAMMA] = by[ELLIPTICAL_D_GAMMA] * inv + balance[ORIENTED_M_GAMMA];
    }
}

/* H of the azimuth. */
static float width_at(const struct scattering_state *s, const struct fiber_direction *d, float *by_ratio)
{
    double slope, h = oriented_width((double)s->ratio, (double)(d->azimuth[1] * d->azimuth[1]), &slope);
    *by_ratio = (float)slope;
    return (float)h;
}

static float width(const struct scattering_state *s, const float w[3], float *score)
{
    const struct fiber_direction d = fiber_direction_of(w);
    float by_ratio;
    const float h = width_at(s, &d, &by_ratio);
    for (int p = 0; score != NULL && p < ELLIPTICAL_N_PARAM; p++) score[p] = p == ELLIPTICAL_P_RATIO ? by_ratio / h : 0;
    return h;
}

static void eval_at(const struct scattering_state *s, const struct table_index *g, struct terms *t, float s_rgb[3],
                    float *score)
{
    const float th_i = g->in.direction.theta_rad, th_o = g->out.direction.theta_rad;
    elliptical_along(s->along, th_i + th_o, t->m, score != NULL ? t->d : NULL);
    for (int k = 0; k < ELLIPTICAL_N_SCALE; k++) t->d_scale[k] = 0;
    t->f = (struct elliptical_cell){0};
    CORNERS(cell, struct elliptical_cell, &t->f);
    t->balance = (struct oriented_scale){.m = 1};
    multiply_balance(s, &g->in, &t->balance);
    multiply_balance(s, &g->out, &t->balance);
    t->width = width_at(s, &g->in.direction, &t->width_by_ratio);
    const float scale = elliptical_scale_at(&s->scale, th_i, t->d_scale) *
                        elliptical_scale_at(&s->scale, th_o, t->d_scale) * t->balance.m / t->width;
    for (int c = 0; c < 3; c++) {
        float sum = 0;
        for (int p = 0; p < ELLIPTICAL_N_LOBE; p++) sum += t->m[p] * t->f.n[p][c];
        s_rgb[c] = scale * sum;
    }
    if (score != NULL) scores(s, g, t, score);
}

/* The four views of the table about wo, and their shares. */
static void views_of(const struct scattering_state *s, const struct seen *o, const struct oriented_view *view[4],
                     float share[4])
{
    for (int k = 0; k < 4; k++) {
        view[k] = &s->view[o->row + (k >> 1)][o->node + (k & 1)];
        share[k] = (k >> 1 ? o->x : 1 - o->x) * (k & 1 ? o->y : 1 - o->y);
    }
}

static void mode_probabilities(const struct oriented_view **view, const float share[4], const float *weight_rgb,
                               float p[ELLIPTICAL_N_LOBE])
{
    float energy[ELLIPTICAL_N_LOBE][3] = {{0}};
    for (int k = 0; k < 4; k++)
        for (int m = 0; m < ELLIPTICAL_N_LOBE; m++)
            for (int c = 0; c < 3; c++) energy[m][c] += share[k] * view[k]->energy[m][c];
    azimuth_mode_probabilities((const float(*)[3])energy, (const float(*)[3])energy, 0, ELLIPTICAL_N_LOBE, weight_rgb,
                               LEAST_PROBABILITY, p);
}

static float density(const struct scattering_state *s, const struct table_index *g, const float *weight_rgb,
                     const float m[ELLIPTICAL_N_LOBE])
{
    const struct oriented_view *view[4];
    float share[4], p[ELLIPTICAL_N_LOBE], sum = 0;
    int column;
    views_of(s, &g->out, view, share);
    mode_probabilities(view, share, weight_rgb, p);
    const float y = table_position((g->out.mirror * g->turn_rad + (float)M_PI) * (float)(ORIENTED_N / M_PI),
                                   ORIENTED_N_AROUND, &column);
    for (int k = 0; k < ELLIPTICAL_N_LOBE; k++) {
        float around = 0;
        for (int v = 0; v < 4; v++)
            around += share[v] * table_mix(view[v]->density[k][column], view[v]->density[k][column + 1], y);
        sum += p[k] * 0.5f * around *
               tilted_lobe_density(&s->along[k], g->in.direction.theta_rad, g->out.direction.theta_rad, m[k]);
    }
    return sum / fmaxf(g->in.direction.cos_theta, FIBER_COS_MIN);
}

static float eval_pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb,
                      float s_rgb[3], float *score)
{
    const struct table_index g = index_of(wi, wo);
    struct terms t;
    eval_at(s, &g, &t, s_rgb, score);
    return density(s, &g, weight_rgb, t.m);
}

static void eval(const struct scattering_state *s, const float wi[3], const float wo[3], float s_rgb[3], float *score)
{
    const struct table_index g = index_of(wi, wo);
    struct terms t;
    eval_at(s, &g, &t, s_rgb, score);
}

static float pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb)
{
    const struct table_index g = index_of(wi, wo);
    float m[ELLIPTICAL_N_LOBE];
    elliptical_along(s->along, g.in.direction.theta_rad + g.out.direction.theta_rad, m, NULL);
    return density(s, &g, weight_rgb, m);
}

static void sample(const struct scattering_state *s, const float wo[3], const float *weight_rgb, const float u[3],
                   float wi[3])
{
    const struct seen out = seen_of(wo);
    const struct oriented_view *view[4];
    float share[4], p[ELLIPTICAL_N_LOBE], rest = u[0], around = u[2];
    int k = 0, v = 0;
    views_of(s, &out, view, share);
    mode_probabilities(view, share, weight_rgb, p);
    while (k < ELLIPTICAL_N_LOBE - 1 && rest >= p[k]) rest -= p[k++];
    while (v < 3 && around >= share[v]) around -= share[v++];
    const float theta = tilted_lobe_sample(&s->along[k], out.direction.theta_rad, u[1]);
    const float turn = 2 * azimuth_draw(view[v]->density[k], view[v]->below[k], ORIENTED_N_AROUND,
                                        table_stretch(around, fmaxf(share[v], 1e-20f))) -
                       (float)M_PI;
    /* ph_i = ph_o - turn from the long axis; azimuths of the frame run the other way */
    fiber_direction_beyond(&out.direction, sinf(theta), fmaxf(cosf(theta), 0), cosf(turn), sinf(out.mirror * turn), wi);
}

/* TRRT has the rest with it. */
static const char *const mode[ELLIPTICAL_N_LOBE + 1] = {"R", "TT", "TRT", "TRRT", NULL};

/* A mode alone is the light of its own rays: a = 1 / cos th, and m^2 is the mean of H, by which F is divided. The
 * scales that balance all modes bend by up to 5 % at azimuths where light passes from TT to the later modes; R does
 * not bend there. */
static void unbalance(struct scattering_state *s)
{
    struct oriented_scale alone = {0};
    double mean = 0, by_ratio = 0;
    for (int i = 0; i < ORIENTED_N_AROUND; i++) {
        const double c = cos(M_PI * i / ORIENTED_N_AROUND);
        double slope;
        mean += oriented_width((double)s->ratio, c * c, &slope) / ORIENTED_N_AROUND;
        by_ratio += slope / ORIENTED_N_AROUND;
    }
    alone.m = (float)sqrt(mean);
    alone.d_ln[ORIENTED_M_RATIO] = (float)(0.5 * by_ratio / mean);
    for (int t = 0; t <= ORIENTED_N_THETA; t++)
        for (int i = 0; i <= ORIENTED_N_TURN; i++) s->balance[t][i] = alone;
    memset(s->scale.d_ln, 0, sizeof s->scale.d_ln);
    for (int i = 0; i < LOBE_BALANCE_N; i++)
        s->scale.a[i] = (float)(1 / fmax(cos(lobe_balance_angle_rad(i)), (double)FIBER_COS_MIN));
}

static void keep_mode(struct scattering_state *s, size_t kept)
{
    const size_t n_cell = sizeof s->cell / sizeof s->cell[0][0][0];
    for (size_t i = 0; i < n_cell; i++)
        for (size_t p = 0; p < ELLIPTICAL_N_LOBE; p++) {
            if (p == kept) continue;
            memset((&s->cell[0][0][0] + i)->n[p], 0, sizeof s->cell[0][0][0].n[p]);
            memset((&s->slope[0][0][0] + i)->n[p], 0, sizeof s->slope[0][0][0].n[p]);
        }
    unbalance(s);
}

const struct scattering_model scattering_elliptical_oriented = {
    SURFACE_MODEL_ROW(elliptical_oriented),
    .flat_section = true,
    .mode = mode,
    .keep_mode = keep_mode,
    .width = width,
    .prepare = prepare,
    .prepare_shared = prepare_shared,
    .release = release,
    .eval = eval,
    .sample = sample,
    .pdf = pdf,
    .eval_pdf = eval_pdf,
};
