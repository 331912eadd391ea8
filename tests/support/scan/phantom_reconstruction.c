#include "tests/support/scan/phantom_reconstruction.h"

#include "base/clock.h"
#include "base/rng.h"
#include "geometry/volume/density_map.h"
#include "geometry/volume/volume_align.h"

#include <math.h>

void phantom_cloth_of_diameter(struct phantom_option *o, enum phantom_weave weave, double diameter_voxel)
{
    phantom_option_default(o, weave);
    double scale = diameter_voxel / 7.0;
    for (int a = 0; a < 3; a++) o->fiber_radius_m[a] = 0.5 * diameter_voxel * o->voxel_size_m;
    o->pile_height_m *= scale;
    o->felt_tile_m *= scale;
    o->felt_thickness_m *= scale;
    if (weave == PHANTOM_PLAIN || weave == PHANTOM_VELVET) o->n_yarn[0] = o->n_yarn[1] = 4;
}

/* Compares the directions with the truth, outside of the measured time. */
static status compare(struct phantom_reconstruction *r, const struct direction_volume *d, struct thread_pool *pool,
                      struct direction_compare *result, struct error *err)
{
    double start_s = clock_monotonic_s(), start_cpu_s = clock_process_s();
    status s = compare_directions(&r->truth, d, pool, result, err);
    r->wall_s -= clock_monotonic_s() - start_s;
    r->cpu_s -= clock_process_s() - start_cpu_s;
    return s;
}

/* Grades the scan, as a job does before directions are transferred, outside of the measured time. */
static status grade(struct phantom_reconstruction *r, struct thread_pool *pool, struct error *err)
{
    double start_s = clock_monotonic_s(), start_cpu_s = clock_process_s();
    status s = reconstruct_grade(&r->v, &r->found, pool, &r->report, NULL, err);
    r->grade = r->report.grade;
    r->wall_s -= clock_monotonic_s() - start_s;
    r->cpu_s -= clock_process_s() - start_cpu_s;
    return s;
}

/* Sum of the densities in voxels, over the volume of fibers. */
static double volume_ratio(const struct fiber_set *f, const struct direction_volume *d)
{
    double sum = 0.0, volume_m3 = 0.0;
    for (size_t i = 0; i < volume_n_voxel(d->n); i++) sum += (double)d->density[i] / 255.0;
    for (size_t i = 0; i < f->n_fiber; i++)
        for (size_t k = f->first_vertex[i]; k + 1 < f->first_vertex[i + 1]; k++) {
            const double r = 0.5 * (double)(fiber_radius_m(f, i, k) + fiber_radius_m(f, i, k + 1));
            double length2 = 0.0;
            for (size_t a = 0; a < 3; a++) {
                const double step = (double)f->position_m[3 * k + 3 + a] - (double)f->position_m[3 * k + a];
                length2 += step * step;
            }
            volume_m3 += M_PI * r * r * sqrt(length2);
        }
    return sum * d->voxel_size_m[0] * d->voxel_size_m[1] * d->voxel_size_m[2] / volume_m3;
}

static status reconstruct(struct phantom_reconstruction *r, struct thread_pool *pool, struct error *err)
{
    struct direction_volume d = {0};
    struct density_modes m;
    status s = density_modes_find(&r->v, &m, err);
    if (s == STATUS_OK)
        s = scan_densities_map(&r->v, m.low, m.high, r->option.fiber_diameter_voxel, pool, &r->report.noise, err);
    if (s == STATUS_OK) s = reconstruct_lumens(&r->v, &r->option, pool, &r->report, err);
    if (s == STATUS_OK) s = reconstruct_refill_lumens(&r->v, &r->option, pool, NULL, &r->report, err);
    if (s == STATUS_OK) s = reconstruct_orientation(&r->v, &r->option, pool, NULL, &d, &r->report, err);
    if (s == STATUS_OK) s = compare(r, &d, pool, &r->filtered, err);
    if (s == STATUS_OK) s = reconstruct_redirect(&r->v, &d, &r->option, pool, NULL, &r->report, err);
    if (s == STATUS_OK) s = compare(r, &d, pool, &r->redirected, err);
    if (s == STATUS_OK) s = reconstruct_fibers(&r->v, &d, &r->option, pool, NULL, &r->found, &r->report, err);
    if (s == STATUS_OK) s = grade(r, pool, err);
    if (s == STATUS_OK) s = reconstruct_transfer(&r->found, &d, pool, NULL, &r->report, err);
    if (s == STATUS_OK) s = compare(r, &d, pool, &r->transferred, err);
    if (s == STATUS_OK) r->volume_ratio = volume_ratio(&r->truth, &d);
    direction_volume_release(&d);
    return s;
}

/* Replaces the scan by one with thicker slices: means over blocks of a scan with voxels of half the size. The noise is
 * that of the option. */
