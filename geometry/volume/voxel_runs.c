#include "geometry/volume/voxel_runs.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

size_t voxel_runs_of(const size_t n[3], const uint8_t *mark, struct volume_run *run)
{
    size_t count = 0;
    for (size_t i = 0; i < volume_n_voxel(n); i++) {
        if (mark[i] == 0) continue;
        const bool goes_on = i % n[0] > 0 && mark[i - 1] != 0;
        if (run != NULL && goes_on) run[count - 1].end = i + 1;
        if (run != NULL && !goes_on) run[count] = (struct volume_run){i, i + 1};
        count += !goes_on;
    }
    return count;
}

bool voxel_runs_hold(const struct volume_run *run, size_t n_run, size_t voxel)
{
    size_t low = 0, high = n_run;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (run[middle].end <= voxel)
            low = middle + 1;
        else
            high = middle;
    }
    return low < n_run && run[low].first <= voxel;
}

/* ---- connected sets (union-find over the runs) ---- */

static size_t root_of(size_t *parent, size_t i)
{
    while (parent[i] != i) {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    return i;
}

/* Joins each of the runs first to end, excluded, with the runs among them that it touches `back` voxels before: in the
 * row, or the slice, before its own. */
static void join_runs(const struct volume_run *run, size_t first, size_t end, size_t back, size_t *parent)
{
    size_t b = first;
    for (size_t a = first; a < end; a++) {
        while (run[b].end + back <= run[a].first) b++;
        for (size_t c = b; c < a && run[c].first + back < run[a].end; c++)
            parent[root_of(parent, a)] = root_of(parent, c);
    }
}

static void join_neighbours(const size_t n[3], const struct volume_run *run, size_t n_run, size_t *parent)
{
    const size_t n_slice = n[0] * n[1];
    for (size_t first = 0, end; first < n_run; first = end) { /* the last row of a slice is not beside the next one */
        const size_t slice = run[first].first / n_slice;
        for (end = first; end < n_run && run[end].first / n_slice == slice;) end++;
        join_runs(run, first, end, n[0], parent);
    }
    join_runs(run, 0, n_run, n_slice, parent);
}

status voxel_marks_drop_small(const size_t n[3], size_t least, uint8_t *mark, struct error *err)
{
    const size_t n_run = voxel_runs_of(n, mark, NULL);
    struct volume_run *run = malloc((n_run + 1) * sizeof *run);
    size_t *parent = malloc((n_run + 1) * sizeof *parent), *size = calloc(n_run + 1, sizeof *size);
    const bool fits = run != NULL && parent != NULL && size != NULL;
    if (fits) {
        voxel_runs_of(n, mark, run);
        for (size_t i = 0; i < n_run; i++) parent[i] = i;
        join_neighbours(n, run, n_run, parent);
        for (size_t i = 0; i < n_run; i++) size[root_of(parent, i)] += run[i].end - run[i].first;
        for (size_t i = 0; i < n_run; i++)
            if (size[root_of(parent, i)] < least) memset(mark + run[i].first, 0, run[i].end - run[i].first);
    }
    free(run);
    free(parent);
    free(size);
    return fits ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot look for light material: out of memory");
}

/* Sums over the voxels of a connected set: number, places, and squares of these. */
struct set_sum {
    double n, place[3], square;
};

static void add_run(struct set_sum *s, const size_t n[3], const struct volume_run *run)
{
    const double count = (double)(run->end - run->first), x = (double)(run->first % n[0]) + 0.5 * (count - 1.0),
                 y = (double)(run->first / n[0] % n[1]), z = (double)(run->first / (n[0] * n[1]));
    s->n += count;
    s->place[0] += count * x;
    s->place[1] += count * y;
    s->place[2] += count * z;
    s->square += count * (x * x + y * y + z * z + (count * count - 1.0) / 12.0);
}

static bool is_compact(const struct set_sum *s, double least_fill, double most_radius)
{
    double spread = s->square / s->n + 0.25; /* of the cubes of three voxel edges: 3 / 12 */
    for (int a = 0; a < 3; a++) spread -= s->place[a] * s->place[a] / (s->n * s->n);
    const double radius = sqrt(5.0 / 3.0 * spread);
    return radius <= most_radius && s->n >= least_fill * 4.0 / 3.0 * M_PI * radius * radius * radius;
}

status voxel_marks_count_compact(const size_t n[3], const uint8_t *mark, double least_fill, double most_radius,
                                 size_t *count, struct error *err)
{
    const size_t n_run = voxel_runs_of(n, mark, NULL);
    struct volume_run *run = malloc((n_run + 1) * sizeof *run);
    size_t *parent = malloc((n_run + 1) * sizeof *parent);
    struct set_sum *sum = calloc(n_run + 1, sizeof *sum);
    const bool fits = run != NULL && parent != NULL && sum != NULL;
    *count = 0;
    if (fits) {
        voxel_runs_of(n, mark, run);
        for (size_t i = 0; i < n_run; i++) parent[i] = i;
        join_neighbours(n, run, n_run, parent);
        for (size_t i = 0; i < n_run; i++) add_run(&sum[root_of(parent, i)], n, &run[i]);
        for (size_t i = 0; i < n_run; i++)
            if (parent[i] == i && is_compact(&sum[i], least_fill, most_radius)) *count += (size_t)sum[i].n;
    }
    free(run);
    free(parent);
    free(sum);
    return fits ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot look for particles: out of memory");
}

/* ---- distances ---- */

struct distance_pass {
    const size_t *n;
    const uint8_t *from;
    uint8_t *to;
    int axis, reach;
};

/* Lowers to[i] to from[i] + add. */
static void lower(const uint8_t *restrict from, uint8_t add, size_t n, uint8_t *restrict to)
{
    for (size_t i = 0; i < n; i++) {
        const uint8_t d = (uint8_t)(from[i] + add);
        to[i] = d < to[i] ? d : to[i];
    }
}

/* One pass of the distance transform along an axis, in a slice (Saito and Toriwaki 1994). */
static void pass_slice(void *context, size_t k, size_t i_thread)
{
    (void)i_thread;
    const struct distance_pass *p = context;
    const size_t nx = p->n[0], ny = p->n[1], nz = p->n[2], step = p->axis == 1 ? nx : nx * ny;
    for (size_t j = 0; j < ny; j++) {
        const size_t row = (k * ny + j) * nx;
        const size_t at = p->axis == 1 ? j : k, last = (p->axis == 1 ? ny : nz) - 1;
        memcpy(p->to + row, p->from + row, nx);
        for (size_t d = 1; d <= (size_t)p->reach; d++) {
            const uint8_t add = (uint8_t)(d * d);
            if (p->axis == 0 && d < nx) {
                lower(p->from + row, add, nx - d, p->to + row + d);
                lower(p->from + row + d, add, nx - d, p->to + row);
            }
            if (p->axis != 0 && at >= d) lower(p->from + row - d * step, add, nx, p->to + row);
            if (p->axis != 0 && at + d <= last) lower(p->from + row + d * step, add, nx, p->to + row);
        }
    }
}

status voxel_marks_distance(const size_t n[3], const uint8_t *mark, uint8_t bits, int reach, struct thread_pool *pool,
                            uint8_t *work, uint8_t *square, struct error *err)
{
    const uint8_t beyond = (uint8_t)(3 * reach * reach + 1);
    uint8_t *from[3] = {square, work, square}, *to[3] = {work, square, work};
    status s = STATUS_OK;
    for (size_t i = 0; i < volume_n_voxel(n); i++) square[i] = (mark[i] & bits) != 0 ? 0 : beyond;
    for (int axis = 0; axis < 3 && s == STATUS_OK; axis++) {
        struct distance_pass p = {n, from[axis], to[axis], axis, reach};
        s = thread_pool_run(pool, n[2], pass_slice, &p, NULL);
    }
    if (s != STATUS_OK) return error_set(err, s, "looking for light material was cancelled");
    memcpy(square, work, volume_n_voxel(n));
    return STATUS_OK;
}
