#include "geometry/fibers/voxelise.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { SLAB = 2, BYTES_PER_VOXEL = 5 };

/* Buffers of one thread for the voxels of one slab. */
struct slab {
    uint32_t *owner;  /* number + 1 of the fiber that last touched a voxel */
    float *share;     /* share of the owner in the voxel */
    float *density;   /* sum of shares */
    float *distance;  /* distance to the nearest axis, in widths */
    float *direction; /* direction of the nearest axis, three numbers */
};

struct job {
    const struct fiber_set *f;
    struct direction_volume *v;
    double z_low_m, per_voxel[3]; /* voxels per metre */
    struct slab *slab;            /* one per thread */
};

/* One segment, in metres, with positions relative to the corner of the grid. */
struct capsule {
    double a[3], d[3], length2, length;
    /* share = scale * clamp(1/2 + (ramp - distance) / width), with the ramp and the scale at the begin and their change
     * to the end */
    double ramp_m, ramp_change_m, width_m, scale, scale_change;
    bool is_first, is_last;
    uint32_t fiber;
};

/* Ramp and scale of a fiber of radius r in voxels of width w. */
static void ramp_of(double r, double w, double *ramp_m, double *scale)
{
    *ramp_m = sqrt(fmax(0.0, r * r - w * w / 12.0));
    *scale = 1.0;
    if (*ramp_m < 0.5 * w) { /* the ramp would not end before the axis, so the fiber is drawn as a cone */
        *ramp_m = 0.5 * w;
        *scale = 3.0 * r * r / (w * w);
    }
}

static bool capsule_init(struct capsule *c, const struct job *job, size_t i_fiber, size_t i_vertex)
{
    const struct fiber_set *f = job->f;
    const float *p = f->position_m + 3 * i_vertex;
    const double *size = job->v->voxel_size_m;
    c->length2 = 0.0;
    for (int a = 0; a < 3; a++) {
        c->a[a] = (double)p[a] - (a == 2 ? job->z_low_m : 0.0);
        c->d[a] = (double)p[3 + a] - (double)p[a];
        c->length2 += c->d[a] * c->d[a];
    }
    c->length = sqrt(c->length2);
    c->width_m = cbrt(size[0] * size[1] * size[2]);
    double ramp_m, scale;
    ramp_of((double)fiber_radius_m(f, i_fiber, i_vertex), c->width_m, &c->ramp_m, &c->scale);
    ramp_of((double)fiber_radius_m(f, i_fiber, i_vertex + 1), c->width_m, &ramp_m, &scale);
    c->ramp_change_m = ramp_m - c->ramp_m;
    c->scale_change = scale - c->scale;
    c->is_first = i_vertex == f->first_vertex[i_fiber];
    c->is_last = i_vertex + 2 == f->first_vertex[i_fiber + 1];
    c->fiber = (uint32_t)i_fiber + 1;
    return c->length2 > 0.0;
}

/* Distance of a point from the axis in metres; negative beyond an end of the fiber. *at: place along the segment. */
static double axis_distance(const struct capsule *c, const double p[3], double *at)
{
    double q[3] = {p[0] - c->a[0], p[1] - c->a[1], p[2] - c->a[2]}, sum = 0.0;
    double t = (q[0] * c->d[0] + q[1] * c->d[1] + q[2] * c->d[2]) / c->length2;
    if ((t < 0.0 && c->is_first) || (t > 1.0 && c->is_last)) return -1.0;
    t = t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t;
    *at = t;
    for (int a = 0; a < 3; a++) sum += (q[a] - t * c->d[a]) * (q[a] - t * c->d[a]);
    return sqrt(sum);
}

static double share_at(const struct capsule *c, double distance, double at)
{
    if (distance < 0.0) return 0.0; /* beyond an end */
    const double ramp_m = c->ramp_m + at * c->ramp_change_m, scale = c->scale + at * c->scale_change;
    return scale * fmin(fmax(0.0, 0.5 + (ramp_m - distance) / c->width_m), 1.0);
}

static double share_of(const struct capsule *c, const double p[3])
{
    double at = 0.0, distance = axis_distance(c, p, &at);
    return share_at(c, distance, at);
}

/* Share of a cone beyond the first and last slice, where the grid ends with the cloth. It is added to that slice. */
static double share_beyond(const struct job *job, const struct capsule *c, const double p[3], long k)
{
    const double step = job->v->voxel_size_m[2];
    double share = 0.0;
    if (k == 0) share += share_of(c, (const double[3]){p[0], p[1], p[2] - step});
    if (k + 1 == (long)job->v->n[2]) share += share_of(c, (const double[3]){p[0], p[1], p[2] + step});
    return share;
}

