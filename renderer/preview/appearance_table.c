#include "renderer/preview/appearance_table.h"

#include "renderer/preview/direction_grid.h"
#include "renderer/preview/table_walks.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    PURPOSE_TABLE = 3,
    PURPOSE_CHECK = 4,
    CHECK_VIEWS = 32,
    CHECK_PATHS = 1024,
    MOST_EDGE = 32,
    MOST_TEXELS = 1 << 20,
    MOST_SMOOTH = 4
};

/* Smoothing the table takes as long as so many of its paths: 2.8 of 10 processor seconds beside 298,000 paths. */
static const double smooth_paths = 1e5;

struct check;
struct table_work {
    struct table_walks walks;
    struct appearance_table *t;
    size_t n_group, n_path; /* groups of TABLE_LIGHTS lights; paths of a view and a group */
    struct check *check;    /* CHECK_VIEWS * TABLE_LIGHTS */
};

static size_t n_cell(const struct appearance_table *t, size_t edge) { return t->n_side * edge * edge; }

size_t appearance_table_n_direction(const struct appearance_table *t, size_t edge) { return n_cell(t, edge); }

void appearance_table_release(struct appearance_table *t)
{
    free(t->weight);
    free(t->value);
    memset(t, 0, sizeof *t);
}

/* A random direction of cell i of a grid. */
static void direction_in(size_t i, size_t edge, struct rng *rng, double d[3])
{
    const double square[2] = {((double)(i % edge) + rng_double(rng)) / (double)edge,
                              ((double)(i / edge % edge) + rng_double(rng)) / (double)edge};
    direction_grid_direction(square, i / (edge * edge), d);
    if (fabs(d[2]) < 1e-3) d[2] = d[2] < 0.0 ? -1e-3 : 1e-3;
}

static double layer(const double wo[3], const double wi[3]) { return fabs(wi[2]) / (fabs(wi[2]) + fabs(wo[2])); }

/* All textures at a place, interpolated as the textures of a graphics card are. */
static void weights_at(const struct appearance_table *t, const double at_mm[2], float *weight)
{
    const size_t n[2] = {t->width, t->height};
    size_t at[2][2];
    float part[2];
    for (int a = 0; a < 2; a++) {
        double x = at_mm[a] / t->tile_mm[a] * (double)n[a] - 0.5, low = floor(x);
        part[a] = (float)(x - low);
        at[a][0] = (size_t)(low < 0.0 ? low + (double)n[a] : low) % n[a];
        at[a][1] = (at[a][0] + 1) % n[a];
    }
    for (size_t k = 0; k < t->n_basis; k++) {
        const float *w = t->weight + k * n[0] * n[1], *low = w + at[1][0] * n[0], *high = w + at[1][1] * n[0];
        float a = low[at[0][0]] + part[0] * (low[at[0][1]] - low[at[0][0]]);
        float b = high[at[0][0]] + part[0] * (high[at[0][1]] - high[at[0][0]]);
        weight[k] = a + part[1] * (b - a);
    }
}

/* One view with the lights group, group + n_group, ...: mean of W_k L over the mean of the factor. */
static void trace_group(const struct table_work *w, size_t i_view, size_t group)
{
    struct appearance_table *t = w->t;
    size_t n_light = n_cell(t, t->light_edge), n = 0;
    size_t light[TABLE_LIGHTS];
    double sum[TABLE_LIGHTS][3 * APPEARANCE_MAX_BASIS] = {{0}}, factor[TABLE_LIGHTS] = {0}, start[2];
    for (size_t i = group; i < n_light && n < TABLE_LIGHTS; i += w->n_group) light[n++] = i;
    struct rng rng;
    uint32_t task = (uint32_t)(i_view * w->n_group + group);
    table_walks_random(&w->walks, PURPOSE_TABLE, task, UINT32_MAX, &rng);
    for (int a = 0; a < 2; a++) start[a] = rng_double(&rng);
    for (size_t i = 0; i < w->n_path && !progress_cancelled(w->walks.progress); i++) {
        double at[2], wo[3], wi[TABLE_LIGHTS][3];
        float rgb[TABLE_LIGHTS][3], weight[APPEARANCE_MAX_BASIS];
        table_walks_random(&w->walks, PURPOSE_TABLE, task, (uint32_t)i, &rng);
        table_walks_place(&w->walks, start, (uint32_t)i, at);
        direction_in(i_view, t->view_edge, &rng, wo);
        for (size_t k = 0; k < n; k++) direction_in(light[k], t->light_edge, &rng, wi[k]);
        table_walks_trace(&w->walks, at, wo, wi, n, &rng, rgb);
        weights_at(t, at, weight);
        for (size_t k = 0; k < n; k++) {
            factor[k] += layer(wo, wi[k]);
            for (size_t j = 0; j < 3 * t->n_basis; j++) sum[k][j] += (double)(weight[j / 3] * rgb[k][j % 3]);
        }
    }
    for (size_t k = 0; k < n; k++) {
        float *value = t->value + (i_view * n_light + light[k]) * 3 * t->n_basis;
        for (size_t j = 0; j < 3 * t->n_basis; j++) value[j] = (float)(sum[k][j] / factor[k]);
    }
}

