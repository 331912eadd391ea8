/* Makes a CT-like volume from fibers.
 *
 * A voxel's share inside one fiber is clamp(1/2 + (r' - d) / w), where d is the distance of its centre from the axis
 * and w its width. A ramp of width w has the second moment of a box of width w in any direction, and r'^2 = r^2 -
 * w^2/12 preserves the area of the section: the integral of 2 pi d clamp(...) is pi (r'^2 + w^2/12), if the ramp
 * ends before the axis (r' >= w/2, r >= 0.58 w). Thinner fibers are cones 3 r^2 / w^2 (1 - d/w), which preserve the
 * area too. Shares of different fibers add, up to 1.
 *
 * Slices are drawn, blurred along x and y, and kept in a ring buffer until the blur along z has passed, so only the
 * result is as large as the volume. Noise is a function of the index of the voxel. So the result does not depend on
 * how many slices are processed together. */
#include "base/rng.h"
#include "geometry/phantom/phantom_strand.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SLAB = 4 };

void phantom_scan_option_default(struct phantom_scan_option *o)
{
    *o = (struct phantom_scan_option){.seed = 1, .voxel_size_m = 2e-6, .blur_sd_voxel = 0.7, .snr = 5.0};
}

struct scan {
    const struct fiber_set *f;
    const struct phantom_scan_option *o;
    struct volume *v;
    size_t n_slab;         /* number of slices processed together */
    size_t first, n_drawn; /* slices of the slab */
    float *drawn;          /* of the slab: sums of the shares of all fibers */
    uint32_t *owner;       /* of the slab: number + 1 of the fiber that last touched a voxel */
    float *share;          /* of the slab: share of that fiber */
    float *blurred;        /* blurred along x and y; slice k at k % n_held */
    size_t n_held;
    float *kernel;
    long reach;  /* of the blur */
    float *ring; /* by distance from the axis in voxels */
    size_t n_ring;
};

struct capsule {
    double a[3], d[3], length2; /* voxels */
    double r, r_ramp, scale;    /* scale: below 1 for fibers thinner than the ramp */
    /* The ends of a fiber are flat, so that it joins its continuation in the next tile without a bulge. */
    double end[2][3], outward[2][3];
};

static double axis_distance(const struct capsule *c, const double p[3])
{
    double q[3] = {p[0] - c->a[0], p[1] - c->a[1], p[2] - c->a[2]};
    double t = (q[0] * c->d[0] + q[1] * c->d[1] + q[2] * c->d[2]) / c->length2;
    t = t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t;
    for (int a = 0; a < 3; a++) q[a] -= t * c->d[a];
    return sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
}

static bool behind_an_end(const struct capsule *c, const double p[3])
{
    for (int e = 0; e < 2; e++) {
        double along = 0.0, distance2 = 0.0;
        for (int a = 0; a < 3; a++) {
            double q = p[a] - c->end[e][a];
            along += q * c->outward[e][a];
            distance2 += q * q;
        }
        if (distance2 < 2.0 * (c->r + 1.0) * (c->r + 1.0) && (e == 0 ? along > 0.0 : along >= 0.0)) return true;
    }
    return false;
}

static void fiber_ends(struct capsule *c, const struct fiber_set *f, size_t i, double per_m)
{
    size_t first = f->first_vertex[i], last = f->first_vertex[i + 1] - 1;
    const size_t at[2] = {first, last}, inner[2] = {first + 1, last - 1};
    for (int e = 0; e < 2; e++)
        for (size_t a = 0; a < 3; a++) {
            c->end[e][a] = (double)f->position_m[3 * at[e] + a] * per_m;
            c->outward[e][a] = c->end[e][a] - (double)f->position_m[3 * inner[e] + a] * per_m;
        }
}

static void add_share(struct scan *s, size_t at, uint32_t fiber, float share)
{
    if (s->owner[at] != fiber) {
        s->owner[at] = fiber;
        s->share[at] = 0.0f;
    }
    if (share <= s->share[at]) return;
    s->drawn[at] += share - s->share[at];
    s->share[at] = share;
}