/* all: share of the fiber in the voxel, with the part beyond the grid. */
static void add_share(struct slab *s, size_t at, const struct capsule *c, double distance, double all)
{
    float share = (float)all, away = (float)distance;
    if (s->owner[at] != c->fiber) {
        s->owner[at] = c->fiber;
        s->share[at] = 0.0f;
    }
    if (share > s->share[at]) {
        s->density[at] += share - s->share[at];
        s->share[at] = share;
    }
    if (away < s->distance[at]) {
        s->distance[at] = away;
        for (int a = 0; a < 3; a++) s->direction[3 * at + (size_t)a] = (float)(c->d[a] / c->length);
    }
}

static void draw_capsule(const struct job *job, struct slab *s, const struct capsule *c, long z_from, long z_to)
{
    const struct direction_volume *v = job->v;
    const long n[2] = {(long)v->n[0], (long)v->n[1]};
    double reach = c->ramp_m + fmax(0.0, c->ramp_change_m) + 0.5 * c->width_m;
    long low[3], high[3];
    for (int a = 0; a < 3; a++) {
        low[a] = (long)ceil((fmin(c->a[a], c->a[a] + c->d[a]) - reach) * job->per_voxel[a] - 0.5);
        high[a] = (long)floor((fmax(c->a[a], c->a[a] + c->d[a]) + reach) * job->per_voxel[a] - 0.5);
    }
    low[2] = low[2] < z_from ? z_from : low[2];
    high[2] = high[2] >= z_to ? z_to - 1 : high[2];
    for (long k = low[2]; k <= high[2]; k++)
        for (long j = low[1]; j <= high[1]; j++)
            for (long i = low[0]; i <= high[0]; i++) {
                double p[3] = {((double)i + 0.5) * v->voxel_size_m[0], ((double)j + 0.5) * v->voxel_size_m[1],
                               ((double)k + 0.5) * v->voxel_size_m[2]};
                double along = 0.0, distance = axis_distance(c, p, &along);
                if (distance < 0.0 || distance >= reach) continue;
                size_t x = (size_t)((i % n[0] + n[0]) % n[0]), y = (size_t)((j % n[1] + n[1]) % n[1]);
                add_share(s, volume_index(v->n, x, y, (size_t)(k - z_from)), c, distance,
                          share_at(c, distance, along) + share_beyond(job, c, p, k));
            }
}

static status slab_init(struct slab *s, size_t n)
{
    s->owner = malloc(n * sizeof *s->owner);
    s->share = malloc(n * sizeof *s->share);
    s->density = malloc(n * sizeof *s->density);
    s->distance = malloc(n * sizeof *s->distance);
    s->direction = malloc(3 * n * sizeof *s->direction);
    return s->owner && s->share && s->density && s->distance && s->direction ? STATUS_OK : STATUS_NO_MEMORY;
}

static void slab_release(struct slab *s)
{
    free(s->owner);
    free(s->share);
    free(s->density);
    free(s->distance);
    free(s->direction);
}

static void store_slab(const struct job *job, const struct slab *s, long z_from, size_t n)
{
    size_t first = volume_index(job->v->n, 0, 0, (size_t)z_from);
    for (size_t i = 0; i < n; i++) {
        long byte = lround(255.0 * fmin((double)s->density[i], 1.0));
        job->v->density[first + i] = (uint8_t)byte;
        if (byte > 0) direction_volume_set(job->v, first + i, s->direction + 3 * i);
    }
}

static void draw_slab(void *context, size_t i_task, size_t i_thread)
{
    struct job *job = context;
    struct slab *s = &job->slab[i_thread];
    const struct fiber_set *f = job->f;
    const double *size = job->v->voxel_size_m;
    long z_from = (long)i_task * SLAB, z_to = z_from + SLAB < (long)job->v->n[2] ? z_from + SLAB : (long)job->v->n[2];
    size_t n = job->v->n[0] * job->v->n[1] * (size_t)(z_to - z_from);
    memset(s->owner, 0, n * sizeof *s->owner);
    memset(s->density, 0, n * sizeof *s->density);
    for (size_t i = 0; i < n; i++) s->distance[i] = INFINITY;
    for (size_t i = 0; i < f->n_fiber; i++) {
        for (size_t k = f->first_vertex[i]; k + 1 < f->first_vertex[i + 1]; k++) {
            struct capsule c;
            double margin =
                (double)fmaxf(fiber_radius_m(f, i, k), fiber_radius_m(f, i, k + 1)) + size[0] + size[1] + size[2];
            double low = job->z_low_m + (double)z_from * size[2] - margin,
                   high = job->z_low_m + (double)z_to * size[2] + margin;
            double z0 = (double)f->position_m[3 * k + 2], z1 = (double)f->position_m[3 * k + 5];
            if (fmax(z0, z1) < low || fmin(z0, z1) > high || !capsule_init(&c, job, i, k)) continue;
            draw_capsule(job, s, &c, z_from, z_to);
        }
    }
    store_slab(job, s, z_from, n);
}

