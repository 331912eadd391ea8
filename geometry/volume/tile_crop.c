#include "geometry/volume/tile_crop.h"
#include "base/option_id.h"

#include "geometry/volume/volume_align.h"

#include <math.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { N_BLOCK = 64, REACH = 4 };

static const double SIZE_PENALTY = 0.05;

/* The volume reduced for the search: for axis a (0 x, 1 y) every slice, averaged over blocks of the two other axes. */
struct profile {
    const struct volume *v;
    float material, void_value;
    size_t block[3], n_block[3]; /* voxels per block; number of blocks along an axis */
    size_t z_low, z_high;        /* range that holds 99 % of the material */
    double *n_material;          /* per z */
    float *mean[2];              /* [axis]: slice x block of the other in-plane axis x block of z */
    _Atomic uint8_t *outside;    /* nx x ny: 1 if a voxel of the column lies outside */
};

static void count_slice(void *context, size_t k, size_t i_thread)
{
    (void)i_thread;
    struct profile *p = context;
    size_t n = p->v->n[0] * p->v->n[1], count = 0;
    const float *d = p->v->density + k * n;
    scratch_keep_within(p->v->space);
    for (size_t i = 0; i < n; i++) count += d[i] >= p->material;
    p->n_material[k] = (double)count;
}

static status find_z_range(struct profile *p, struct error *err)
{
    double total = 0.0, below = 0.0, above = 0.0;
    size_t n = p->v->n[2];
    for (size_t k = 0; k < n; k++) total += p->n_material[k];
    if (!(total > 0.0))
        return error_set_field(err, STATUS_INVALID, OPTION_CROP,
                               "cannot crop the volume: no voxel reaches the density of material");
    p->z_low = 0;
    p->z_high = n;
    while (p->z_low + 1 < n && (below += p->n_material[p->z_low]) < 0.005 * total) p->z_low++;
    while (p->z_high > p->z_low + 1 && (above += p->n_material[p->z_high - 1]) < 0.005 * total) p->z_high--;
    return STATUS_OK;
}

/* Adds the slices of one block of z in order. */
static void add_block(void *context, size_t bz, size_t i_thread)
{
    (void)i_thread;
    struct profile *p = context;
    const size_t *n = p->v->n, *nb = p->n_block;
    size_t to = (bz + 1) * p->block[2] < n[2] ? (bz + 1) * p->block[2] : n[2];
    for (size_t k = bz * p->block[2]; k < to; k++) {
        scratch_keep_within(p->v->space);
        bool inner = k >= p->z_low && k < p->z_high;
        for (size_t j = 0; j < n[1]; j++) {
            const float *row = p->v->density + volume_index(n, 0, j, k);
            float *of_x = p->mean[0] + (j / p->block[1]) * nb[2] + bz, *of_y = p->mean[1] + j * nb[0] * nb[2] + bz;
            for (size_t i = 0; i < n[0]; i++) {
                bool out = row[i] == VOLUME_OUTSIDE;
                float value = out ? p->void_value : row[i];
                if (out && inner) atomic_store_explicit(&p->outside[j * n[0] + i], 1, memory_order_relaxed);
                of_x[i * nb[1] * nb[2]] += value;
                of_y[(i / p->block[0]) * nb[2]] += value;
            }
        }
    }
}

static void release(struct profile *p)
{
    free(p->n_material);
    free(p->mean[0]);
    free(p->mean[1]);
    free((void *)p->outside);
}

