/* The table of light that is scattered more than n_traced times (deep_light.h).
 *
 * Paths that come from random directions and meet the cloth at random places are traced until they leave it; those
 * that met more than n_traced fibers count for the direction in which they leave, which is the light's. So a path needs
 * no connection to a light, and narrow lobes cost nothing. Over the two disks of directions across the cloth (x, y of
 * the unit vectors), the density of pairs (from, to) is the value over pi times the density of views.
 *
 * The value is the function between the nodes that is nearest to what the paths show in the mean of squares over both
 * disks: with B the weights of nodes, M the matrix of the means of B_m B_n, and b those of the paths, M_o v M_i = b.
 * It is approached from b divided by the sums of rows of M, in N_STEP steps of the residual divided in the same way;
 * more of them follow the noise. Each keeps the sum over all pairs, and so the energy.
 *
 * Each class of fibers has as many paths, whose places are drawn until a fiber of the class is met; where that takes
 * more than CLASS_TRIES hits, any fiber counts, which fills the tables of classes that a cloth does not have.
 *
 * Beside them stand the means of the ways from the first hit to the last one, in the plane of the cloth, weighted by
 * throughput: of each view and of each light, less the mean over all of them.
 *
 * Each row of the part is the sum over some of the paths, which follow from its number: results do not depend on the
 * number of threads. Differences between even and odd rows give the error. */
#include "renderer/fast/precompute/precompute_parts.h"
#include "renderer/transport/surface/fiber_walk.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N_ROW = 32, CLASS_TRIES = 32, N_STEP = 2, N_FINE = 1024, MOST_MISS = 1000 };
static const struct rng_key walk_key = {.seed = 0x646565706c696768u};

struct deep_job {
    struct precompute_job *j;
    struct deep_light *d;
    size_t n_path, n_node; /* paths of a row; nodes of a grid */
    size_t n_value, n_all; /* numbers of the table of a class; of all classes */
    size_t n_sum;          /* numbers of a row: n_all of the tables, then n_way */
    float *sum;            /* N_ROW x n_sum */
    double *overlap;       /* n_node x n_node: the matrix M, integrals of weights over the disk */
    double *area;          /* n_node: sums of its rows */
};

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

/* Numbers about ways: weight, x and y of each view, the same of each light, and the sum of squares. */
static size_t n_way(const struct deep_job *x) { return 6 * x->n_node + 1; }

/* Adds the way of a path, whose weight has the two factors. sum: where those of a view or a light begin. */
static void count_way(const double way_mm[2], double scale, const size_t node[4], const double weight[4], float *sum)
{
    for (size_t k = 0; k < 4; k++) {
        float *to = sum + 3 * node[k], w = (float)(scale * weight[k]);
        to[0] += w;
        for (int a = 0; a < 2; a++) to[1 + a] += w * (float)way_mm[a];
    }
}

/* way_mm: from the first hit to the last one. sum: of the row. */
static void count(const struct deep_job *x, size_t i_class, const double wo[3], const struct scene_ray *ray,
                  const float throughput[3], const double way_mm[2], float *sum)
{
    size_t view[4], light[4];
    double view_weight[4], light_weight[4];
    const double wi[3] = {(double)ray->direction[0], (double)ray->direction[1], (double)ray->direction[2]};
    if (x->d->n_side == 1 && wi[2] <= 0.0) return;
    deep_light_nodes(x->d, wo, view, view_weight);
    deep_light_nodes(x->d, wi, light, light_weight);
    /* views are even over solid angles: 1 over their density on the disk is 2 pi cos for each side */
    double scale = DEEP_LIGHT_N_CLASS * M_PI * 2.0 * M_PI * fabs(wo[2]) * x->d->n_side / ((double)x->n_path * N_ROW);
    float *way = sum + x->n_all;
    double brightness = scale * ((double)throughput[0] + (double)throughput[1] + (double)throughput[2]);
    count_way(way_mm, brightness, view, view_weight, way);
    count_way(way_mm, brightness, light, light_weight, way + 3 * x->n_node);
    way[6 * x->n_node] += (float)(brightness * (way_mm[0] * way_mm[0] + way_mm[1] * way_mm[1]));
    for (size_t k = 0; k < 16; k++) {
        float *to = sum + i_class * x->n_value + (view[k / 4] * x->n_node + light[k % 4]) * 3;
        for (int c = 0; c < 3; c++) to[c] += (float)(scale * view_weight[k / 4] * light_weight[k % 4]) * throughput[c];
    }
}