static void table_task(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    const struct table_work *w = context;
    trace_group(w, i_task / w->n_group, i_task % w->n_group);
}

void appearance_table_mean(const struct appearance_table *t, const double wo[3], const double wi[3], double rgb[3])
{
    size_t view[4], light[4], n_light = n_cell(t, t->light_edge);
    double view_weight[4], light_weight[4];
    direction_grid_cells(wo, t->view_edge, view, view_weight);
    direction_grid_cells(wi, t->light_edge, light, light_weight);
    for (int c = 0; c < 3; c++) rgb[c] = 0.0;
    for (size_t k = 0; k < 16; k++) {
        const float *value = t->value + (view[k / 4] * n_light + light[k % 4]) * 3 * t->n_basis;
        for (int c = 0; c < 3; c++)
            rgb[c] += layer(wo, wi) * view_weight[k / 4] * light_weight[k % 4] * (double)value[c];
    }
}

/* A mean in a random direction under a random light, traced anew. */
struct check {
    double wo[3], wi[3];
    double mean, variance; /* of the three channels' mean */
};

static void check_task(void *context, size_t i_view, size_t i_thread)
{
    (void)i_thread;
    const struct table_work *w = context;
    double wo[3], wi[TABLE_LIGHTS][3], sum[TABLE_LIGHTS] = {0}, square[TABLE_LIGHTS] = {0}, start[2];
    float rgb[TABLE_LIGHTS][3];
    struct rng rng;
    table_walks_random(&w->walks, PURPOSE_CHECK, (uint32_t)i_view, UINT32_MAX, &rng);
    for (int a = 0; a < 2; a++) start[a] = rng_double(&rng);
    direction_in(i_view / 2 % w->t->n_side, 1, &rng, wo);
    for (size_t k = 0; k < TABLE_LIGHTS; k++) direction_in(k % w->t->n_side, 1, &rng, wi[k]);
    for (uint32_t i = 0; i < CHECK_PATHS && !progress_cancelled(w->walks.progress); i++) {
        double at[2];
        table_walks_random(&w->walks, PURPOSE_CHECK, (uint32_t)i_view, i, &rng);
        table_walks_place(&w->walks, start, i, at);
        table_walks_trace(&w->walks, at, wo, wi, TABLE_LIGHTS, &rng, rgb);
        for (size_t k = 0; k < TABLE_LIGHTS; k++) {
            double x = ((double)rgb[k][0] + (double)rgb[k][1] + (double)rgb[k][2]) / 3.0;
            sum[k] += x;
            square[k] += x * x;
        }
    }
    for (size_t k = 0; k < TABLE_LIGHTS; k++) {
        const double n = CHECK_PATHS, mean = sum[k] / n;
        struct check *c = &w->check[i_view * TABLE_LIGHTS + k];
        *c = (struct check){.mean = mean, .variance = (square[k] / n - mean * mean) / (n - 1.0)};
        memcpy(c->wo, wo, sizeof wo);
        memcpy(c->wi, wi[k], sizeof c->wi);
    }
}

/* Which of them: even or odd views, without views that graze the cloth. */
struct check_range {
    size_t parity;
    double least_cos;
};