static status make_profile(struct profile *p, struct thread_pool *pool, const struct progress *progress,
                           struct error *err)
{
    const size_t *n = p->v->n;
    for (int a = 0; a < 3; a++) {
        p->block[a] = (n[a] + N_BLOCK - 1) / N_BLOCK;
        p->n_block[a] = (n[a] + p->block[a] - 1) / p->block[a];
    }
    p->n_material = calloc(n[2], sizeof *p->n_material);
    p->mean[0] = calloc(n[0] * p->n_block[1] * p->n_block[2], sizeof(float));
    p->mean[1] = calloc(n[1] * p->n_block[0] * p->n_block[2], sizeof(float));
    p->outside = calloc(n[0] * n[1], 1);
    if (p->n_material == NULL || p->mean[0] == NULL || p->mean[1] == NULL || p->outside == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot crop the volume: out of memory");
    status s = thread_pool_run(pool, n[2], count_slice, p, NULL);
    if (s == STATUS_OK) {
        s = find_z_range(p, err);
        if (s != STATUS_OK) return s;
        s = thread_pool_run(pool, p->n_block[2], add_block, p, progress);
    }
    return s == STATUS_OK ? s : error_set(err, s, "cropping the volume was cancelled");
}

/* Size of a rectangle of columns: its area times the smaller of its shares of the edges, so that narrow strips count
 * little. */
static double rectangle_size(const size_t n[3], size_t width, size_t height)
{
    double share[2] = {(double)width / (double)n[0], (double)height / (double)n[1]};
    return share[0] * share[1] * fmin(share[0], share[1]);
}

/* Finds the largest rectangle of columns that lie in the scan: in every row the widest run under each height of
 * columns above it. */
static status find_valid(const struct profile *p, size_t valid[4], struct error *err)
{
    const size_t *n = p->v->n;
    size_t *height = calloc(n[0] + 1, sizeof *height), *start = malloc((n[0] + 1) * sizeof *start);
    double best = 0.0;
    if (height == NULL || start == NULL) {
        free(height);
        free(start);
        return error_set(err, STATUS_NO_MEMORY, "cannot crop the volume: out of memory");
    }
    for (size_t j = 0; j < n[1]; j++) {
        size_t n_open = 0; /* start[] is a stack of columns with ascending heights */
        for (size_t i = 0; i < n[0]; i++) height[i] = p->outside[j * n[0] + i] ? 0 : height[i] + 1;
        for (size_t i = 0; i <= n[0]; i++) {
            size_t h = i < n[0] ? height[i] : 0;
            while (n_open > 0 && height[start[n_open - 1]] >= h) {
                size_t top = start[--n_open], from = n_open > 0 ? start[n_open - 1] + 1 : 0;
                double size = rectangle_size(n, i - from, height[top]);
                if (size <= best) continue;
                best = size;
                valid[0] = from, valid[2] = i;
                valid[1] = j + 1 - height[top], valid[3] = j + 1;
            }
            start[n_open++] = i;
        }
    }
    free(height);
    free(start);
    if (!(best > 0.0))
        return error_set_field(err, STATUS_INVALID, OPTION_CROP,
                               "cannot crop the volume: nothing of it lies in the scan after alignment");
    return STATUS_OK;
}

/* ---- search along one axis ---- */

struct search {
    const struct profile *p;
    int axis;
    size_t low, high;  /* slices that may be used */
    size_t from, to;   /* entries of a slice that are compared */
    size_t n_entry;    /* entries of a whole slice */
    size_t least;      /* least number of slices to keep */
    float *difference; /* n x n, n = high - low */
    struct candidate {
        double cost, mismatch;
        size_t x0, x1;
    } * best; /* one per first slice */
    double unrelated;
};

static void compare_slice(void *context, size_t i, size_t i_thread)
{
    (void)i_thread;
    struct search *s = context;
    size_t n = s->high - s->low;
    const float *a = s->p->mean[s->axis] + (s->low + i) * s->n_entry;
    for (size_t j = i; j < n; j++) {
        const float *b = s->p->mean[s->axis] + (s->low + j) * s->n_entry;
        float sum = 0.0f;
        for (size_t e = s->from; e < s->to; e++) sum += (a[e] - b[e]) * (a[e] - b[e]);
        s->difference[i * n + j] = s->difference[j * n + i] = sum;
    }
}

static double mismatch(const struct search *s, size_t x0, size_t x1)
{
    size_t n = s->high - s->low, count = 0;
    double sum = 0.0;
    for (long k = -REACH; k < REACH; k++) {
        long a = (long)x0 + k, b = (long)x1 + k;
        if (a < 0 || b >= (long)n) continue;
        sum += (double)s->difference[(size_t)a * n + (size_t)b];
        count++;
    }
    return (count > 0 ? sum / (double)count : (double)s->difference[x0 * n + x1 - 1]) / s->unrelated;
}

static void try_first(void *context, size_t x0, size_t i_thread)
{
    (void)i_thread;
    struct search *s = context;
    size_t n = s->high - s->low;
    struct candidate *best = &s->best[x0];
    *best = (struct candidate){.cost = INFINITY, .mismatch = NAN, .x0 = x0, .x1 = x0};
    for (size_t x1 = x0 + s->least; x1 <= n; x1++) {
        double m = mismatch(s, x0, x1), cost = m + SIZE_PENALTY * (1.0 - (double)(x1 - x0) / (double)n);
        if (cost < best->cost) *best = (struct candidate){cost, m, x0, x1};
    }
}

static void find_unrelated(struct search *s)
{
    size_t n = s->high - s->low, count = 0;
    double sum = 0.0;
    for (size_t i = 0; i < n; i++)
        for (size_t j = i + n / 4 + 1; j < n; j++, count++) sum += (double)s->difference[i * n + j];
    s->unrelated = count > 0 ? sum / (double)count : 0.0;
}

/* box: x0 y0 x1 y1. The part of `axis` is replaced; the rest selects the entries that are compared. */
static status search_axis(const struct profile *p, int axis, const size_t valid[4], double keep,
                          struct thread_pool *pool, size_t box[4], double *least_mismatch, struct error *err)
{
    int other = 1 - axis;
    struct search s = {.p = p, .axis = axis, .low = valid[axis], .high = valid[2 + axis]};
    size_t n = s.high - s.low, nz = p->n_block[2];
    *least_mismatch = NAN;
    s.n_entry = p->n_block[other] * nz;
    s.from = box[other] / p->block[other] * nz;
    s.to = ((box[2 + other] - 1) / p->block[other] + 1) * nz;
    s.least = (size_t)ceil(keep * (double)n);
    if (n < 16 || s.least >= n) return STATUS_OK;
    s.difference = malloc(n * n * sizeof *s.difference);
    s.best = malloc(n * sizeof *s.best);
    status st = s.difference == NULL || s.best == NULL
                    ? error_set(err, STATUS_NO_MEMORY, "cannot crop the volume: out of memory")
                    : STATUS_OK;
    if (st == STATUS_OK) st = thread_pool_run(pool, n, compare_slice, &s, NULL);
    if (st == STATUS_OK) find_unrelated(&s);
    if (st == STATUS_OK && s.unrelated > 0.0) st = thread_pool_run(pool, n - s.least + 1, try_first, &s, NULL);
    if (st == STATUS_OK && s.unrelated > 0.0) {
        struct candidate best = s.best[0];
        for (size_t x0 = 1; x0 + s.least <= n; x0++)
            if (s.best[x0].cost < best.cost) best = s.best[x0];
        if (best.mismatch <= TILE_MOST_MISMATCH) {
            box[axis] = s.low + best.x0;
            box[2 + axis] = s.low + best.x1;
        }
        *least_mismatch = best.mismatch;
    }
    free(s.difference);
    free(s.best);
    return st;
}

status tile_crop_find(const struct volume *v, double material, double void_value, double keep, struct thread_pool *pool,
                      const struct progress *progress, struct tile_crop *crop, struct error *err)
{
    struct profile p = {.v = v, .material = (float)material, .void_value = (float)void_value};
    *crop = (struct tile_crop){.mismatch = {NAN, NAN}};
    status s = make_profile(&p, pool, progress, err);
    if (s == STATUS_OK) s = find_valid(&p, crop->valid, err);
    size_t box[4];
    memcpy(box, crop->valid, sizeof box);
    for (int round = 0; round < 2 && s == STATUS_OK && keep < 1.0;
         round++) /* again with the result for the other axis */
        for (int axis = 0; axis < 2 && s == STATUS_OK; axis++)
            s = search_axis(&p, axis, crop->valid, keep, pool, box, &crop->mismatch[axis], err);
    for (int a = 0; a < 2; a++) {
        crop->box[a] = box[a];
        crop->box[3 + a] = box[2 + a];
    }
    crop->box[2] = 0;
    crop->box[5] = v->n[2];
    release(&p);
    return s;
}

void volume_crop(struct volume *v, const size_t box[6])
{
    size_t n[3], at = 0;
    for (int a = 0; a < 3; a++) n[a] = box[3 + a] - box[a];
    for (size_t k = box[2]; k < box[5]; k++) { /* towards the front, so nothing is overwritten before it is moved */
        scratch_keep_within(v->space);
        for (size_t j = box[1]; j < box[4]; j++, at += n[0])
            memmove(v->density + at, v->density + volume_index(v->n, box[0], j, k), n[0] * sizeof *v->density);
    }
    memcpy(v->n, n, sizeof v->n);
}

void seam_density_measure(const struct volume *v, struct seam_density *s)
{
    const size_t *n = v->n;
    double across[2] = {0.0}, neighbour[2] = {0.0};
    for (size_t k = 0; k < n[2]; k++) {
        scratch_keep_within(v->space);
        for (size_t j = 0; j < n[1]; j++) {
            const float *row = v->density + volume_index(n, 0, j, k),
                        *next = j + 1 < n[1] ? row + n[0] : row - j * n[0];
            double in_x = 0.0, to_next = 0.0;
            for (size_t i = 0; i + 1 < n[0]; i++) in_x += (double)fabsf(row[i + 1] - row[i]);
            for (size_t i = 0; i < n[0]; i++) to_next += (double)fabsf(next[i] - row[i]);
            neighbour[0] += in_x;
            across[0] += (double)fabsf(row[0] - row[n[0] - 1]);
            *(j + 1 < n[1] ? &neighbour[1] : &across[1]) += to_next;
        }
    }
    for (int a = 0; a < 2; a++) {
        double slice = (double)n[1 - a] * (double)n[2];
        s->across[a] = n[a] > 1 ? across[a] / slice : NAN;
        s->neighbour[a] = n[a] > 1 ? neighbour[a] / (slice * (double)(n[a] - 1)) : NAN;
        s->ratio[a] = s->neighbour[a] > 0.0 ? s->across[a] / s->neighbour[a] : NAN;
    }
}
