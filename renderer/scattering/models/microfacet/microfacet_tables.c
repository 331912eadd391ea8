#include "renderer/scattering/azimuth_table.h"
#include "renderer/scattering/models/microfacet/microfacet.h"
#include "renderer/scattering/quadratic_spline.h"
#include "renderer/scattering/von_mises.h"

#include <stdlib.h>
#include <string.h>

enum { N_CIRCLE = 2 * MICROFACET_N_PHI, N_NODE = MICROFACET_N_PHI + 1, N_CORNER = 1 + MICROFACET_N_BY };
/* Sums over the paths that leave at a place: light of each channel, its derivative by C_T, light without absorption,
 * and this light times x^2 and times x and the slopes. The last two become width and shift of the lobe. */
enum { LIGHT = 0, BY_C_T = 3, CLEAR = 6, SQUARE, LEANING, N_SUM, WIDTH = SQUARE, SHIFT = LEANING };

static const double blur_over_roughness[MICROFACET_N_INNER] = {0.25, 0.5};
#define LEAST_COSINE 1e-3  /* of th_d: at 0 all light is reflected */
#define MEAN_OF_PLACE 3e-3 /* of the mean density of a lobe: light of its mean width that every place has in addition */
#define REST_WIDTH (4 / 3.0) /* squared width of the rest over squared width of TRT: it meets one facet more */
#define REACH 4.5            /* of the blur, in standard deviations */

/* The fiber of a corner of the simplex about the parameters. */
struct corner {
    struct microfacet_fiber fiber;
    double circle[MICROFACET_N_INNER][N_CIRCLE][N_SUM], column[MICROFACET_N_INNER][N_SUM][N_NODE];
    double rest[3], rest_by_c_t[3], clear_rest, rest_width, widths; /* sum of the widths of all draws */
};

struct work {
    double ln_c_t[3], c_t[3], tilt, roughness;
    double share[N_CORNER];       /* of the corners, sum 1 */
    int rank[MICROFACET_N_BY];    /* corner from which the next differs in this parameter */
    double rate[MICROFACET_N_BY]; /* steps of the grid for one unit of a parameter */
    struct microfacet_draw draw[MICROFACET_N_DRAW];
    struct corner corner[N_CORNER];
};

/* A lattice over azimuths of the light, places across the width and slopes. */
static void draw_all(struct microfacet_draw *draw)
{
    for (long i = 0; i < MICROFACET_N_DRAW; i++) {
        double u[2 + 2 * MICROFACET_N_MEETING];
        long z = i;
        for (size_t k = 0; k < sizeof u / sizeof *u; k++) {
            u[k] = ((double)z + 0.5) / MICROFACET_N_DRAW;
            z = z * MICROFACET_DRAW_STEP % MICROFACET_N_DRAW;
        }
        draw[i].phi = M_PI * u[0];
        draw[i].offset = 2 * u[1] - 1;
        for (int k = 0; k < 2 * MICROFACET_N_MEETING; k++)
            draw[i].slope[k / 2][k % 2] = M_SQRT2 * (double)erf_inverse((float)(2 * u[2 + k] - 1));
    }
}

/* Light of one exit, shared by the three nodes about its azimuth with the weights of a quadratic spline. */
static void add_exit(const struct work *w, double (*circle)[N_SUM], const struct microfacet_exit *e, double width)
{
    double sum[N_SUM], weight[3];
    const int at = quadratic_spline(e->azimuth * (N_CIRCLE / (2 * M_PI)), weight, NULL) + 2 * N_CIRCLE - 1;
    sum[CLEAR] = width * e->share;
    sum[SQUARE] = sum[CLEAR] * e->off * e->off;
    sum[LEANING] = sum[CLEAR] * e->off * e->lean;
    for (int c = 0; c < 3; c++) {
        sum[LIGHT + c] = sum[CLEAR] * exp(0.5 * e->length * w->ln_c_t[c]);
        sum[BY_C_T + c] = sum[LIGHT + c] * 0.5 * e->length / w->c_t[c];
    }
    for (int k = 0; k < 3; k++)
        for (int q = 0; q < N_SUM; q++) circle[(at + k) % N_CIRCLE][q] += weight[k] * sum[q];
}

