/* Transfer of light from outside to the cells of the tile (fabric thesis, section 6.4.2).
 *
 * Differs from the publication: paths end where they leave the cloth, and that direction is the light's, so that
 * each path counts for the one direction that it found instead of one drawn beforehand; and places are not midpoints of
 * segments but hits of rays from outside, so that a cell is the mean over its visible surfaces. Each cell is a task of
 * its own, whose paths follow from its number: results do not depend on the number of threads. */
#include "renderer/fast/precompute/precompute_parts.h"
#include "renderer/fast/precompute/seen_places.h"
#include "renderer/fast/sphere_harmonics.h"
#include "renderer/transport/surface/fiber_walk.h"

#include <stdlib.h>
#include <string.h>

enum { PILOT_PATHS = 8192, LEAST_PATHS = 1024, MOST_CELL = 200000, FROM_VERTEX = 5 };
static const struct rng_key walk_key = {.seed = 0x7472616e73666572u};

/* A path from a place that is seen, to where it leaves the cloth. */
struct walk_end {
    bool lit;         /* it met a fiber and left where light comes from */
    float from[3];    /* the direction that light arrives from at the place */
    float outside[3]; /* the direction to the light outside */
    float throughput[3];
    double lateral2_mm2;        /* squared distance between both ends, in the plane */
    double flight_mm, n_flight; /* between vertices from the 5th on */
};

static void uniform_direction(struct rng *rng, float d[3])
{
    float z = 1 - 2 * rng_float(rng), r = sqrtf(fmaxf(0, 1 - z * z)), phi = (float)(2 * M_PI) * rng_float(rng);
    d[0] = r * cosf(phi);
    d[1] = r * sinf(phi);
    d[2] = z;
}

static void true_position(const struct scene_hit *hit, const struct scene_ray *ray, double x[3])
{
    for (int a = 0; a < 3; a++) x[a] = (double)hit->position_mm[a] + (a < 2 ? ray->offset_mm[a] : 0.0);
}

static double distance2(const double a[3], const double b[3], int n)
{
    double sum = 0.0;
    for (int k = 0; k < n; k++) sum += (a[k] - b[k]) * (a[k] - b[k]);
    return sum;
}

static void walk(const struct precompute_job *j, const struct seen_place *place, struct rng *rng, struct walk_end *end)
{
    static const double no_offset[2] = {0.0, 0.0};
    struct scene_ray ray;
    struct scene_hit hit = place->hit;
    double start[3], x[3], before[3];
    for (int a = 0; a < 3; a++) start[a] = x[a] = (double)hit.position_mm[a];
    *end = (struct walk_end){.throughput = {1, 1, 1}};
    uniform_direction(rng, end->from);
    fiber_walk_leave(j->sets.model, &hit, no_offset, end->from, rng, &ray);
    for (int i = 0; i < FIBER_WALK_MOST_STEPS; i++) {
        if (!scene_trace(j->q->scene, &ray, &hit)) {
            end->lit = i > 0 && !scene_sheet_met(j->q->scene, &ray);
            memcpy(end->outside, ray.direction, sizeof end->outside);
            end->lateral2_mm2 = distance2(x, start, 2);
            return;
        }
        memcpy(before, x, sizeof before);
        true_position(&hit, &ray, x);
        if (i + 1 >= FROM_VERTEX) {
            end->flight_mm += sqrt(distance2(x, before, 3));
            end->n_flight += 1.0;
        }
        if (!fiber_walk_step(j->q->scene, &j->sets, &hit, &ray, rng, end->throughput)) return;
    }
}

/* The sums over the paths of one cell. */
struct cell_sum {
    double n, mean, mean2, lateral2_mm2, throughput;
};

struct transfer_job {
    struct precompute_job *j;
    struct seen_places seen;
    uint32_t *n_seen;     /* per cell */
    uint32_t *first_seen; /* per row: first of its places in `sorted` */
    uint32_t *sorted;     /* places by row */
    struct cell_sum *sum; /* per row */
};