static void draw_capsule(struct scan *s, const struct capsule *c, uint32_t fiber, long z_from, long z_to)
{
    long low[3], high[3], n[2] = {(long)s->v->n[0], (long)s->v->n[1]};
    double reach = c->r_ramp + 0.5;
    for (int a = 0; a < 3; a++) {
        low[a] = (long)floor(fmin(c->a[a], c->a[a] + c->d[a]) - reach - 0.5);
        high[a] = (long)ceil(fmax(c->a[a], c->a[a] + c->d[a]) + reach - 0.5);
    }
    low[2] = low[2] < z_from ? z_from : low[2];
    high[2] = high[2] >= z_to ? z_to - 1 : high[2];
    for (long k = low[2]; k <= high[2]; k++)
        for (long j = low[1]; j <= high[1]; j++)
            for (long i = low[0]; i <= high[0]; i++) {
                double p[3] = {(double)i + 0.5, (double)j + 0.5, (double)k + 0.5};
                double share = 0.5 + c->r_ramp - axis_distance(c, p);
                if (!(share > 0.0) || behind_an_end(c, p)) continue;
                size_t x = (size_t)((i % n[0] + n[0]) % n[0]), y = (size_t)((j % n[1] + n[1]) % n[1]);
                add_share(s, volume_index(s->v->n, x, y, (size_t)k - s->first), fiber,
                          (float)(c->scale * fmin(share, 1.0)));
            }
}

static void draw_slab(void *context, size_t i_task, size_t i_thread)
{
    struct scan *s = context;
    const struct fiber_set *f = s->f;
    double per_m = 1.0 / s->o->voxel_size_m;
    long z_end = (long)(s->first + s->n_drawn), z_from = (long)(s->first + i_task * SLAB),
         z_to = z_from + SLAB < z_end ? z_from + SLAB : z_end;
    size_t at = volume_index(s->v->n, 0, 0, i_task * SLAB), end = volume_index(s->v->n, 0, 0, (size_t)z_to - s->first);
    (void)i_thread;
    memset(s->drawn + at, 0, (end - at) * sizeof *s->drawn);
    memset(s->owner + at, 0, (end - at) * sizeof *s->owner);
    for (size_t i = 0; i < f->n_fiber; i++) {
        double r = (double)f->radius_m[i] * per_m;
        struct capsule c = {.r = r, .r_ramp = sqrt(fmax(0.0, r * r - 1.0 / 12.0)), .scale = 1.0};
        if (c.r_ramp < 0.5) {
            c.r_ramp = 0.5;
            c.scale = 3.0 * r * r;
        }
        fiber_ends(&c, f, i, per_m);
        for (size_t k = f->first_vertex[i]; k + 1 < f->first_vertex[i + 1]; k++) {
            const float *p = f->position_m + 3 * k;
            double z0 = (double)p[2] * per_m, z1 = (double)p[5] * per_m;
            if (fmax(z0, z1) + r + 1.0 < (double)z_from || fmin(z0, z1) - r - 1.0 > (double)z_to) continue;
            c.length2 = 0.0;
            for (int a = 0; a < 3; a++) {
                c.a[a] = (double)p[a] * per_m;
                c.d[a] = (double)p[3 + a] * per_m - c.a[a];
                c.length2 += c.d[a] * c.d[a];
            }
            if (c.length2 <= 0.0) continue;
            draw_capsule(s, &c, (uint32_t)i + 1, z_from, z_to);
        }
    }
    for (; at < end; at++) s->drawn[at] = fminf(s->drawn[at], 1.0f);
}

/* Blurs one slice along x and y (periodic) into `blurred`. */
static void blur_slice(void *context, size_t i_task, size_t i_thread)
{
    struct scan *s = context;
    const size_t *n = s->v->n;
    float *from = s->drawn + volume_index(n, 0, 0, i_task), *row = s->share + volume_index(n, 0, 0, i_task);
    float *to = s->blurred + volume_index(n, 0, 0, (s->first + i_task) % s->n_held);
    (void)i_thread;
    for (size_t j = 0; j < n[1]; j++) {
        memset(row + j * n[0], 0, n[0] * sizeof *row);
        for (long m = -s->reach; m <= s->reach; m++) {
            size_t shift =
                (size_t)((long)((size_t)s->reach * n[0]) + m) % n[0]; /* i + m, from 0 on again at the end of the row */
            float w = s->kernel[m + s->reach];
            const float *in = from + j * n[0];
            float *out = row + j * n[0];
            for (size_t i = 0; i < n[0] - shift; i++) out[i] += w * in[i + shift];
            for (size_t i = n[0] - shift; i < n[0]; i++) out[i] += w * in[i + shift - n[0]];
        }
    }
    for (size_t j = 0; j < n[1]; j++) {
        memset(to + j * n[0], 0, n[0] * sizeof *to);
        for (long m = -s->reach; m <= s->reach; m++) {
            const float *other = row + (size_t)((long)(j + (size_t)s->reach * n[1]) + m) % n[1] * n[0];
            for (size_t i = 0; i < n[0]; i++) to[j * n[0] + i] += s->kernel[m + s->reach] * other[i];
        }
    }
}