static void trace(const struct work *w, struct corner *v, double theta)
{
    memset(v->circle, 0, sizeof v->circle);
    v->widths = v->clear_rest = 0;
    for (int c = 0; c < 3; c++) v->rest[c] = v->rest_by_c_t[c] = 0;
    for (int i = 0; i < MICROFACET_N_DRAW; i++) {
        struct microfacet_path path;
        microfacet_walk(&v->fiber, theta, &w->draw[i], &path);
        v->widths += path.width;
        for (int p = 0; p < MICROFACET_N_INNER; p++)
            if (path.exit[p].share > 0) add_exit(w, v->circle[p], &path.exit[p], path.width);
        if (!(path.rest > 0)) continue;
        const double rest = path.width * path.rest;
        v->clear_rest += rest;
        for (int c = 0; c < 3; c++) {
            const double left = rest * exp(0.5 * path.rest_length * w->ln_c_t[c]);
            v->rest[c] += left;
            v->rest_by_c_t[c] += left * 0.5 * path.rest_length / w->c_t[c];
        }
    }
    const double scale = 0.5 / (M_PI * v->widths);
    v->clear_rest *= scale;
    for (int c = 0; c < 3; c++) {
        v->rest[c] *= scale;
        v->rest_by_c_t[c] *= scale;
    }
}

/* Both sides of the circle together, as densities, blurred. Even about the first and the last node. */
static void blur(const struct corner *v, int p, int q, double *column)
{
    const double width = blur_over_roughness[p] * v->fiber.roughness * (MICROFACET_N_PHI / M_PI);
    const double scale = 0.5 * N_CIRCLE / (2 * M_PI * v->widths);
    const int reach = (int)(REACH * width) + 1;
    double fold[N_NODE], sum = 0;
    for (int j = 0; j < N_NODE; j++)
        fold[j] = scale * (v->circle[p][j][q] + v->circle[p][(N_CIRCLE - j) % N_CIRCLE][q]);
    memset(column, 0, N_NODE * sizeof *column);
    for (int k = -reach; k <= reach; k++) {
        const double weight = exp(-0.5 * pow(k / width, 2));
        sum += weight;
        for (int j = 0; j < N_NODE; j++) {
            const int at = abs(j + k);
            column[j] += weight * fold[at > MICROFACET_N_PHI ? N_CIRCLE - at : at];
        }
    }
    for (int j = 0; j < N_NODE; j++) column[j] /= sum;
}

static void finish(struct corner *v, double tilt)
{
    for (int p = 0; p < MICROFACET_N_INNER; p++) {
        double light = 0, square = 0;
        for (int q = 0; q < N_SUM; q++) blur(v, p, q, v->column[p][q]);
        for (int j = 0; j < N_NODE; j++) {
            light += v->column[p][CLEAR][j];
            square += v->column[p][SQUARE][j];
        }
        const double mean = square / light, extra = MEAN_OF_PLACE * light / N_NODE;
        for (int j = 0; j < N_NODE; j++) {
            const double all = v->column[p][CLEAR][j] + extra;
            v->column[p][SHIFT][j] = tilt * M_SQRT2 / v->fiber.roughness * v->column[p][LEANING][j] / all;
            v->column[p][WIDTH][j] = sqrt((v->column[p][SQUARE][j] + extra * mean) / all);
        }
        if (p == MICROFACET_TRT) v->rest_width = sqrt(REST_WIDTH * mean);
    }
}

/* A quantity of all corners at the parameters, and its derivative by one of them. */
static double mixed(const struct work *w, const double at[N_CORNER])
{
    double sum = 0;
    for (int v = 0; v < N_CORNER; v++) sum += w->share[v] * at[v];
    return sum;
}

static double slope_of(const struct work *w, int by, const double at[N_CORNER])
{
    return (at[w->rank[by] + 1] - at[w->rank[by]]) * w->rate[by];
}