/* Light from the mirror image below counts as light from above: even functions of z only. */
static void light_harmonics(const struct fast_tables *t, const float direction[3], float *y)
{
    sphere_harmonics(t->order, direction, y);
    if (t->mirrored == 0) return;
    int l = 0, m = 0;
    for (size_t k = 0; k < fast_n_harmonic(t); k++) {
        y[k] = (l + m) % 2 == 0 ? 2 * y[k] : 0;
        m++;
        if (m > l) m = -++l;
    }
}

static void add_walk(const struct fast_tables *t, const struct walk_end *end, float *transfer, struct cell_sum *sum)
{
    size_t n = fast_n_harmonic(t);
    double mean = 0.0;
    sum->n += 1.0;
    if (!end->lit) return;
    float y0[SPHERE_MAX_COUNT], y1[SPHERE_MAX_COUNT];
    light_harmonics(t, end->outside, y0);
    sphere_harmonics(t->order, end->from, y1);
    for (size_t c = 0; c < 3; c++) {
        mean += (double)end->throughput[c] / 3.0;
        for (size_t a = 0; a < n; a++) {
            float value = end->throughput[c] * y1[a] * (float)(4 * M_PI), *row = transfer + (c * n + a) * n;
            for (size_t b = 0; b < n; b++) row[b] += value * y0[b];
        }
    }
    sum->mean += mean;
    sum->mean2 += mean * mean;
    sum->throughput += mean;
    sum->lateral2_mm2 += mean * end->lateral2_mm2;
}

static void run_cell(void *context, size_t i_row, size_t i_thread)
{
    (void)i_thread;
    struct transfer_job *x = context;
    const struct fast_tables *t = x->j->t;
    size_t n_number = (size_t)3 * fast_n_harmonic(t) * fast_n_harmonic(t);
    size_t first = x->first_seen[i_row], n_seen = x->first_seen[i_row + 1] - first;
    double usual = (double)x->first_seen[t->n_transfer] / (double)t->n_transfer,
           wanted = (double)x->j->q->n_path * fmin(1.0, sqrt((double)n_seen / usual));
    size_t n = wanted > LEAST_PATHS ? (size_t)wanted : LEAST_PATHS;
    float *transfer = t->transfer + i_row * n_number;
    for (size_t i = 0; i < n; i++) {
        struct rng rng;
        struct walk_end end;
        if (i % 64 == 0 && progress_cancelled(x->j->progress)) return;
        rng_start(&rng, &walk_key, (uint32_t)i_row, (uint32_t)i);
        walk(x->j, &x->seen.place[x->sorted[first + i % n_seen]], &rng, &end);
        add_walk(t, &end, transfer, &x->sum[i_row]);
    }
    for (size_t k = 0; k < n_number; k++) transfer[k] /= (float)n;
}

/* ---- how large cells are, and which are seen ---- */

static void measure_free_path(struct transfer_job *x)
{
    double sum = 0.0, n = 0.0;
    for (uint32_t i = 0; i < PILOT_PATHS; i++) {
        struct rng rng;
        struct walk_end end;
        rng_start(&rng, &walk_key, UINT32_MAX, i);
        walk(x->j, &x->seen.place[(size_t)i * x->seen.n / PILOT_PATHS], &rng, &end);
        sum += end.flight_mm;
        n += end.n_flight;
    }
    x->j->t->mean_free_path_mm = n > 0.0 ? sum / n : -x->j->t->bottom_mm;
}

static void choose_cells(struct fast_tables *t, double edge_mm)
{
    const double size[3] = {t->tile_mm[0], t->tile_mm[1], -t->bottom_mm};
    double volume = size[0] * size[1] * size[2];
    edge_mm = fmax(edge_mm, cbrt(volume / MOST_CELL));
    for (int a = 0; a < 3; a++) t->n_cell[a] = (uint32_t)fmax(1.0, fmin(1000.0, round(size[a] / edge_mm)));
}

