#include "tests/support/scan/phantom_reconstruction.h"

#include "base/clock.h"
#include "geometry/volume/density_map.h"

#include <sys/resource.h>

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

static status reconstruct(struct phantom_reconstruction *r, struct thread_pool *pool, struct error *err)
{
    struct direction_volume d = {0};
    struct density_modes m;
    status s = density_modes_find(&r->v, &m, err);
    if (s == STATUS_OK) s = density_map_apply(&r->v, m.low, m.high, pool, err);
    if (s == STATUS_OK) s = reconstruct_orientation(&r->v, &r->option, pool, NULL, &d, &r->report, err);
    if (s == STATUS_OK) s = reconstruct_fibers(&r->v, &d, &r->option, pool, NULL, &r->found, &r->report, err);
    if (s == STATUS_OK) s = reconstruct_transfer(&r->found, &d, pool, NULL, &r->report, err);
    direction_volume_release(&d);
    return s;
}

static double processor_s(void)
{
    struct rusage u;
    getrusage(RUSAGE_SELF, &u);
    return (double)(u.ru_utime.tv_sec + u.ru_stime.tv_sec) + 1e-6 * (double)(u.ru_utime.tv_usec + u.ru_stime.tv_usec);
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
    scan.voxel_size_m = o->voxel_size_m;
    scan.section = o->section;
    status s = thread_pool_new(0, &pool, err);
    if (s == STATUS_OK) s = phantom_generate(o, pool, NULL, &r->truth, &made, err);
    if (s == STATUS_OK) s = phantom_scan(&r->truth, made.n_voxel, &scan, pool, NULL, &r->v, err);
    double start_s = clock_monotonic_s(), start_cpu_s = processor_s();
    if (s == STATUS_OK) s = reconstruct(r, pool, err);
    r->wall_s = clock_monotonic_s() - start_s;
    r->cpu_s = processor_s() - start_cpu_s;
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