static void store_inner(struct scattering_state *s, const struct work *w, int row, struct microfacet_clear *clear)
{
    for (int p = 0; p < MICROFACET_N_INNER; p++)
        for (int j = 0; j < N_NODE; j++) {
            struct microfacet_cell *cell = &s->cell[row][j];
            struct microfacet_slope *slope = &s->slope[row][j];
            double at[N_SUM][N_CORNER];
            for (int q = 0; q < N_SUM; q++)
                for (int v = 0; v < N_CORNER; v++) at[q][v] = w->corner[v].column[p][q][j];
            clear->n[p][j] = mixed(w, at[CLEAR]);
            cell->shift[p] = (float)mixed(w, at[SHIFT]);
            cell->width[p] = (float)mixed(w, at[WIDTH]);
            slope->shift[p][MICROFACET_BY_TAU] = (float)(mixed(w, at[SHIFT]) / w->tilt) * s->surface.d_tilt;
            for (int c = 0; c < 3; c++) {
                cell->n[p][c] = (float)mixed(w, at[LIGHT + c]);
                slope->by_c_t[p][c] = (float)mixed(w, at[BY_C_T + c]);
            }
            for (int k = 0; k < MICROFACET_N_BY; k++) {
                clear->d[k][p][j] = slope_of(w, k, at[CLEAR]);
                slope->shift[p][k] = (float)slope_of(w, k, at[SHIFT]);
                slope->width[p][k] = (float)slope_of(w, k, at[WIDTH]);
                for (int c = 0; c < 3; c++) slope->n[p][k][c] = (float)slope_of(w, k, at[LIGHT + c]);
            }
        }
}

static void store_rest(struct microfacet_row *to, const struct work *w, struct microfacet_clear *clear)
{
    double rest[N_CORNER], width[N_CORNER];
    for (int v = 0; v < N_CORNER; v++) {
        rest[v] = w->corner[v].clear_rest;
        width[v] = w->corner[v].rest_width;
    }
    clear->rest = mixed(w, rest);
    to->width = (float)mixed(w, width);
    for (int k = 0; k < MICROFACET_N_BY; k++) {
        clear->d_rest[k] = slope_of(w, k, rest);
        to->d_width[k] = (float)slope_of(w, k, width);
    }
    for (int c = 0; c < 3; c++) {
        double by_c_t[N_CORNER];
        for (int v = 0; v < N_CORNER; v++) {
            rest[v] = w->corner[v].rest[c];
            by_c_t[v] = w->corner[v].rest_by_c_t[c];
        }
        to->rest[c] = (float)mixed(w, rest);
        to->by_c_t[c] = (float)mixed(w, by_c_t);
        for (int k = 0; k < MICROFACET_N_BY; k++) to->d_rest[k][c] = (float)slope_of(w, k, rest);
    }
}

/* A lobe of samples around the fiber. */
static void store_density(struct microfacet_row *to, int lobe, const double light[N_NODE])
{
    azimuth_density(light, MICROFACET_N_PHI, to->density[lobe], to->below[lobe]);
}

/* The visible share of the facets, and the rows that samples need. */
static void store_samples(struct scattering_state *s, const struct work *w, int row, double cosine)
{
    struct microfacet_row *to = &s->row[row];
    const double r = w->roughness, h = MICROFACET_DIFFERENCE * r;
    double light[N_NODE], sum = 0;
    for (int i = 0; i <= MICROFACET_N_SEEN; i++) {
        const double cos_alpha = 2.0 * i / MICROFACET_N_SEEN - 1, seen = microfacet_seen(cosine, cos_alpha, r);
        to->seen[i] = (float)seen;
        to->d_seen[i] = (float)((microfacet_seen(cosine, cos_alpha, r + h) - seen) / h);
    }
    for (int j = 0; j < N_NODE; j++) {
        const double phi = j * M_PI / MICROFACET_N_PHI, c = cos(0.5 * phi);
        const double seen = fmax(2 * microfacet_seen(cosine, c, r) - 1, 0);
        microfacet_reflected_lobe(&s->surface, cosine, phi, &to->shift_r[j], &to->width_r[j]);
        light[j] = seen * 0.25 * c * fresnel_unpolarised(cosine * c, (double)s->surface.eta, NULL);
        sum += light[j] * 2 * M_PI / MICROFACET_N_PHI;
    }
    store_density(to, MICROFACET_R, light);
    for (int c = 0; c < 3; c++) {
        to->energy[MICROFACET_R][c] = (float)sum;
        to->energy[MICROFACET_REST][c] = (float)(2 * M_PI) * to->rest[c];
    }
    for (int p = 0; p < MICROFACET_N_INNER; p++) {
        double energy[3] = {0, 0, 0};
        for (int j = 0; j < N_NODE; j++) {
            light[j] = 0;
            for (int c = 0; c < 3; c++) {
                const double n = (double)s->cell[row][j].n[p][c];
                light[j] += n / 3;
                energy[c] += n * 2 * M_PI / MICROFACET_N_PHI;
            }
        }
        for (int c = 0; c < 3; c++) to->energy[MICROFACET_INNER + p][c] = (float)energy[c];
        store_density(to, MICROFACET_INNER + p, light);
    }
}

