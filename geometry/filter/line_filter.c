#include "geometry/filter/line_filter.h"

#include "base/lanes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct line_filter {
    size_t half; /* offsets -half .. half */
    size_t edge; /* of the copied neighbourhood: 2 half + 1, in x padded to edge_x */
    size_t edge_x;
    size_t n[3];
    size_t n_direction;
    size_t *first_run;     /* n_direction + 1 entries */
    int32_t *offset;       /* of a run's first tap from the voxel, in the volume */
    int32_t *offset_local; /* the same in the copied neighbourhood */
    float *weight;         /* LANES weights per run */
};

void line_filter_free(struct line_filter *f)
{
    if (f == NULL) return;
    free(f->first_run);
    free(f->offset);
    free(f->offset_local);
    free(f->weight);
    free(f);
}

/* Adds the eight taps of the interpolated sample at x, in voxels from the centre of the cube. */
static void splat(const struct line_filter *f, const double x[3], double weight, float *cube)
{
    int i[3];
    double w[3];
    for (int a = 0; a < 3; a++) {
        i[a] = (int)floor(x[a]);
        w[a] = x[a] - (double)i[a];
    }
    for (int c = 0; c < 8; c++) {
        size_t at = 0;
        double share = weight;
        for (int a = 2; a >= 0; a--) {
            int bit = c >> a & 1;
            at = at * f->edge + (size_t)(i[a] + bit + (int)f->half);
            share *= bit ? w[a] : 1.0 - w[a];
        }
        if (share > 1e-6) cube[at] -= (float)share;
    }
}

/* Adds the taps of one direction to a cube of edge^3: whole steps, and the remainder of h / 2 at either end. */
static void make_taps(const struct line_filter *f, const float d[3], double half_length, float *cube)
{
    memset(cube, 0, f->edge * f->edge * f->edge * sizeof *cube);
    int steps = (int)floor(half_length + 0.5);
    for (int k = -steps; k <= steps; k++) {
        double weight = abs(k) < steps ? 1.0 : half_length + 0.5 - (double)steps;
        double x[3] = {k * (double)d[0], k * (double)d[1], k * (double)d[2]};
        if (weight > 0.0) splat(f, x, weight, cube);
    }
}

/* Makes the runs of one direction: writes them if the tables exist, and always returns their number. */
static size_t make_runs(struct line_filter *f, const float *cube, size_t at)
{
    size_t count = 0;
    for (size_t z = 0; z < f->edge; z++)
        for (size_t y = 0; y < f->edge; y++) {
            const float *row = cube + (z * f->edge + y) * f->edge;
            for (size_t x = 0; x < f->edge; x++) {
                if (row[x] >= 0.0f) continue;
                ptrdiff_t dx = (ptrdiff_t)x - (ptrdiff_t)f->half, dy = (ptrdiff_t)y - (ptrdiff_t)f->half;
                ptrdiff_t dz = (ptrdiff_t)z - (ptrdiff_t)f->half;
                for (size_t l = 0; f->weight != NULL && l < LANES; l++)
                    f->weight[(at + count) * LANES + l] = x + l < f->edge ? row[x + l] : 0.0f;
                if (f->weight != NULL) {
                    f->offset[at + count] = (int32_t)((dz * (ptrdiff_t)f->n[1] + dy) * (ptrdiff_t)f->n[0] + dx);
                    f->offset_local[at + count] = (int32_t)((dz * (ptrdiff_t)f->edge + dy) * (ptrdiff_t)f->edge_x + dx);
                }
                count++;
                x += LANES - 1;
            }
        }
    return count;
}

