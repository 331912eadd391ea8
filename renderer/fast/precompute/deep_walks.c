/* The table of light that is scattered more than n_traced times (deep_light.h).
 *
 * Paths that come from random directions and meet the cloth at random places are traced until they leave it; those
 * that met more than n_traced fibers count for the direction in which they leave, which is the light's. So a path needs
 * no connection to a light, and narrow lobes cost nothing. Over the two disks of directions across the cloth (x, y of
 * the unit vectors), the density of pairs (from, to) is the value over pi times the density of views.
 *
 * The value is the function between the nodes that is nearest to what the paths show in the mean of squares over both
 * disks and over the tilts that are hit: with B the weights of nodes, M the matrix of the means of B_m B_n (of views
 * and tilts over the hits, of lights over the disk), and b those of the paths, M_o v M_i = b. It is approached from b
 * divided by the sums of rows of M, in N_STEP steps of the residual divided in the same way; more of them follow the
 * noise. Each keeps the sum over all pairs, and so the energy.
 *
 * Each class of fibers has as many paths, whose places are drawn until a fiber of the class is met; where that takes
 * more than CLASS_TRIES hits, any fiber counts, which fills the tables of classes that a cloth does not have. A tilt
 * that is never met in a view has the mean over those that are.
 *
 * Beside them stand the means of the ways from the first hit to the last one, in the plane of the cloth, weighted by
 * throughput: of each view and of each light, less the mean over all of them.
 *
 * And beside them the shares of diffuse light that leave on the side of the view and on the other one, by all paths,
 * which count by the cosine of the view.
 *
 * Each row of the part is the sum over some of the paths, which follow from its number: results do not depend on the
 * number of threads. Even and odd rows are the halves by which deep_rank.h takes noise off, and tells the error. */
#include "renderer/fast/precompute/deep_rank.h"
#include "renderer/fast/precompute/precompute_parts.h"
#include "renderer/transport/surface/fiber_walk.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N_ROW = 32, CLASS_TRIES = 32, N_STEP = 2, N_FINE = 1024, MOST_MISS = 1000, N_NEAR = 27 };
static const struct rng_key walk_key = {.seed = 0x646565706c696768u};

/* A view of a table is a kind of fiber and a node of directions: kind * n_node + node. */
struct deep_job {
    struct precompute_job *j;
    struct deep_light *d;
    size_t n_path, n_node, n_view; /* paths of a row; nodes of a grid; views */
    size_t n_value, n_seen, n_sum; /* numbers of the tables; of seen; of a row: both, then n_way and N_SHARE */
    float *sum;                    /* N_ROW x n_sum */
    double *overlap;               /* n_node x n_node: the matrix M of lights, integrals of weights over the disk */
    double *area;                  /* n_node: sums of its rows */
    double *seen;                  /* n_view x N_NEAR: the matrix M of views, with the views beside (near_to) */
    double *seen_area;             /* n_view: sums of its rows */
};

/* View `near` around a view: its tilt, row and column are at most 1 apart. False: there is none. */
static bool near_to(const struct deep_job *x, size_t i_view, size_t near, size_t *other)
{
    const size_t edge = x->d->edge, node = i_view % x->n_node, kind = i_view / x->n_node;
    const size_t at[3] = {node % edge, node / edge % edge, kind % DEEP_LIGHT_N_TILT};
    const size_t n[3] = {edge, edge, DEEP_LIGHT_N_TILT}, step[3] = {1, edge, x->n_node};
    *other = i_view;
    for (size_t a = 0, rest = near; a < 3; a++, rest /= 3) {
        if (at[a] + rest % 3 < 1 || at[a] + rest % 3 > n[a]) return false;
        *other += rest % 3 * step[a] - step[a];
    }
    return true;
}

/* The number of a view among those around another one. */
static size_t near_of(const struct deep_job *x, size_t i_view, size_t other)
{
    const size_t edge = x->d->edge, node[2] = {i_view % x->n_node, other % x->n_node};
    return (1 + node[1] % edge - node[0] % edge) + 3 * (1 + node[1] / edge - node[0] / edge) +
           9 * (1 + other / x->n_node - i_view / x->n_node);
}