/* Nodes of a parameter: lower * exp(step (i - before)). No bound is a node, and the places of the bounds and of the
 * start between nodes differ from parameter to parameter, so that none of them lies on a face of a simplex. */
static const struct grid {
    int param;
    double step, before;
} grid[MICROFACET_N_BY] = {
    {MICROFACET_P_ETA, 0.028, 0.2}, {MICROFACET_P_RATIO, 0.083, 0.6}, {MICROFACET_P_ROUGHNESS, 0.148, 0.1}};

/* The simplex of a cell (Kuhn's): from its first corner along the parameters in the order of their places in the
 * cell. */
static void set_corners(struct work *w, const double *param)
{
    int order[MICROFACET_N_BY] = {0, 1, 2};
    double node[MICROFACET_N_BY], place[MICROFACET_N_BY], at[MICROFACET_N_BY];
    for (int k = 0; k < MICROFACET_N_BY; k++) {
        const double lower = surface_microfacet_ellipse_param[grid[k].param].lower, x = param[grid[k].param];
        const double y = log(x / lower) / grid[k].step + grid[k].before;
        node[k] = floor(y);
        place[k] = y - node[k];
        w->rate[k] = 1 / (x * grid[k].step);
    }
    for (int i = 0; i < MICROFACET_N_BY; i++)
        for (int j = i + 1; j < MICROFACET_N_BY; j++)
            if (place[order[j]] > place[order[i]]) {
                const int swap = order[i];
                order[i] = order[j];
                order[j] = swap;
            }
    for (int v = 0; v < N_CORNER; v++) {
        if (v > 0) {
            w->rank[order[v - 1]] = v - 1;
            node[order[v - 1]] += 1;
        }
        w->share[v] = (v > 0 ? place[order[v - 1]] : 1) - (v < MICROFACET_N_BY ? place[order[v]] : 0);
        for (int k = 0; k < MICROFACET_N_BY; k++)
            at[k] =
                surface_microfacet_ellipse_param[grid[k].param].lower * exp(grid[k].step * (node[k] - grid[k].before));
        w->corner[v].fiber =
            microfacet_fiber_of(at[MICROFACET_BY_ETA], at[MICROFACET_BY_RATIO], at[MICROFACET_BY_ROUGHNESS]);
    }
}

status microfacet_tables(struct scattering_state *s, const double *param,
                         struct microfacet_clear clear[MICROFACET_N_ROW + 1], struct error *err)
{
    struct work *w = malloc(sizeof *w);
    if (w == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    set_corners(w, param);
    for (int c = 0; c < 3; c++) {
        w->c_t[c] = param[MICROFACET_P_C_T + c];
        w->ln_c_t[c] = log(w->c_t[c]);
    }
    w->tilt = tan(param[MICROFACET_P_TAU]);
    w->roughness = param[MICROFACET_P_ROUGHNESS];
    draw_all(w->draw);
    for (int row = 0; row <= MICROFACET_N_ROW; row++) {
        const double cosine = fmax((double)row / MICROFACET_N_ROW, LEAST_COSINE);
        for (int v = 0; v < N_CORNER; v++) {
            trace(w, &w->corner[v], acos(cosine));
            finish(&w->corner[v], w->tilt);
        }
        store_inner(s, w, row, &clear[row]);
        store_rest(&s->row[row], w, &clear[row]);
        store_samples(s, w, row, cosine);
    }
    free(w);
    return STATUS_OK;
}
