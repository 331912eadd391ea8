#include "geometry/orientation/line_filter.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LANES = 8 };
typedef float lanes __attribute__((vector_size(LANES * sizeof(float)), aligned(sizeof(float)), may_alias));

struct line_filter {
    size_t half;           /* offsets -half .. half */
    size_t edge;           /* of the copied surroundings: 2 half + 1, in x padded to edge_x */
    size_t edge_x;
    size_t n[3];
    size_t n_direction;
    size_t *first_run;     /* n_direction + 1 */
    int32_t *offset;       /* of a run's first tap from the voxel, in the volume */
    int32_t *offset_local; /* the same in the copy */
    float *weight;         /* LANES a run */
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

struct tap_shape {
    double s, t;
    bool even;
};

static double tap(const struct tap_shape *q, int half, const float d[3], int x, int y, int z)
{
    double along = x * (double)d[0] + y * (double)d[1] + z * (double)d[2];
    double r2 = (double)(x * x + y * y + z * z) - along * along, w = 1.0;
    if (q->even) w = (abs(x) == half ? 0.5 : 1.0) * (abs(y) == half ? 0.5 : 1.0) * (abs(z) == half ? 0.5 : 1.0);
    return w * (-2.0 * exp(-q->s * r2) + exp(-q->t * r2));
}

/* Runs of one direction: written if the tables exist, counted in any case. Taps below 1/500 of the central one are dropped. */
static size_t make_runs(struct line_filter *f, const struct tap_shape *q, const float d[3], size_t at)
{
    int half = (int)f->half;
    size_t count = 0;
    for (int z = -half; z <= half; z++)
        for (int y = -half; y <= half; y++) {
            int first = half + 1, last = -half - 1;
            for (int x = -half; x <= half; x++)
                if (fabs(tap(q, half, d, x, y, z)) > 2e-3) {
                    if (first > x) first = x;
                    last = x;
                }
            for (int x = first; x <= last; x += LANES, count++) {
                if (f->weight == NULL) continue;
                size_t run = at + count;
                f->offset[run] = (int32_t)((z * (ptrdiff_t)f->n[1] + y) * (ptrdiff_t)f->n[0] + x);
                f->offset_local[run] = (int32_t)((z * (ptrdiff_t)f->edge + y) * (ptrdiff_t)f->edge_x + x);
                for (int l = 0; l < LANES; l++)
                    f->weight[run * LANES + (size_t)l] = x + l <= last ? (float)tap(q, half, d, x + l, y, z) : 0.0f;
            }
        }
    return count;
}

status line_filter_new(const struct direction_set *set, double s, double t, size_t h, const size_t n[3],
                       struct line_filter **filter, struct error *err)
{
    *filter = NULL;
    if (!(s > 0.0) || !(t > 0.0) || h < 3 || h > 63)
        return error_set(err, STATUS_INVALID, "cannot make the direction filter with s %g, t %g, h %zu", s, t, h);
    if (n[0] * n[1] * 64 > INT32_MAX)
        return error_set(err, STATUS_TOO_LARGE, "cannot filter slices of %zu x %zu voxels", n[0], n[1]);
    struct line_filter *f = calloc(1, sizeof *f);
    if (f == NULL) goto no_memory;
    f->half = h / 2;
    f->edge = 2 * f->half + 1;
    f->edge_x = f->edge + LANES;
    f->n_direction = set->n;
    memcpy(f->n, n, sizeof f->n);
    f->first_run = calloc(set->n + 1, sizeof *f->first_run);
    if (f->first_run == NULL) goto no_memory;
    const struct tap_shape q = {s, t, h % 2 == 0};
    for (size_t i = 0; i < set->n; i++) f->first_run[i + 1] = f->first_run[i] + make_runs(f, &q, set->node[i].d, 0);
    size_t n_run = f->first_run[set->n];
    f->offset = malloc(n_run * sizeof *f->offset);
    f->offset_local = malloc(n_run * sizeof *f->offset_local);
    f->weight = malloc(n_run * LANES * sizeof *f->weight);
    if (f->offset == NULL || f->offset_local == NULL || f->weight == NULL) goto no_memory;
    for (size_t i = 0; i < set->n; i++) make_runs(f, &q, set->node[i].d, f->first_run[i]);
    *filter = f;
    return STATUS_OK;
no_memory:
    line_filter_free(f);
    return error_set(err, STATUS_NO_MEMORY, "cannot make the direction filter: out of memory");
}

size_t line_filter_scratch(const struct line_filter *f) { return f->edge_x * f->edge * f->edge + LANES; }

struct line_filter_site line_filter_at(const struct line_filter *f, const struct volume *v, size_t i, size_t j,
                                       size_t k, float *scratch)
{
    size_t half = f->half;
    const size_t *n = f->n;
    if (i >= half && j >= half && k >= half && i + half + LANES < n[0] && j + half < n[1] && k + half < n[2])
        return (struct line_filter_site){v->density + volume_index(n, i, j, k), false};
    float *out = scratch;
    for (size_t z = 0; z < f->edge; z++)
        for (size_t y = 0; y < f->edge; y++, out += f->edge_x - f->edge)
            for (size_t x = 0; x < f->edge; x++, out++) {
                /* index + half so that nothing is negative; the mirror image of c is 2 * centre - c */
                size_t at[3] = {i + x, j + y, k + z}, centre[3] = {i, j, k}, mirrored[3];
                bool inside = true, inside_mirrored = true;
                for (int a = 0; a < 3; a++) {
                    inside = inside && at[a] >= half && at[a] < n[a] + half;
                    mirrored[a] = 2 * (centre[a] + half) - at[a];
                    inside_mirrored = inside_mirrored && mirrored[a] >= half && mirrored[a] < n[a] + half;
                }
                if (inside)
                    *out = v->density[volume_index(n, at[0] - half, at[1] - half, at[2] - half)];
                else
                    *out = inside_mirrored
                               ? v->density[volume_index(n, mirrored[0] - half, mirrored[1] - half, mirrored[2] - half)]
                               : 0.0f;
            }
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