/* Where a hit lies in the endless cloth. */
static void place_of(const struct scene_hit *hit, const struct scene_ray *ray, double place_mm[2])
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
    place_of(&hit, &ray, first_mm);
    for (uint32_t i = 1; i < (uint32_t)FIBER_WALK_MOST_STEPS; i++) {
        place_of(&hit, &ray, last_mm);
        if (!fiber_walk_step(j->q->scene, &j->sets, &hit, &ray, rng, throughput)) return;
        if (scene_trace(j->q->scene, &ray, &hit)) continue;
        if (i > x->d->n_traced && !scene_sheet_met(j->q->scene, &ray)) {
            const double way_mm[2] = {last_mm[0] - first_mm[0], last_mm[1] - first_mm[1]};
            count(x, i_class, wo, &ray, throughput, way_mm, sum);
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

/* out = M v M, all n_node x n_node x 3. spare: as large. */
static void apply_overlap(const struct deep_job *x, const double *v, double *spare, double *out)
{
    size_t n = x->n_node;
    memset(spare, 0, x->n_value * sizeof *spare);
    memset(out, 0, x->n_value * sizeof *out);
    for (size_t m = 0; m < n; m++)
        for (size_t k = 0; k < n; k++) {
            double overlap = x->overlap[m * n + k];
            for (size_t i = 0; i < 3 * n && overlap > 0.0; i++) spare[3 * m * n + i] += overlap * v[3 * k * n + i];
        }
    for (size_t m = 0; m < n; m++)
        for (size_t k = 0; k < n; k++) {
            double overlap = x->overlap[m * n + k];
            for (size_t r = 0; r < n && overlap > 0.0; r++)
                for (size_t c = 0; c < 3; c++) out[3 * (r * n + m) + c] += overlap * spare[3 * (r * n + k) + c];
        }
}

/* Values from the sums b over paths. work: 3 n_value, the first of which are the values. */
static void solve(const struct deep_job *x, const double *b, double *work)
{
    double *v = work, *spare = work + x->n_value, *shown = work + 2 * x->n_value;
    memset(work, 0, 3 * x->n_value * sizeof *work);
    for (int step = 0; step <= N_STEP; step++) {
        if (step > 0) apply_overlap(x, v, spare, shown);
        for (size_t i = 0; i < x->n_value; i++) {
            double area = x->area[i / 3 / x->n_node] * x->area[i / 3 % x->n_node];
            if (area > 0.0) v[i] += (b[i] - shown[i]) / area;
        }
    }
}

/* Mean ways and their spread from the sums over paths. */
static void finish_ways(const struct deep_job *x)
{
    size_t n = x->n_node;
    double square = 0.0, mean[3] = {0.0}, explained = 0.0;
    for (size_t r = 0; r < N_ROW; r++) square += (double)x->sum[r * x->n_sum + x->n_all + 6 * n];
    for (size_t i = 0; i < 2 * n; i++) {
        double sum[3] = {0.0};
        for (size_t r = 0; r < N_ROW; r++)
            for (size_t a = 0; a < 3; a++) sum[a] += (double)x->sum[r * x->n_sum + x->n_all + 3 * i + a];
        for (size_t a = 0; a < 3 && i < n; a++) mean[a] += sum[a];
        for (size_t a = 0; a < 2 && sum[0] > 0.0; a++) {
            double way = sum[1 + a] / sum[0], overall = mean[1 + a] / mean[0];
            x->d->shift[i][a] = (float)(i < n ? way : way - overall);
            explained += i < n ? sum[0] * way * way : sum[0] * (way - overall) * (way - overall);
        }
    }
    x->d->spread_mm = mean[0] > 0.0 ? (float)sqrt(fmax(0.0, 0.5 * (square - explained) / mean[0])) : 0;
}

/* Sums the rows, and makes the tables and their error. work: 6 n_value. */
static void finish(const struct deep_job *x, double *work)
{
    double *half[2] = {work, work + x->n_value}, *rest = work + 2 * x->n_value, *even = work + 5 * x->n_value;
    double square = 0.0, difference = 0.0;
    for (size_t from = 0; from < x->n_all; from += x->n_value) {
        memset(work, 0, 2 * x->n_value * sizeof *work);
        for (size_t r = 0; r < N_ROW; r++)
            for (size_t i = 0; i < x->n_value; i++) half[r % 2][i] += 2.0 * (double)x->sum[r * x->n_sum + from + i];
        solve(x, half[0], rest);
        memcpy(even, rest, x->n_value * sizeof *even);
        solve(x, half[1], rest);
        for (size_t i = 0; i < x->n_value; i++) {
            double mean = 0.5 * (even[i] + rest[i]), off = 0.5 * (even[i] - rest[i]);
            double area = x->area[i / 3 / x->n_node] * x->area[i / 3 % x->n_node];
            x->d->value[from + i] = (float)mean;
            square += area * mean * mean;
            difference += area * off * off;
        }
    }
    x->d->error = square > 0.0 ? (float)sqrt(difference / square) : 0;
}

status precompute_deep(struct precompute_job *j, struct error *err)
{
    struct deep_light *d = &j->t->deep;
    if (d->n_traced == 0) return STATUS_OK;
    status s = fast_tables_reserve_deep(j->t, err);
    if (s != STATUS_OK) return s;
    struct deep_job x = {.j = j, .d = d, .n_node = deep_light_n_node(d), .n_all = deep_light_n_value(d)};
    x.n_path = 4 * (size_t)ceil(j->q->deep_paths / (4 * N_ROW)); /* as many of each class and side */
    x.n_value = x.n_all / DEEP_LIGHT_N_CLASS;
    x.n_sum = x.n_all + n_way(&x);
    x.sum = calloc(N_ROW * x.n_sum, sizeof *x.sum);
    x.overlap = calloc(x.n_node * (x.n_node + 1), sizeof *x.overlap);
    double *work = malloc(6 * x.n_value * sizeof *work);
    if (x.sum == NULL || x.overlap == NULL || work == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot make tables: out of memory");
    else {
        const struct journal_part part = {JOURNAL_DEEP, N_ROW, 1, {{x.sum, x.n_sum * sizeof *x.sum}}};
        const struct journal_work paths = {run_row, &x, 1, .batch_tasks = 1};
        x.area = x.overlap + x.n_node * x.n_node;
        fill_overlap(&x);
        s = precompute_journal_run(j->journal, &part, &paths, j->pool, j->progress, err);
    }
    if (s == STATUS_OK) finish(&x, work);
    if (s == STATUS_OK) finish_ways(&x);
    free(x.sum);
    free(x.overlap);
    free(work);
    return s;
}
