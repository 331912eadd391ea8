/* Makes a CT-like volume from fibers.
 *
 * A voxel's share inside one fiber is clamp(1/2 + (r' - d) / w), where d is the distance of its centre from the axis
 * and w its width. A ramp of width w has the second moment of a box of width w in any direction, and r'^2 = r^2 -
 * w^2/12 preserves the area of the section: the integral of 2 pi d clamp(...) is pi (r'^2 + w^2/12), if the ramp
 * ends before the axis (r' >= w/2, r >= 0.58 w). Thinner fibers are cones 3 r^2 / w^2 (1 - d/w), which preserve the
 * area too. Shares of different fibers add, up to 1.
 *
 * Sections that are not discs are explained in phantom_section.h.
 *
 * Slices are drawn, blurred along x and y, and kept in ring buffers until the blurs along z have passed, so only the
 * result is as large as the volume. Noise is a function of the index of the voxel. So the result does not depend on
 * how many slices are processed together.
 *
 * Beam hardening lowers the signal of a voxel in proportion to the material around it, by a Gaussian of
 * HARDENING_SD_VOXEL. Phase fringes add a multiple of the signal's difference from a copy that is blurred by
 * FRINGE_SD_VOXEL more: that is the Laplacian of free propagation at a finite resolution, bright inside an outline and
 * dark outside. Correlated noise is white noise after a Gaussian blur, scaled back to its standard deviation. */
#include "base/rng.h"
#include "geometry/phantom/phantom.h"
#include "geometry/phantom/phantom_draw.h"
#include "geometry/phantom/slice_blur.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SLAB = 4 };

static const double FRINGE_SD_VOXEL = 1.5, HARDENING_SD_VOXEL = 12.0;

void phantom_scan_option_default(struct phantom_scan_option *o)
{
    *o = (struct phantom_scan_option){.seed = 1, .voxel_size_m = 2e-6, .blur_sd_voxel = 0.7, .snr = 5.0};
}

/* The blurs of the signal (its point spread, and for the two effects) and of the white noise. */
enum blur { BLUR_POINT, BLUR_FRINGE, BLUR_HARDENING, BLUR_NOISE, N_BLUR };

struct scan {
    const struct phantom_scan_option *o;
    struct volume *v;
    size_t n_slab; /* number of slices processed together */
    struct phantom_slab slab;
    size_t first; /* slice of the first task */
    float *white; /* of the slab: white noise; NULL if the noise is not correlated */
    bool used[N_BLUR];
    double sd_voxel[N_BLUR];
    struct slice_blur blur[N_BLUR];
    float *ring; /* by distance from the axis in voxels */
    size_t n_ring;
};

static void draw_slab(void *context, size_t i_task, size_t i_thread)
{
    struct scan *s = context;
    size_t to = (i_task + 1) * SLAB;
    (void)i_thread;
    phantom_slab_draw(&s->slab, i_task * SLAB, to < s->slab.n_slice ? to : s->slab.n_slice);
}

static void make_white(struct scan *s, size_t k, float *to)
{
    const struct rng_key key = {.seed = s->o->seed, .iteration = STREAM_WHITE};
    size_t n = s->v->n[0] * s->v->n[1];
    for (size_t i = 0; i < n; i++) {
        struct rng rng;
        double normal[2];
        rng_start(&rng, &key, (uint32_t)(k * n + i), (uint32_t)((uint64_t)(k * n + i) >> 32));
        rng_normal_pair(&rng, normal);
        to[i] = (float)normal[0];
    }
}

/* Blurs one slice of the slab along x and y. */
static void blur_slice(void *context, size_t i_task, size_t i_thread)
{
    struct scan *s = context;
    size_t at = volume_index(s->v->n, 0, 0, i_task), k = s->slab.first + i_task;
    (void)i_thread;
    if (s->used[BLUR_NOISE]) make_white(s, k, s->white + at);
    for (int b = 0; b < N_BLUR; b++)
        if (s->used[b])
            slice_blur_take(&s->blur[b], k, (b == BLUR_NOISE ? s->white : s->slab.drawn) + at, s->slab.share + at);
}