/* Relative root mean square of the differences of every other view's means from the table, each weighted by the area
 * under which the view sees a piece of cloth; *root_rms: that of the differences of their square roots, which is about
 * what is seen on a screen; *noise: what is expected of
 * them alone. */
static double check_error(const struct table_work *w, const struct check_range *r, double *root_rms, double *noise)
{
    double square = 0.0, variance = 0.0, mean = 0.0, n = 0.0, root_square = 0.0;
    for (size_t i = 0; i < CHECK_VIEWS * TABLE_LIGHTS; i++) {
        const struct check *c = &w->check[i];
        double rgb[3];
        if (i / TABLE_LIGHTS % 2 != r->parity || fmin(fabs(c->wo[2]), fabs(c->wi[2])) < r->least_cos) continue;
        appearance_table_mean(w->t, c->wo, c->wi, rgb);
        double differ = (rgb[0] + rgb[1] + rgb[2]) / 3.0 - c->mean;
        double share = fabs(c->wo[2]);
        double root = sqrt(fmax(differ + c->mean, 0.0)) - sqrt(c->mean);
        root_square += share * root * root;
        square += share * differ * differ;
        variance += share * c->variance;
        mean += share * c->mean;
        n += share;
    }
    *noise = mean > 0.0 ? sqrt(variance * n) / mean : 0.0;
    *root_rms = sqrt(root_square / n);
    return mean > 0.0 ? sqrt(square * n) / mean : 0.0;
}

/* One axis of the table: n cells, `stride` floats apart. */
struct axis {
    size_t n, stride;
};

/* to = (1/4, 1/2, 1/4) of from along the axis; at its ends the cell itself takes the place of the missing one. */
static void smooth_axis(const float *from, float *to, size_t n_value, const struct axis *a)
{
    for (size_t i = 0; i < n_value; i++) {
        size_t k = i / a->stride % a->n;
        float low = k > 0 ? from[i - a->stride] : from[i], high = k + 1 < a->n ? from[i + a->stride] : from[i];
        to[i] = 0.5f * from[i] + 0.25f * (low + high);
    }
}

/* One step of smoothing of a table like t->value along rows and columns of views and lights, by means over neighbouring
 * cells; spare: as large. */
static void smooth_table(const struct appearance_table *t, float *value, float *spare)
{
    const size_t own = 3 * t->n_basis, l = t->light_edge, v = t->view_edge, view = t->n_side * l * l * own,
                 n_value = t->n_side * v * v * view;
    const struct axis axis[4] = {{l, own}, {l, l * own}, {v, view}, {v, v * view}};
    for (int i = 0; i < 4; i += 2) {
        smooth_axis(value, spare, n_value, &axis[i]);
        smooth_axis(spare, value, n_value, &axis[i + 1]);
    }
}

/* Smooths the table while that brings it nearer to one half of the check; the other half tells its error. */
static status smooth_and_check(const struct table_work *w, const struct progress *progress, struct error *err)
{
    struct appearance_table *t = w->t;
    size_t n_byte = n_cell(t, t->view_edge) * n_cell(t, t->light_edge) * 3 * t->n_basis * sizeof *t->value;
    float *best = malloc(n_byte), *spare = malloc(n_byte);
    static const struct check_range choose = {0, 0.0}, upright = {1, APPEARANCE_UPRIGHT}, all = {1, 0.0};
    double noise, error, least;
    check_error(w, &choose, &least, &noise);
    status s = best != NULL && spare != NULL ? STATUS_OK
                                             : error_set(err, STATUS_NO_MEMORY, "cannot make tables: out of memory");
    t->n_smooth = 0;
    for (size_t i = 1; i <= MOST_SMOOTH && s == STATUS_OK; i++) {
        progress_report(progress, (double)i / (MOST_SMOOTH + 1.0));
        memcpy(best, t->value, n_byte);
        smooth_table(t, t->value, spare);
        check_error(w, &choose, &error, &noise);
        if (error >= least) {
            memcpy(t->value, best, n_byte);
            break;
        }
        least = error;
        t->n_smooth = i;
    }
    t->mean_rel_rms = check_error(w, &upright, &error, &t->mean_rel_noise);
    t->all_rel_rms = check_error(w, &all, &error, &t->all_rel_noise);
    free(best);
    free(spare);
    return s;
}