static status thicken(const struct phantom_option *o, const struct phantom_scan_option *scan, const size_t n_voxel[3],
                      struct phantom_reconstruction *r, struct thread_pool *pool, struct error *err)
{
    struct phantom_scan_option fine_scan = *scan;
    const size_t block[3] = {2, 2, (size_t)lround(2.0 * r->slice_voxel)};
    size_t n_fine[3] = {2 * n_voxel[0], 2 * n_voxel[1], 2 * n_voxel[2] / block[2] * block[2]}, n[3];
    struct volume fine;
    fine_scan.voxel_size_m = 0.5 * o->voxel_size_m;
    fine_scan.blur_sd_voxel *= 2.0;
    fine_scan.snr = 0.0;
    for (int a = 0; a < 3; a++) n[a] = n_fine[a] / block[a];
    const double size_m[3] = {o->voxel_size_m, o->voxel_size_m, o->voxel_size_m * r->slice_voxel};
    status s = phantom_scan(&r->truth, n_fine, &fine_scan, pool, NULL, &fine, err);
    if (s == STATUS_OK) s = volume_init(&r->v, n, size_m, err);
    for (size_t at = 0; at < volume_n_voxel(n_fine) && s == STATUS_OK; at++) {
        size_t i = at % n_fine[0], j = at / n_fine[0] % n_fine[1], k = at / (n_fine[0] * n_fine[1]);
        r->v.density[volume_index(n, i / 2, j / 2, k / block[2])] += fine.density[at] / (float)(4 * block[2]);
    }
    volume_release(&fine);
    const struct rng_key key = {.seed = scan->seed};
    for (size_t at = 0; at < volume_n_voxel(n) && s == STATUS_OK && scan->snr > 0.0; at++) {
        struct rng rng;
        double normal[2];
        rng_start(&rng, &key, (uint32_t)at, 0);
        rng_normal_pair(&rng, normal);
        r->v.density[at] += (float)(normal[0] / scan->snr);
    }
    return s;
}

/* Makes cubes of the voxels, as a job does. */
static status make_cubes(struct phantom_reconstruction *r, struct thread_pool *pool, struct error *err)
{
    static const double identity[9] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
    struct volume cubes;
    size_t n[3];
    volume_resampled_shape(r->v.n, r->v.voxel_size_m, r->v.voxel_size_m[0], n);
    const size_t box[6] = {0, 0, 0, n[0], n[1], n[2]};
    status s = volume_resample(&r->v, identity, r->v.voxel_size_m[0], box, pool, NULL, &cubes, err);
    if (s != STATUS_OK) return s;
    volume_release(&r->v);
    r->v = cubes;
    return STATUS_OK;
}

status phantom_reconstruct_scan(const struct phantom_option *o, const struct phantom_scan_option *option,
                                struct phantom_reconstruction *r, struct error *err)
{
    struct thread_pool *pool = NULL;
    struct phantom_scan_option scan = *option;
    struct phantom_report made;
    fiber_set_init(&r->truth);
    fiber_set_init(&r->found);
    r->v = (struct volume){0};
    r->wall_s = r->cpu_s = 0.0;
    scan.voxel_size_m = o->voxel_size_m;
    scan.section = o->section;
    status s = thread_pool_new(0, &pool, err);
    if (s == STATUS_OK) s = phantom_generate(o, pool, NULL, &r->truth, &made, err);
    if (s == STATUS_OK && r->slice_voxel > 0.0)
        s = thicken(o, &scan, made.n_voxel, r, pool, err);
    else if (s == STATUS_OK)
        s = phantom_scan(&r->truth, made.n_voxel, &scan, pool, NULL, &r->v, err);
    double start_s = clock_monotonic_s(), start_cpu_s = clock_process_s();
    if (s == STATUS_OK && r->slice_voxel > 0.0) s = make_cubes(r, pool, err);
    if (s == STATUS_OK) s = reconstruct(r, pool, err);
    r->wall_s += clock_monotonic_s() - start_s;
    r->cpu_s += clock_process_s() - start_cpu_s;
    const struct compare_option c = {.voxel_size_m = o->voxel_size_m};
    if (s == STATUS_OK) s = compare_fibers(&r->truth, &r->found, &c, &r->compare, err);
    thread_pool_free(pool);
    return s;
}

status phantom_reconstruct(const struct phantom_option *o, double snr, struct phantom_reconstruction *r,
                           struct error *err)
{
    struct phantom_scan_option scan;
    phantom_scan_option_default(&scan);
    scan.snr = snr;
    return phantom_reconstruct_scan(o, &scan, r, err);
}

void phantom_reconstruction_release(struct phantom_reconstruction *r)
{
    volume_release(&r->v);
    fiber_set_release(&r->truth);
    fiber_set_release(&r->found);
}