status line_filter_new(const struct direction_set *set, size_t h, const size_t n[3], struct line_filter **filter,
                       struct error *err)
{
    *filter = NULL;
    if (h < 3 || h > 63) return error_set(err, STATUS_INVALID, "cannot make the direction filter with h %zu", h);
    if (n[0] * n[1] * 64 > INT32_MAX)
        return error_set(err, STATUS_TOO_LARGE, "cannot filter slices of %zu x %zu voxels", n[0], n[1]);
    float *cube = NULL;
    struct line_filter *f = calloc(1, sizeof *f);
    if (f == NULL) goto no_memory;
    f->half = h / 2 + 2;
    f->edge = 2 * f->half + 1;
    f->edge_x = f->edge + LANES;
    f->n_direction = set->n;
    memcpy(f->n, n, sizeof f->n);
    cube = malloc(f->edge * f->edge * f->edge * sizeof *cube);
    f->first_run = calloc(set->n + 1, sizeof *f->first_run);
    if (f->first_run == NULL || cube == NULL) goto no_memory;
    for (size_t i = 0; i < set->n; i++) {
        make_taps(f, set->node[i].d, 0.5 * (double)h, cube);
        f->first_run[i + 1] = f->first_run[i] + make_runs(f, cube, 0);
    }
    size_t n_run = f->first_run[set->n];
    f->offset = malloc(n_run * sizeof *f->offset);
    f->offset_local = malloc(n_run * sizeof *f->offset_local);
    f->weight = malloc(n_run * LANES * sizeof *f->weight);
    if (f->offset == NULL || f->offset_local == NULL || f->weight == NULL) goto no_memory;
    for (size_t i = 0; i < set->n; i++) {
        make_taps(f, set->node[i].d, 0.5 * (double)h, cube);
        make_runs(f, cube, f->first_run[i]);
    }
    free(cube);
    *filter = f;
    return STATUS_OK;
no_memory:
    free(cube);
    line_filter_free(f);
    return error_set(err, STATUS_NO_MEMORY, "cannot make the direction filter: out of memory");
}

size_t line_filter_scratch(const struct line_filter *f) { return f->edge_x * f->edge * f->edge + LANES; }

/* A row of the volume, or NULL where it lies outside. */
static const float *row_of(const struct volume *v, ptrdiff_t j, ptrdiff_t k)
{
    bool inside = j >= 0 && k >= 0 && j < (ptrdiff_t)v->n[1] && k < (ptrdiff_t)v->n[2];
    return inside ? v->density + volume_index(v->n, 0, (size_t)j, (size_t)k) : NULL;
}

/* Copies the neighbourhood of a voxel near a face. Outside of the volume the mirror image through the voxel is taken,
 * or 0 if that lies outside too. */
static void copy_neighbourhood(const struct line_filter *f, const struct volume *v, const ptrdiff_t centre[3],
                               float *out)
{
    const ptrdiff_t half = (ptrdiff_t)f->half, n = (ptrdiff_t)f->n[0];
    for (ptrdiff_t z = -half; z <= half; z++)
        for (ptrdiff_t y = -half; y <= half; y++, out += f->edge_x) {
            const float *row = row_of(v, centre[1] + y, centre[2] + z);
            if (row != NULL && centre[0] >= half && centre[0] + half < n) {
                memcpy(out, row + centre[0] - half, f->edge * sizeof *out);
                continue;
            }
            const float *mirrored = row_of(v, centre[1] - y, centre[2] - z);
            for (ptrdiff_t x = -half; x <= half; x++) {
                ptrdiff_t at = centre[0] + x, back = centre[0] - x;
                bool inside = row != NULL && at >= 0 && at < n;
                bool inside_mirrored = mirrored != NULL && back >= 0 && back < n;
                out[x + half] = inside ? row[at] : inside_mirrored ? mirrored[back] : 0.0f;
            }
        }
}

struct line_filter_site line_filter_at(const struct line_filter *f, const struct volume *v, size_t i, size_t j,
                                       size_t k, float *scratch)
{
    size_t half = f->half;
    const size_t *n = f->n;
    if (i >= half && j >= half && k >= half && i + half + LANES < n[0] && j + half < n[1] && k + half < n[2])
        return (struct line_filter_site){v->density + volume_index(n, i, j, k), false};
    copy_neighbourhood(f, v, (const ptrdiff_t[3]){(ptrdiff_t)i, (ptrdiff_t)j, (ptrdiff_t)k}, scratch);
    return (struct line_filter_site){scratch + (half * f->edge + half) * f->edge_x + half, true};
}

float line_filter_j(const struct line_filter *f, const struct line_filter_site *site, size_t i_direction)
{
    const int32_t *offset = site->copied ? f->offset_local : f->offset;
    size_t end = f->first_run[i_direction + 1], r = f->first_run[i_direction];
    const lanes *weight = (const lanes *)f->weight;
    lanes sum0 = {0.0f}, sum1 = {0.0f};
    for (; r + 1 < end; r += 2) {
        sum0 += weight[r] * *(const lanes *)(site->centre + offset[r]);
        sum1 += weight[r + 1] * *(const lanes *)(site->centre + offset[r + 1]);
    }
    if (r < end) sum0 += weight[r] * *(const lanes *)(site->centre + offset[r]);
    sum0 += sum1;
    float sum = 0.0f;
    for (int l = 0; l < LANES; l++) sum += sum0[l];
    return sum;
}