static void fill_overlap(const struct deep_job *x)
{
    for (size_t i = 0; i < (size_t)x->d->n_side * N_FINE * N_FINE; i++) {
        size_t node[4];
        double weight[4], v[3] = {((double)(i % N_FINE) + 0.5) * 2.0 / N_FINE - 1.0,
                                  ((double)(i / N_FINE % N_FINE) + 0.5) * 2.0 / N_FINE - 1.0, 0.0};
        double z2 = 1.0 - v[0] * v[0] - v[1] * v[1], part = 4.0 / ((double)N_FINE * N_FINE);
        if (z2 <= 0.0) continue;
        v[2] = i < N_FINE * N_FINE ? sqrt(z2) : -sqrt(z2);
        deep_light_nodes(x->d, v, node, weight);
        for (size_t k = 0; k < 16; k++)
            x->overlap[node[k / 4] * x->n_node + node[k % 4]] += part * weight[k / 4] * weight[k % 4];
        for (size_t k = 0; k < 4; k++) x->area[node[k]] += part * weight[k];
    }
}

/* A place, from a point of the tile's plane z = 0, where rays towards -wo meet a fiber of a class. False: none was
 * found. */
static bool meet(const struct deep_job *x, size_t i_class, const double wo[3], struct rng *rng, struct scene_ray *ray,
                 struct scene_hit *hit)
{
    const struct precompute_job *j = x->j;
    double away = (wo[2] > 0.0 ? 1.0 : 1.0 + scene_thickness_mm(j->q->scene)) / fabs(wo[2]);
    for (int i = 0, n_other = 0; i < MOST_MISS; i++) {
        double origin[3], towards[3];
        for (int a = 0; a < 3; a++) {
            origin[a] = (a < 2 ? rng_double(rng) * j->t->tile_mm[a] : 0.0) + away * wo[a];
            towards[a] = -wo[a];
        }
        if (!scene_ray_enter(j->q->scene, origin, towards, ray) || !scene_trace(j->q->scene, ray, hit)) continue;
        if (deep_light_class(hit->tangent) == i_class || ++n_other > CLASS_TRIES) return true;
    }
    return false;
}

/* Where a path begins: the views around it, and its weight. */
struct start {
    const double *wo;
    size_t view[8], node[4];
    double view_weight[8], weight[4], scale;
};

/* Describes the start of a path at its hit and counts it as seen. sum: of the row. */
static void begin(const struct deep_job *x, size_t i_class, const double wo[3], const struct scene_hit *hit,
                  struct start *b, float *sum)
{
    size_t kind[2];
    double kind_weight[2];
    deep_light_kinds(hit->tangent, kind, kind_weight);
    deep_light_nodes(x->d, wo, b->node, b->weight);
    b->wo = wo;
    /* views are even over solid angles: 1 over their density on the disk is 2 pi cos for each side */
    b->scale = DEEP_LIGHT_N_CLASS * 2.0 * M_PI * fabs(wo[2]) * x->d->n_side / ((double)x->n_path * N_ROW);
    for (size_t k = 0; k < 8; k++) {
        size_t own = i_class * DEEP_LIGHT_N_TILT + kind[k / 4] % DEEP_LIGHT_N_TILT;
        b->view[k] = own * x->n_node + b->node[k % 4];
        b->view_weight[k] = kind_weight[k / 4] * b->weight[k % 4];
    }
    for (size_t k = 0; k < 64; k++)
        sum[x->n_value + b->view[k / 8] * N_NEAR + near_of(x, b->view[k / 8], b->view[k % 8])] +=
            (float)(b->scale * b->view_weight[k / 8] * b->view_weight[k % 8]);
}

/* Numbers about ways: weight, x and y of each view, the same of each light, and the sum of squares. */
static size_t n_way(const struct deep_job *x) { return 6 * x->n_node + 1; }

/* Numbers about shares: the sum of cosines, light sent back and light let through. */
enum { N_SHARE = 7 };

static size_t first_share(const struct deep_job *x) { return x->n_value + x->n_seen + n_way(x); }

/* Adds the way of a path, whose weight has the two factors. sum: where the numbers of a view or a light begin. */
static void count_way(const double way_mm[2], double scale, const size_t node[4], const double weight[4], float *sum)
{
    for (size_t k = 0; k < 4; k++) {
        float *to = sum + 3 * node[k], w = (float)(scale * weight[k]);
        to[0] += w;
        for (int a = 0; a < 2; a++) to[1 + a] += w * (float)way_mm[a];
    }
}