/* Signal at a voxel after point spread, fringes and hardening. */
static double signal_at(const struct scan *s, size_t i, size_t j, size_t k)
{
    const struct phantom_scan_option *o = s->o;
    double value = slice_blur_at(&s->blur[BLUR_POINT], i, j, k), material = 0.0;
    if (s->used[BLUR_HARDENING]) material = slice_blur_at(&s->blur[BLUR_HARDENING], i, j, k);
    if (s->used[BLUR_FRINGE]) value += o->phase_fringes * (value - slice_blur_at(&s->blur[BLUR_FRINGE], i, j, k));
    return s->used[BLUR_HARDENING] ? value * (1.0 - o->beam_hardening * material) : value;
}

/* correlated: the blurred white noise, with standard deviation 1. */
static double disturb(const struct scan *s, double value, double correlated, const size_t at[3])
{
    const struct phantom_scan_option *o = s->o;
    const struct rng_key key = {.seed = o->seed, .iteration = STREAM_NOISE};
    size_t i = at[0], j = at[1], voxel = volume_index(s->v->n, i, j, at[2]);
    struct rng rng;
    rng_start(&rng, &key, (uint32_t)voxel, (uint32_t)((uint64_t)voxel >> 32));
    value *= 1.0 + o->gradient * ((double)i + 0.5) / (double)s->v->n[0];
    if (o->snr > 0.0) {
        double normal[2];
        rng_normal_pair(&rng, normal);
        value += (s->used[BLUR_NOISE] ? correlated : normal[0]) / o->snr;
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
    const struct slice_blur *noise = s->used[BLUR_NOISE] ? &s->blur[BLUR_NOISE] : NULL;
    double noise_scale = noise != NULL ? 1.0 / slice_blur_noise_sd(noise, k) : 0.0;
    (void)i_thread;
    scratch_keep_within(s->v->space);
    for (size_t j = 0; j < n[1]; j++)
        for (size_t i = 0; i < n[0]; i++) {
            double correlated = noise != NULL ? noise_scale * slice_blur_at(noise, i, j, k) : 0.0;
            s->v->density[volume_index(n, i, j, k)] =
                (float)disturb(s, signal_at(s, i, j, k), correlated, (const size_t[3]){i, j, k});
        }
}

static void choose_blurs(struct scan *s)
{
    const struct phantom_scan_option *o = s->o;
    s->used[BLUR_POINT] = true;
    s->sd_voxel[BLUR_POINT] = o->blur_sd_voxel;
    s->used[BLUR_FRINGE] = o->phase_fringes > 0.0;
    s->sd_voxel[BLUR_FRINGE] = hypot(o->blur_sd_voxel, FRINGE_SD_VOXEL);
    s->used[BLUR_HARDENING] = o->beam_hardening > 0.0;
    s->sd_voxel[BLUR_HARDENING] = HARDENING_SD_VOXEL;
    s->used[BLUR_NOISE] = o->noise_sd_voxel > 0.0 && o->snr > 0.0;
    s->sd_voxel[BLUR_NOISE] = o->noise_sd_voxel;
}

/* Slices on each side of a slab that the blurs take. */
static size_t largest_reach(const struct scan *s)
{
    long reach = 0;
    for (int b = 0; b < N_BLUR; b++)
        if (s->used[b] && slice_blur_reach(s->sd_voxel[b]) > reach) reach = slice_blur_reach(s->sd_voxel[b]);
    return (size_t)reach;
}

static status make_ring(struct scan *s, struct error *err)
{
    if (!(s->o->ring_amplitude > 0.0)) return STATUS_OK;
    s->n_ring = (size_t)hypot((double)s->v->n[0], (double)s->v->n[1]) + 3;
    s->ring = calloc(s->n_ring, sizeof *s->ring);
    if (s->ring == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot scan phantom: out of memory");
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

static status scan_init(struct scan *s, struct error *err)
{
    struct phantom_slab *d = &s->slab;
    size_t n_slice = s->v->n[0] * s->v->n[1],
           slice_bytes = n_slice * (sizeof *d->drawn + sizeof *d->owner + sizeof *d->share + sizeof(float));
    s->n_slab = scratch_buffer_bytes(s->v->space) / slice_bytes;
    s->n_slab = s->n_slab < 2 * SLAB ? 2 * SLAB : s->n_slab > s->v->n[2] ? s->v->n[2] : s->n_slab;
    const bool disc = phantom_slab_is_disc(d);
    d->drawn = malloc(s->n_slab * n_slice * sizeof *d->drawn);
    d->owner = malloc(s->n_slab * n_slice * sizeof *d->owner);
    d->share = malloc(s->n_slab * n_slice * sizeof *d->share);
    if (!disc) d->apart = malloc(s->n_slab * n_slice * sizeof *d->apart);
    if (s->used[BLUR_NOISE]) s->white = malloc(s->n_slab * n_slice * sizeof *s->white);
    if (!d->drawn || !d->owner || !d->share || (!disc && !d->apart) || (s->used[BLUR_NOISE] && !s->white))
        return error_set(err, STATUS_NO_MEMORY, "cannot scan phantom of %zu voxels: out of memory",
                         volume_n_voxel(s->v->n));
    status st = STATUS_OK;
    for (int b = 0; b < N_BLUR && st == STATUS_OK; b++)
        if (s->used[b])
            st = slice_blur_init(&s->blur[b], s->sd_voxel[b], s->v->n, s->n_slab + 2 * largest_reach(s), err);
    return st == STATUS_OK ? make_ring(s, err) : st;
}

static void scan_release(struct scan *s)
{
    free(s->slab.drawn);
    free(s->slab.owner);
    free(s->slab.share);
    free(s->slab.apart);
    free(s->white);
    free(s->ring);
    for (int b = 0; b < N_BLUR; b++) slice_blur_release(&s->blur[b]);
}

static status check_between(const char *field, double value, double lower, double upper, struct error *err)
{
    if (value >= lower && value <= upper) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, field, "scan option '%s' is %g, but must be between %g and %g", field,
                           value, lower, upper);
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
    status st = check_between("noise_sd_voxel", o->noise_sd_voxel, 0.0, 10.0, err);
    if (st == STATUS_OK) st = check_between("beam_hardening", o->beam_hardening, 0.0, 1.0, err);
    if (st == STATUS_OK) st = check_between("phase_fringes", o->phase_fringes, 0.0, 5.0, err);
    return st == STATUS_OK ? phantom_section_check(&o->section, err) : st;
}

/* Draws and blurs slices from the end of the last slab on, until those up to `wanted` are held. */
static status hold_slices(struct scan *s, size_t *ready, size_t wanted, struct thread_pool *pool,
                          const struct progress *quiet)
{
    status st = STATUS_OK;
    while (*ready < wanted && st == STATUS_OK) {
        size_t n = wanted - *ready < s->n_slab ? wanted - *ready : s->n_slab;
        s->slab.first = *ready;
        s->slab.n_slice = n;
        st = thread_pool_run(pool, (n + SLAB - 1) / SLAB, draw_slab, s, quiet);
        if (st == STATUS_OK) st = thread_pool_run(pool, n, blur_slice, s, quiet);
        *ready += n;
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
    struct scan s = {.o = o, .v = v};
    s.slab = (struct phantom_slab){.f = f, .voxel_size_m = o->voxel_size_m, .n = {n[0], n[1], n[2]}};
    s.slab.section = o->own_sections ? NULL : &o->section;
    choose_blurs(&s);
    const size_t reach = largest_reach(&s);
    const struct progress quiet = progress_silent(progress);
    size_t ready = 0;
    st = scan_init(&s, err);
    if (st != STATUS_OK) goto out;
    for (size_t k = 0; k < n[2] && st == STATUS_OK; k += s.n_slab) {
        size_t end = k + s.n_slab < n[2] ? k + s.n_slab : n[2], reached = end + reach;
        st = hold_slices(&s, &ready, reached < n[2] ? reached : n[2], pool, &quiet);
        s.first = k;
        if (st == STATUS_OK) st = thread_pool_run(pool, end - k, finish_slice, &s, &quiet);
        progress_report(progress, (double)end / (double)n[2]);
    }
    if (st != STATUS_OK) error_set(err, st, "cancelled while scanning the phantom");
out:
    scan_release(&s);
    if (st != STATUS_OK) volume_release(v);
    return st;
}

status phantom_scan(const struct fiber_set *f, const size_t n[3], const struct phantom_scan_option *o,
                    struct thread_pool *pool, const struct progress *progress, struct volume *v, struct error *err)
{
    return phantom_scan_in(f, n, o, NULL, pool, progress, v, err);
}
