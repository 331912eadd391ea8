#include "geometry/diameter/lumen_filter.h"

#include "geometry/diameter/scale_space.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BRICK = SCALE_EDGE, N_CELL = BRICK * BRICK * BRICK, N_ROUND = 2, MOST_MARGIN = 20 };
/* The response is largest at a third of the diameter; somewhat less separates a fiber from its neighbours better. */
static const double DIAMETER_OVER_SIGMA = 3.5, MARGIN_SIGMA = 3.0;
/* Mean response of a lumen in the first and the second round. Of phantoms with lumens of 0.3 to 0.55 of the width, at
 * most 5 % of the filled gaps are above the second, and 9 % of the lumens are below it. */
static const float LEAST_RESPONSE[N_ROUND] = {0.05f, 0.08f};

/* The basins as lists over the filled voxels: the response there, and the basin as the place of one of its voxels. */
struct basin_filter {
    struct volume *v;
    double sigma;
    size_t margin, n_brick[3];
    size_t *basin;
    float *response, *sum; /* sum: at the place of each basin; both of the round */
    float *scratch;        /* two bricks per thread */
};

static size_t find_basin(size_t *basin, size_t i)
{
    while (basin[i] != i) i = basin[i] = basin[basin[i]];
    return i;
}

/* Unites the voxels that share a face. The list is in the order of the voxels, so each of the three neighbours before a
 * voxel moves along the list with it. */
static void unite_basins(const struct basin_filter *s)
{
    const struct volume_filled *f = &s->v->filled;
    const size_t *n = s->v->n, step[3] = {1, n[0], n[0] * n[1]}, n_line[3] = {n[0], n[1], n[2]};
    for (size_t i = 0; i < f->n; i++) s->basin[i] = i;
    for (int a = 0; a < 3; a++)
        for (size_t i = 0, before = 0; i < f->n; i++) {
            if (f->voxel[i] / step[a] % n_line[a] == 0) continue;
            while (f->voxel[before] + step[a] < f->voxel[i]) before++;
            if (f->voxel[before] + step[a] != f->voxel[i]) continue;
            const size_t x = find_basin(s->basin, i), y = find_basin(s->basin, before);
            s->basin[x > y ? x : y] = x > y ? y : x;
        }
    for (size_t i = 0; i < f->n; i++) s->basin[i] = find_basin(s->basin, i);
}