static double disturb(const struct scan *s, double value, size_t at, size_t i, size_t j)
{
    const struct phantom_scan_option *o = s->o;
    const struct rng_key key = {.seed = o->seed, .iteration = STREAM_NOISE};
    struct rng rng;
    rng_start(&rng, &key, (uint32_t)at, (uint32_t)((uint64_t)at >> 32));
    value *= 1.0 + o->gradient * ((double)i + 0.5) / (double)s->v->n[0];
    if (o->snr > 0.0) {
        double normal[2];
        rng_normal_pair(&rng, normal);
        value += normal[0] / o->snr;
    }
    if (o->poisson_count > 0.0) {
        double void_level = 0.1, mean = o->poisson_count * fmax(0.0, void_level + 0.9 * value);
        value = ((double)rng_poisson(&rng, mean) / o->poisson_count - void_level) / 0.9;
    }
    if (s->ring != NULL) {
        double x = (double)i - 0.45 * (double)s->v->n[0], y = (double)j - 0.55 * (double)s->v->n[1], rho = hypot(x, y);
        size_t k = (size_t)rho;
        value += (1.0 - (rho - (double)k)) * (double)s->ring[k] + (rho - (double)k) * (double)s->ring[k + 1];
    }
    return value;
}

/* Blurs along z (void outside) and adds the errors of a scanner. */
static void finish_slice(void *context, size_t i_task, size_t i_thread)
{
    struct scan *s = context;
    const size_t *n = s->v->n, k = s->first + i_task;
    (void)i_thread;
    scratch_keep_within(s->v->space);
    for (size_t j = 0; j < n[1]; j++)
        for (size_t i = 0; i < n[0]; i++) {
            double sum = 0.0;
            for (long m = -s->reach; m <= s->reach; m++) {
                long z = (long)k + m;
                if (z >= 0 && z < (long)n[2])
                    sum += (double)s->kernel[m + s->reach] *
                           (double)s->blurred[volume_index(n, i, j, (size_t)z % s->n_held)];
            }
            size_t at = volume_index(n, i, j, k);
            s->v->density[at] = (float)disturb(s, sum, at, i, j);
        }
}

static status scan_init(struct scan *s, struct error *err)
{
    size_t n_slice = s->v->n[0] * s->v->n[1],
           slice_bytes = n_slice * (sizeof *s->drawn + sizeof *s->owner + sizeof *s->share + sizeof *s->blurred);
    double sd = s->o->blur_sd_voxel;
    s->reach = (long)ceil(4.0 * sd);
    s->n_slab = scratch_buffer_bytes(s->v->space) / slice_bytes;
    s->n_slab = s->n_slab < 2 * SLAB ? 2 * SLAB : s->n_slab > s->v->n[2] ? s->v->n[2] : s->n_slab;
    s->n_held = s->n_slab + 2 * (size_t)s->reach;
    s->drawn = malloc(s->n_slab * n_slice * sizeof *s->drawn);
    s->owner = malloc(s->n_slab * n_slice * sizeof *s->owner);
    s->share = malloc(s->n_slab * n_slice * sizeof *s->share);
    s->blurred = malloc(s->n_held * n_slice * sizeof *s->blurred);
    s->kernel = calloc((size_t)(2 * s->reach + 1), sizeof *s->kernel);
    if (s->o->ring_amplitude > 0.0) {
        s->n_ring = (size_t)hypot((double)s->v->n[0], (double)s->v->n[1]) + 3;
        s->ring = calloc(s->n_ring, sizeof *s->ring);
    }
    if (!s->drawn || !s->owner || !s->share || !s->blurred || !s->kernel || (s->n_ring > 0 && !s->ring))
        return error_set(err, STATUS_NO_MEMORY, "cannot scan phantom of %zu voxels: out of memory",
                         volume_n_voxel(s->v->n));
    double sum = 0.0;
    for (long m = -s->reach; m <= s->reach; m++) sum += sd > 0.0 ? exp(-0.5 * (double)(m * m) / (sd * sd)) : 1.0;
    for (long m = -s->reach; m <= s->reach; m++)
        s->kernel[m + s->reach] = (float)((sd > 0.0 ? exp(-0.5 * (double)(m * m) / (sd * sd)) : 1.0) / sum);
    const struct rng_key key = {.seed = s->o->seed, .iteration = STREAM_RING};
    for (size_t k = 0; k < s->n_ring; k++) {
        struct rng rng;
        double normal[2];
        rng_start(&rng, &key, (uint32_t)k, 0);
        rng_normal_pair(&rng, normal);
        s->ring[k] = (float)(s->o->ring_amplitude * normal[0]);
    }
    return STATUS_OK;
}