/* way_mm: from the first hit to the last one. sum: of the row. */
static void count(const struct deep_job *x, const struct start *b, const struct scene_ray *ray,
                  const float throughput[3], const double way_mm[2], float *sum)
{
    size_t light[4];
    double light_weight[4], scale = M_PI * b->scale;
    const double wi[3] = {(double)ray->direction[0], (double)ray->direction[1], (double)ray->direction[2]};
    if (x->d->n_side == 1 && wi[2] <= 0.0) return;
    deep_light_nodes(x->d, wi, light, light_weight);
    float *way = sum + x->n_value + x->n_seen;
    double brightness = scale * ((double)throughput[0] + (double)throughput[1] + (double)throughput[2]);
    count_way(way_mm, brightness, b->node, b->weight, way);
    count_way(way_mm, brightness, light, light_weight, way + 3 * x->n_node);
    way[6 * x->n_node] += (float)(brightness * (way_mm[0] * way_mm[0] + way_mm[1] * way_mm[1]));
    for (size_t k = 0; k < 32; k++) {
        float *to = sum + (b->view[k / 4] * x->n_node + light[k % 4]) * 3;
        for (int c = 0; c < 3; c++)
            to[c] += (float)(scale * b->view_weight[k / 4] * light_weight[k % 4]) * throughput[c];
    }
}

static void count_share(const double wo[3], const struct scene_ray *ray, const float throughput[3], float *share)
{
    const bool back = wo[2] * (double)ray->direction[2] > 0.0;
    for (int c = 0; c < 3; c++) share[(back ? 1 : 4) + c] += (float)fabs(wo[2]) * throughput[c];
}

/* Sets place_mm to the position of a hit in the endless cloth. */
static void endless_position(const struct scene_hit *hit, const struct scene_ray *ray, double place_mm[2])
{
    for (int a = 0; a < 2; a++) place_mm[a] = (double)hit->position_mm[a] + ray->offset_mm[a];
}

static void walk(const struct deep_job *x, size_t i_class, const double wo[3], struct rng *rng, float *sum)
{
    const struct precompute_job *j = x->j;
    float throughput[3] = {1, 1, 1};
    struct scene_ray ray;
    struct scene_hit hit;
    if (!meet(x, i_class, wo, rng, &ray, &hit)) return;
    double first_mm[2], last_mm[2];
    struct start from;
    begin(x, i_class, wo, &hit, &from, sum);
    sum[first_share(x)] += (float)fabs(wo[2]);
    endless_position(&hit, &ray, first_mm);
    for (uint32_t i = 1; i < (uint32_t)FIBER_WALK_MOST_STEPS; i++) {
        endless_position(&hit, &ray, last_mm);
        if (!fiber_walk_step(j->q->scene, &j->sets, &hit, &ray, rng, throughput)) return;
        if (scene_trace(j->q->scene, &ray, &hit)) continue;
        if (!scene_sheet_met(j->q->scene, &ray)) count_share(wo, &ray, throughput, sum + first_share(x));
        if (i > x->d->n_traced && !scene_sheet_met(j->q->scene, &ray)) {
            const double way_mm[2] = {last_mm[0] - first_mm[0], last_mm[1] - first_mm[1]};
            count(x, &from, &ray, throughput, way_mm, sum);
        }
        return;
    }
}

static void run_row(void *context, size_t i_row, size_t i_thread)
{
    const struct deep_job *x = context;
    double start[2];
    struct rng rng;
    (void)i_thread;
    rng_start(&rng, &walk_key, (uint32_t)i_row, UINT32_MAX);
    for (int k = 0; k < 2; k++) start[k] = rng_double(&rng);
    for (size_t i = 0; i < x->n_path; i++) {
        if (i % 64 == 0 && progress_cancelled(x->j->progress)) break;
        rng_start(&rng, &walk_key, (uint32_t)i_row, (uint32_t)i);
        /* Roberts' sequence in two dimensions */
        double u = start[0] + (double)(i + 1) * 0.7548776662466927, v = start[1] + (double)(i + 1) * 0.5698402909980532;
        double z = fmax(u - floor(u), 1e-3), phi = 2.0 * M_PI * v, across = sqrt(1.0 - z * z);
        const double wo[3] = {across * cos(phi), across * sin(phi), x->d->n_side > 1 && i % 2 == 1 ? -z : z};
        walk(x, i / 2 % DEEP_LIGHT_N_CLASS, wo, &rng, x->sum + i_row * x->n_sum);
    }
}