/* Place of the first filled voxel that is not before `voxel`. */
static size_t first_from(const struct volume_filled *f, size_t voxel)
{
    size_t low = 0, high = f->n;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (f->voxel[middle] < voxel)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* Writes the response of the filled voxels of one row inside of a brick. a: the blurred brick from `from`, of n. */
static void respond_row(const struct basin_filter *s, const float *a, const size_t from[3], const size_t n[3],
                        const size_t row[4])
{
    const struct volume_filled *f = &s->v->filled;
    const size_t at = volume_index(s->v->n, 0, row[2], row[3]);
    for (size_t i = first_from(f, at + row[0]); i < f->n && f->voxel[i] < at + row[1]; i++) {
        size_t x[3] = {f->voxel[i] - at - from[0], row[2] - from[1], row[3] - from[2]};
        for (int c = 0; c < 3; c++) x[c] = x[c] < 1 ? 1 : x[c] + 2 > n[c] ? n[c] - 2 : x[c];
        s->response[i] =
            (float)(s->sigma * s->sigma) *
            scale_minus_laplacian(a + volume_index(n, x[0], x[1], x[2]), (ptrdiff_t)n[0], (ptrdiff_t)(n[0] * n[1]));
    }
}

static void respond_brick(void *context, size_t i_brick, size_t i_thread)
{
    const struct basin_filter *s = context;
    const struct volume *v = s->v;
    const size_t c[3] = {i_brick % s->n_brick[0], i_brick / s->n_brick[0] % s->n_brick[1],
                         i_brick / (s->n_brick[0] * s->n_brick[1])};
    const size_t edge = BRICK - 2 * s->margin;
    size_t low[3], high[3], from[3], n[3], n_filled = 0;
    float *a = s->scratch + i_thread * 2 * N_CELL;
    for (int i = 0; i < 3; i++) {
        low[i] = edge * c[i];
        high[i] = low[i] + edge < v->n[i] ? low[i] + edge : v->n[i];
        from[i] = low[i] > s->margin ? low[i] - s->margin : 0;
        n[i] = (high[i] + s->margin < v->n[i] ? high[i] + s->margin : v->n[i]) - from[i];
    }
    scratch_keep_within(v->space);
    for (size_t k = low[2]; k < high[2]; k++)
        for (size_t j = low[1]; j < high[1]; j++) {
            const size_t at = volume_index(v->n, 0, j, k), first = first_from(&v->filled, at + low[0]);
            n_filled += first < v->filled.n && v->filled.voxel[first] < at + high[0];
        }
    if (n_filled == 0) return;
    for (size_t k = 0; k < n[2]; k++)
        for (size_t j = 0; j < n[1]; j++)
            memcpy(a + volume_index(n, 0, j, k), v->density + volume_index(v->n, from[0], from[1] + j, from[2] + k),
                   n[0] * sizeof *a);
    scale_blur(a, a + N_CELL, n, s->sigma);
    for (size_t k = low[2]; k < high[2]; k++)
        for (size_t j = low[1]; j < high[1]; j++) respond_row(s, a, from, n, (const size_t[4]){low[0], high[0], j, k});
}

/* Fills the basins whose mean response is large enough, and empties the others. *n_kept: voxels in them. */
static status filter_round(struct basin_filter *s, float least, struct thread_pool *pool, size_t *n_kept)
{
    const struct volume_filled *f = &s->v->filled;
    const status st = thread_pool_run(pool, s->n_brick[0] * s->n_brick[1] * s->n_brick[2], respond_brick, s, NULL);
    if (st != STATUS_OK) return st;
    memset(s->sum, 0, f->n * sizeof *s->sum);
    for (size_t i = 0; i < f->n; i++) s->sum[s->basin[i]] += s->response[i] - least;
    *n_kept = 0;
    for (size_t i = 0; i < f->n; i++) {
        const bool keep = s->sum[s->basin[i]] > 0.0f;
        s->v->density[f->voxel[i]] = keep ? 1.0f : f->density[i];
        *n_kept += keep;
    }
    return STATUS_OK;
}

enum { FILLED = 1, RIM = 2 };

/* Marks the basins that are kept and the voxels beside them. mark: zeros for all voxels. */
static void mark_lumens(const struct basin_filter *s, uint8_t *mark)
{
    const struct volume_filled *f = &s->v->filled;
    const size_t *n = s->v->n, step[3] = {1, n[0], n[0] * n[1]};
    for (size_t i = 0; i < f->n; i++)
        if (s->sum[s->basin[i]] > 0.0f) mark[f->voxel[i]] = FILLED;
    for (size_t i = 0; i < f->n; i++) {
        const size_t at = f->voxel[i];
        if (mark[at] != FILLED) continue;
        for (int a = 0; a < 3; a++) {
            const size_t x = at / step[a] % n[a];
            if (x > 0 && mark[at - step[a]] == 0) mark[at - step[a]] = RIM;
            if (x + 1 < n[a] && mark[at + step[a]] == 0) mark[at + step[a]] = RIM;
        }
    }
}

static status new_array(const struct volume *v, size_t n_byte, void *array, struct error *err)
{
    return scratch_new(v->space, n_byte, "the lumens of fibers", array, err);
}

status lumens_filter(struct volume *v, double diameter_voxel, struct thread_pool *pool, double *filled_share,
                     struct error *err)
{
    const size_t n_before = v->filled.n;
    struct basin_filter s = {.v = v, .sigma = diameter_voxel / DIAMETER_OVER_SIGMA};
    void *array[4] = {NULL, NULL, NULL, NULL};
    size_t n_kept = 0;
    if (n_before == 0 || v->n[0] < 3 || v->n[1] < 3 || v->n[2] < 3) return STATUS_OK;
    s.margin = (size_t)fmin(MOST_MARGIN, ceil(MARGIN_SIGMA * s.sigma));
    for (int a = 0; a < 3; a++) s.n_brick[a] = (v->n[a] + BRICK - 2 * s.margin - 1) / (BRICK - 2 * s.margin);
    status st = new_array(v, n_before * sizeof *s.basin, &array[0], err);
    if (st == STATUS_OK) st = new_array(v, n_before * sizeof *s.response, &array[1], err);
    if (st == STATUS_OK) st = new_array(v, n_before * sizeof *s.sum, &array[2], err);
    if (st == STATUS_OK) st = new_array(v, volume_n_voxel(v->n), &array[3], err);
    s.scratch = malloc(thread_pool_n_thread(pool) * 2 * N_CELL * sizeof *s.scratch);
    if (st == STATUS_OK && s.scratch == NULL)
        st = error_set(err, STATUS_NO_MEMORY, "cannot look for lumens: out of memory");
    if (st == STATUS_OK) {
        s.basin = array[0];
        s.response = array[1];
        s.sum = array[2];
        unite_basins(&s);
    }
    for (int r = 0; r < N_ROUND && st == STATUS_OK; r++) st = filter_round(&s, LEAST_RESPONSE[r], pool, &n_kept);
    if (st == STATUS_CANCELLED) error_set(err, st, "looking for lumens was cancelled");
    if (st == STATUS_OK) {
        memset(array[3], 0, volume_n_voxel(v->n));
        mark_lumens(&s, array[3]);
        st = volume_fill_marked(v, array[3], FILLED, err);
        *filled_share *= (double)n_kept / (double)n_before;
    }
    free(s.scratch);
    for (int i = 0; i < 4; i++) scratch_release(v->space, array[i]);
    return st;
}