static status check(const struct phantom_scan_option *o, struct error *err)
{
    if (!(o->voxel_size_m > 0.0))
        return error_set_field(err, STATUS_INVALID, "voxel_size_m", "the voxel size must be positive");
    if (!(o->blur_sd_voxel >= 0.0 && o->blur_sd_voxel <= 10.0))
        return error_set_field(err, STATUS_INVALID, "blur_sd_voxel", "blur of %g voxels: it must lie between 0 and 10",
                               o->blur_sd_voxel);
    if (!(o->snr >= 0.0) || !(o->poisson_count >= 0.0) || !(o->ring_amplitude >= 0.0) || !(fabs(o->gradient) <= 1.0))
        return error_set_field(err, STATUS_INVALID, "snr",
                               "noise options must not be negative, the gradient within -1 and 1");
    return STATUS_OK;
}

/* Draws and blurs slices from the end of the last slab on, until those up to `wanted` are held. */
static status hold_slices(struct scan *s, size_t *ready, size_t wanted, struct thread_pool *pool,
                          const struct progress *quiet)
{
    status st = STATUS_OK;
    while (*ready < wanted && st == STATUS_OK) {
        s->first = *ready;
        s->n_drawn = wanted - *ready < s->n_slab ? wanted - *ready : s->n_slab;
        st = thread_pool_run(pool, (s->n_drawn + SLAB - 1) / SLAB, draw_slab, s, quiet);
        if (st == STATUS_OK) st = thread_pool_run(pool, s->n_drawn, blur_slice, s, quiet);
        *ready += s->n_drawn;
    }
    return st;
}

status phantom_scan_in(const struct fiber_set *f, const size_t n[3], const struct phantom_scan_option *o,
                       struct scratch_space *space, struct thread_pool *pool, const struct progress *progress,
                       struct volume *v, struct error *err)
{
    status st = check(o, err);
    if (st != STATUS_OK) return st;
    const double size_m[3] = {o->voxel_size_m, o->voxel_size_m, o->voxel_size_m};
    st = volume_init_in(v, n, size_m, space, err);
    if (st != STATUS_OK) return st;
    struct scan s = {.f = f, .o = o, .v = v};
    const struct progress quiet = progress_silent(progress);
    size_t ready = 0;
    st = scan_init(&s, err);
    if (st != STATUS_OK) goto out;
    for (size_t k = 0; k < n[2] && st == STATUS_OK; k += s.n_slab) {
        size_t end = k + s.n_slab < n[2] ? k + s.n_slab : n[2], reached = end + (size_t)s.reach;
        st = hold_slices(&s, &ready, reached < n[2] ? reached : n[2], pool, &quiet);
        s.first = k;
        if (st == STATUS_OK) st = thread_pool_run(pool, end - k, finish_slice, &s, &quiet);
        progress_report(progress, (double)end / (double)n[2]);
    }
    if (st != STATUS_OK) error_set(err, st, "cancelled while scanning the phantom");
out:
    free(s.drawn);
    free(s.owner);
    free(s.share);
    free(s.blurred);
    free(s.kernel);
    free(s.ring);
    if (st != STATUS_OK) volume_release(v);
    return st;
}

status phantom_scan(const struct fiber_set *f, const size_t n[3], const struct phantom_scan_option *o,
                    struct thread_pool *pool, const struct progress *progress, struct volume *v, struct error *err)
{
    return phantom_scan_in(f, n, o, NULL, pool, progress, v, err);
}