/* out = M v M, all n_value. spare: as large. */
static void apply_overlap(const struct deep_job *x, const double *v, double *spare, double *out)
{
    const size_t n = x->n_node, n_column = 3 * n;
    memset(spare, 0, x->n_value * sizeof *spare);
    memset(out, 0, x->n_value * sizeof *out);
    for (size_t m = 0, other; m < x->n_view; m++)
        for (size_t near = 0; near < N_NEAR; near++) {
            double overlap = x->seen[m * N_NEAR + near];
            if (!(overlap > 0.0) || !near_to(x, m, near, &other)) continue;
            for (size_t i = 0; i < n_column; i++) spare[m * n_column + i] += overlap * v[other * n_column + i];
        }
    for (size_t m = 0; m < n; m++)
        for (size_t k = 0; k < n; k++) {
            double overlap = x->overlap[m * n + k];
            for (size_t r = 0; r < x->n_view && overlap > 0.0; r++)
                for (size_t c = 0; c < 3; c++) out[3 * (r * n + m) + c] += overlap * spare[3 * (r * n + k) + c];
        }
}

/* Area of views and lights that belongs to a number of the tables. */
static double area_of(const struct deep_job *x, size_t i)
{
    return x->seen_area[i / 3 / x->n_node] * x->area[i / 3 % x->n_node];
}

/* Values from b over the areas, which they replace. work: 3 n_value. */
static void solve(const struct deep_job *x, double *v, double *work)
{
    double *b = work, *spare = work + x->n_value, *shown = work + 2 * x->n_value;
    for (size_t i = 0; i < x->n_value; i++) b[i] = v[i] * area_of(x, i);
    for (int step = 0; step < N_STEP; step++) {
        apply_overlap(x, v, spare, shown);
        for (size_t i = 0; i < x->n_value; i++) {
            double area = area_of(x, i);
            if (area > 0.0) v[i] += (b[i] - shown[i]) / area;
        }
    }
}

/* Mean ways and their spread from the sums over paths. */
static void finish_ways(const struct deep_job *x)
{
    size_t n = x->n_node;
    double square = 0.0, mean[3] = {0.0}, explained = 0.0;
    for (size_t r = 0; r < N_ROW; r++) square += (double)x->sum[r * x->n_sum + x->n_value + x->n_seen + 6 * n];
    for (size_t i = 0; i < 2 * n; i++) {
        double sum[3] = {0.0};
        for (size_t r = 0; r < N_ROW; r++)
            for (size_t a = 0; a < 3; a++) sum[a] += (double)x->sum[r * x->n_sum + x->n_value + x->n_seen + 3 * i + a];
        for (size_t a = 0; a < 3 && i < n; a++) mean[a] += sum[a];
        for (size_t a = 0; a < 2 && sum[0] > 0.0; a++) {
            double way = sum[1 + a] / sum[0], overall = mean[1 + a] / mean[0];
            x->d->shift[i][a] = (float)(i < n ? way : way - overall);
            explained += i < n ? sum[0] * way * way : sum[0] * (way - overall) * (way - overall);
        }
    }
    x->d->spread_mm = mean[0] > 0.0 ? (float)sqrt(fmax(0.0, 0.5 * (square - explained) / mean[0])) : 0;
}

static void finish_shares(const struct deep_job *x)
{
    double sum[N_SHARE] = {0.0};
    for (size_t r = 0; r < N_ROW; r++)
        for (size_t i = 0; i < N_SHARE; i++) sum[i] += (double)x->sum[r * x->n_sum + first_share(x) + i];
    for (size_t c = 0; c < 3 && sum[0] > 0.0; c++) {
        x->d->back[c] = (float)(sum[1 + c] / sum[0]);
        x->d->through[c] = (float)(sum[4 + c] / sum[0]);
    }
}

/* Tilts that nobody met in a view: the mean over those that were. value: n_value. */
static void fill_unseen(const struct deep_job *x, double *value)
{
    const size_t n_column = 3 * x->n_node;
    for (size_t v = 0; v < x->n_view; v++) {
        size_t kind = v / x->n_node, first = (kind - kind % DEEP_LIGHT_N_TILT) * x->n_node + v % x->n_node;
        double whole = 0.0;
        if (x->seen_area[v] > 0.0) continue;
        for (size_t k = 0; k < DEEP_LIGHT_N_TILT; k++) whole += x->seen_area[first + k * x->n_node];
        for (size_t k = 0; k < DEEP_LIGHT_N_TILT && whole > 0.0; k++) {
            size_t other = first + k * x->n_node;
            for (size_t i = 0; i < n_column; i++)
                value[v * n_column + i] += x->seen_area[other] / whole * value[other * n_column + i];
        }
    }
}