static status set_sizes(const struct table_walks *walks, const struct appearance_table_option *o,
                        struct appearance_table *t, struct error *err)
{
    if (o->texels == 0 || o->texels > MOST_TEXELS || o->view_edge == 0 || o->view_edge > MOST_EDGE ||
        o->light_edge == 0 || o->light_edge > MOST_EDGE || o->n_basis == 0 || o->n_basis > APPEARANCE_MAX_BASIS)
        return error_set(err, STATUS_INVALID, "cannot make tables with %zu texels, %zu views, %zu lights, %zu textures",
                         o->texels, o->view_edge, o->light_edge, o->n_basis);
    double per_mm = sqrt((double)o->texels / (walks->tile_mm[0] * walks->tile_mm[1]));
    t->width = (size_t)fmax(1.0, round(per_mm * walks->tile_mm[0]));
    t->height = (size_t)fmax(1.0, round(per_mm * walks->tile_mm[1]));
    t->n_basis = o->n_basis;
    t->view_edge = o->view_edge;
    t->light_edge = o->light_edge;
    t->n_side = walks->n_side;
    memcpy(t->tile_mm, walks->tile_mm, sizeof t->tile_mm);
    t->weight = calloc(t->n_basis * t->width * t->height, sizeof *t->weight);
    t->value = calloc(n_cell(t, t->view_edge) * n_cell(t, t->light_edge) * 3 * t->n_basis, sizeof *t->value);
    if (t->weight != NULL && t->value != NULL) return STATUS_OK;
    return error_set(err, STATUS_NO_MEMORY, "cannot make tables: out of memory");
}

double appearance_table_fixed_paths(size_t n_texel)
{
    return (double)APPEARANCE_BASIS_VIEWS * (double)n_texel + (double)CHECK_VIEWS * (double)CHECK_PATHS + smooth_paths;
}

static status fill(struct table_work *w, const struct appearance_table_option *o, struct thread_pool *pool,
                   const struct progress *progress, struct error *err)
{
    struct appearance_table *t = w->t;
    struct progress_part part;
    size_t n_light = n_cell(t, t->light_edge), n_view = n_cell(t, t->view_edge);
    w->n_group = (n_light + TABLE_LIGHTS - 1) / TABLE_LIGHTS;
    w->n_path = (size_t)(o->n_path / (n_view * w->n_group));
    if (w->n_path == 0) w->n_path = 1;
    const double n_texel = (double)(t->width * t->height), basis = (double)APPEARANCE_BASIS_VIEWS * n_texel,
                 all = (double)o->n_path + appearance_table_fixed_paths(t->width * t->height),
                 check = (double)CHECK_VIEWS * (double)CHECK_PATHS;
    struct progress inner = progress_begin_part(&part, progress, 0.0, basis / all);
    status s = appearance_basis_make(&w->walks, pool, &inner, t, err);
    if (s != STATUS_OK) return s;
    part.from = basis / all;
    part.share = (double)o->n_path / all;
    s = thread_pool_run(pool, n_view * w->n_group, table_task, w, &inner);
    part.from += part.share;
    part.share = check / all;
    if (s == STATUS_OK) s = thread_pool_run(pool, CHECK_VIEWS, check_task, w, &inner);
    part.from += part.share;
    part.share = 1.0 - part.from;
    if (s != STATUS_OK || progress_cancelled(progress))
        return error_set(err, STATUS_CANCELLED, "making tables was cancelled");
    return smooth_and_check(w, &inner, err);
}

status appearance_table_make(const struct radiance_input *in, const struct appearance_table_option *o,
                             struct thread_pool *pool, const struct progress *progress, struct appearance_table *t,
                             struct error *err)
{
    struct table_work w = {.t = t};
    struct check check[CHECK_VIEWS * TABLE_LIGHTS];
    memset(t, 0, sizeof *t);
    w.check = check;
    status s = table_walks_init(&w.walks, in, o->seed, err);
    w.walks.progress = progress;
    if (s == STATUS_OK) s = set_sizes(&w.walks, o, t, err);
    if (s == STATUS_OK) s = fill(&w, o, pool, progress, err);
    table_walks_release(&w.walks);
    if (s != STATUS_OK) appearance_table_release(t);
    return s;
}