static status make_rows(struct transfer_job *x, struct error *err)
{
    struct fast_tables *t = x->j->t;
    status s = fast_tables_reserve_cells(t, err);
    if (s != STATUS_OK) return s;
    for (size_t i = 0; i < fast_n_cell(t); i++) t->cell[i] = (uint32_t)i; /* so that places find their cells */
    x->n_seen = calloc(fast_n_cell(t), sizeof *x->n_seen);
    x->first_seen = calloc(fast_n_cell(t) + 1, sizeof *x->first_seen);
    x->sorted = malloc((x->seen.n + 1) * sizeof *x->sorted);
    uint32_t *at = malloc((x->seen.n + 1) * sizeof *at);
    if (x->n_seen == NULL || x->first_seen == NULL || x->sorted == NULL || at == NULL) {
        free(at);
        return error_set(err, STATUS_NO_MEMORY, "cannot make tables: out of memory");
    }
    for (size_t i = 0; i < x->seen.n; i++) {
        at[i] = fast_tables_cell_at(t, x->seen.place[i].position_mm);
        x->n_seen[at[i]]++;
    }
    for (size_t i = 0, sum = 0; i < fast_n_cell(t); i++) {
        t->cell[i] = x->n_seen[i] > 0 ? t->n_transfer : FAST_NO_ROW;
        if (x->n_seen[i] == 0) continue;
        sum += x->n_seen[i];
        x->first_seen[++t->n_transfer] = (uint32_t)sum;
    }
    memset(x->n_seen, 0, fast_n_cell(t) * sizeof *x->n_seen);
    for (size_t i = 0; i < x->seen.n; i++) x->sorted[x->first_seen[t->cell[at[i]]] + x->n_seen[at[i]]++] = (uint32_t)i;
    free(at);
    x->sum = calloc(t->n_transfer, sizeof *x->sum);
    if (x->sum == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make tables: out of memory");
    return fast_tables_reserve_transfer(t, err);
}

/* Error of the mean transfer to a cell, and how far light spreads: means over the cells as often as they are seen. */
static void summarise(struct transfer_job *x)
{
    struct fast_tables *t = x->j->t;
    double error2 = 0.0, seen = 0.0, lateral2 = 0.0, throughput = 0.0;
    for (size_t i = 0; i < t->n_transfer; i++) {
        const struct cell_sum *s = &x->sum[i];
        double weight = x->first_seen[i + 1] - x->first_seen[i], mean = s->mean / s->n;
        double variance = fmax(0.0, s->mean2 / s->n - mean * mean) / s->n;
        if (mean > 0.0) error2 += weight * variance / (mean * mean);
        seen += weight;
        lateral2 += weight * s->lateral2_mm2 / s->n;
        throughput += weight * s->throughput / s->n;
    }
    t->transfer_error = (float)sqrt(error2 / seen);
    t->spread_mm = throughput > 0.0 ? sqrt(0.5 * lateral2 / throughput) : 0.0;
}

status precompute_transfer(struct precompute_job *j, struct error *err)
{
    struct transfer_job x = {.j = j};
    status s = seen_places_find(j->q->scene, j->pool, j->progress, &x.seen, err);
    if (s == STATUS_OK) {
        measure_free_path(&x);
        choose_cells(j->t, j->q->cell_paths * j->t->mean_free_path_mm);
        s = make_rows(&x, err);
    }
    if (s == STATUS_OK) {
        size_t n = fast_n_harmonic(j->t);
        const struct journal_part part = {JOURNAL_TRANSFER,
                                          j->t->n_transfer,
                                          2,
                                          {{j->t->transfer, 3 * n * n * sizeof(float)}, {x.sum, sizeof *x.sum}}};
        const struct journal_work work = {run_cell, &x, 1};
        s = precompute_journal_run(j->journal, &part, &work, j->pool, j->progress, err);
    }
    if (s == STATUS_OK) summarise(&x);
    seen_places_release(&x.seen);
    free(x.n_seen);
    free(x.first_seen);
    free(x.sorted);
    free(x.sum);
    return s;
}