/* Number of voxels for an edge length. The product is returned as a double, which cannot overflow. */
static double grid_for(const struct fiber_set *f, double height_m, double edge_m, double n[3])
{
    for (int a = 0; a < 2; a++) n[a] = fmax(1.0, round(f->tile_size_m[a] / edge_m));
    n[2] = fmax(1.0, ceil(height_m / edge_m));
    return n[0] * n[1] * n[2];
}

/* Chooses the edge length, the grid and its position. */
static status choose_grid(const struct fiber_set *f, const struct voxelise_option *o, double *edge_m, size_t n[3],
                          double size_m[3], double *z_low_m, struct error *err)
{
    double z_high_m, radius = 0.0, count[3];
    fiber_set_z_range_m(f, z_low_m, &z_high_m);
    for (size_t i = 0; i < f->n_fiber; i++) radius += (double)f->radius_m[i] / (double)f->n_fiber;
    bool given = !isnan(o->voxel_size_m);
    *edge_m = given ? o->voxel_size_m : 0.5 * radius;
    double height_m = z_high_m - *z_low_m, limit = (double)o->limit_bytes / BYTES_PER_VOXEL;
    if (given && !(*edge_m > 0.0 && *edge_m <= fmin(f->tile_size_m[0], f->tile_size_m[1])))
        return error_set(err, STATUS_INVALID, "cannot voxelise fibers with voxels of %g um: the tile has %g x %g mm",
                         1e6 * *edge_m, 1e3 * f->tile_size_m[0], 1e3 * f->tile_size_m[1]);
    while (grid_for(f, height_m, *edge_m, count) > limit) {
        if (given)
            return error_set(err, STATUS_TOO_LARGE,
                             "cannot voxelise fibers with voxels of %g um: %.0f x %.0f x %.0f voxels need %.0f MB, but "
                             "the limit is %.0f MB",
                             1e6 * *edge_m, count[0], count[1], count[2],
                             BYTES_PER_VOXEL * count[0] * count[1] * count[2] / 1e6, (double)o->limit_bytes / 1e6);
        if (count[0] * count[1] * count[2] <= 1.0)
            return error_set(err, STATUS_TOO_LARGE, "cannot voxelise fibers: no room for a single voxel");
        *edge_m *= 1.05;
    }
    for (int a = 0; a < 3; a++) n[a] = (size_t)count[a];
    for (int a = 0; a < 2; a++) size_m[a] = f->tile_size_m[a] / count[a];
    size_m[2] = *edge_m;
    *z_low_m = z_high_m - count[2] * *edge_m; /* grid and cloth have the same top, as for fibers */
    return STATUS_OK;
}

status fibers_voxelise(const struct fiber_set *f, const struct voxelise_option *o, struct thread_pool *pool,
                       const struct progress *progress, struct direction_volume *v, double *voxel_size_m,
                       struct error *err)
{
    size_t n[3], n_thread = thread_pool_n_thread(pool);
    double size_m[3];
    struct job job = {.f = f, .v = v};
    memset(v, 0, sizeof *v);
    status s = choose_grid(f, o, voxel_size_m, n, size_m, &job.z_low_m, err);
    if (s == STATUS_OK) s = direction_volume_init(v, n, size_m, err);
    if (s != STATUS_OK) return s;
    for (int a = 0; a < 3; a++) job.per_voxel[a] = 1.0 / size_m[a];
    job.slab = calloc(n_thread, sizeof *job.slab);
    for (size_t i = 0; i < n_thread && job.slab != NULL && s == STATUS_OK; i++)
        s = slab_init(&job.slab[i], n[0] * n[1] * SLAB);
    if (job.slab == NULL || s != STATUS_OK) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot voxelise fibers: out of memory");
        goto out;
    }
    s = thread_pool_run(pool, (n[2] + SLAB - 1) / SLAB, draw_slab, &job, progress);
    if (s != STATUS_OK) error_set(err, s, "voxelising fibers was cancelled");
out:
    for (size_t i = 0; i < n_thread && job.slab != NULL; i++) slab_release(&job.slab[i]);
    free(job.slab);
    if (s != STATUS_OK) {
        direction_volume_release(v);
        memset(v, 0, sizeof *v);
    }
    return s;
}