/* Sums the rows: the visible areas, and each half of b over the areas. */
static void sum_rows(const struct deep_job *x, double *const half[2])
{
    for (size_t i = 0; i < x->n_seen; i++) {
        for (size_t r = 0; r < N_ROW; r++) x->seen[i] += (double)x->sum[r * x->n_sum + x->n_value + i];
        x->seen_area[i / N_NEAR] += x->seen[i];
    }
    for (size_t i = 0; i < x->n_value; i++) {
        double sum[2] = {0.0, 0.0}, area = area_of(x, i);
        for (size_t r = 0; r < N_ROW; r++) sum[r % 2] += 2.0 * (double)x->sum[r * x->n_sum + i];
        for (size_t h = 0; h < 2; h++) half[h][i] = area > 0.0 ? sum[h] / area : 0.0;
    }
}

/* Makes the tables and their error. Noise is taken off before the steps of the residual, which raise it. work: 4
 * n_value. */
static status finish(const struct deep_job *x, double *work, struct error *err)
{
    double *half[2] = {work, work + x->n_value}, *value = work + 3 * x->n_value, square = 0.0;
    const struct deep_halves halves = {{half[0], half[1]}, x->seen_area, x->area, x->n_view, x->n_node};
    struct deep_rank_fit fit;
    sum_rows(x, half);
    status s = deep_rank_keep(&halves, x->j->pool, value, &fit, err);
    if (s != STATUS_OK) return s;
    for (size_t i = 0; i < x->n_value; i++) square += area_of(x, i) * value[i] * value[i];
    solve(x, value, work);
    fill_unseen(x, value);
    for (size_t i = 0; i < x->n_value; i++) x->d->value[i] = (float)value[i];
    x->d->error = square > 0.0 ? (float)sqrt(fit.noise2 / square) : 0;
    return STATUS_OK;
}

static void release(struct deep_job *x, double *work)
{
    free(x->sum);
    free(x->overlap);
    free(work);
}

status precompute_deep(struct precompute_job *j, struct error *err)
{
    struct deep_light *d = &j->t->deep;
    if (d->n_traced == 0) return STATUS_OK;
    status s = fast_tables_reserve_deep(j->t, err);
    if (s != STATUS_OK) return s;
    struct deep_job x = {.j = j, .d = d, .n_node = deep_light_n_node(d), .n_value = deep_light_n_value(d)};
    x.n_path = 4 * (size_t)ceil(j->q->deep_paths / (4 * N_ROW)); /* as many of each class and side */
    x.n_view = (size_t)DEEP_LIGHT_N_CLASS * DEEP_LIGHT_N_TILT * x.n_node;
    x.n_seen = x.n_view * N_NEAR;
    x.n_sum = first_share(&x) + N_SHARE;
    x.sum = calloc(N_ROW * x.n_sum, sizeof *x.sum);
    x.overlap = calloc(x.n_node * (x.n_node + 1) + x.n_seen + x.n_view, sizeof *x.overlap);
    double *work = malloc(4 * x.n_value * sizeof *work);
    if (x.sum == NULL || x.overlap == NULL || work == NULL) {
        release(&x, work);
        return error_set(err, STATUS_NO_MEMORY, "cannot make tables: out of memory");
    }
    const struct journal_part part = {JOURNAL_DEEP, N_ROW, 1, {{x.sum, x.n_sum * sizeof *x.sum}}};
    const struct journal_work paths = {run_row, &x, 1, .batch_tasks = 1};
    x.area = x.overlap + x.n_node * x.n_node;
    x.seen = x.area + x.n_node;
    x.seen_area = x.seen + x.n_seen;
    fill_overlap(&x);
    s = precompute_journal_run(j->journal, &part, &paths, j->pool, j->progress, err);
    if (s == STATUS_OK) s = finish(&x, work, err);
    if (s == STATUS_OK) finish_ways(&x);
    if (s == STATUS_OK) finish_shares(&x);
    release(&x, work);
    return s;
}
