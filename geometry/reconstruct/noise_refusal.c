#include "geometry/reconstruct/noise_refusal.h"
#include "base/option_id.h"
#include "geometry/diameter/scan_structure.h"
#include "geometry/volume/density_map.h"
#include "geometry/volume/format/volume_source.h"

#include <math.h>

/* Noise alone has a separability of 0.64, and felt at a signal-to-noise ratio of 1 to 2 hardly more. */
static const double NOISE_SEPARABILITY = 0.65;

/* The first look takes at least 32 slices and some 2 million voxels; a scan of up to 16 million is looked at whole. A
 * look of more than 64 million voxels (256 MB) is not taken. */
enum { FIRST_SLICES = 32, FIRST_VOXELS = 1 << 21, WHOLE_VOXELS = 1 << 24, MOST_VOXELS = 1 << 26 };

status noise_refuse(const struct volume *v, double separability, const struct reconstruct_option *o,
                    struct thread_pool *pool, struct error *err)
{
    double deviation = INFINITY;
    if (separability >= NOISE_SEPARABILITY || !isnan(o->fiber_diameter_voxel)) return STATUS_OK;
    status s = scan_structure_measure(v, pool, &deviation, err);
    if (s != STATUS_OK || deviation >= SCAN_STRUCTURE_LEAST) return s;
    return error_set_field(
        err, STATUS_INVALID, OPTION_SCAN_FILES,
        "cannot find fibers: the scan shows nothing but noise; void and material cannot be "
        "distinguished (separability %.2f; noise alone has 0.64), and at scales of 1 to 6 voxels its "
        "densities are spread as noise is; check that this is the right file, and its type and byte "
        "order, or state 'fiber_diameter_voxel' to trace it all the same",
        separability);
}

/* Looks at n_slice slices in the middle. Returns STATUS_INVALID for noise alone; slices that say nothing, such as empty
 * ones, are none. */
static status look(struct volume_source *source, size_t n_slice, const struct reconstruct_option *o, struct error *err)
{
    const size_t *all = volume_source_describe(source)->n, n[3] = {all[0], all[1], n_slice};
    const double voxel_m[3] = {1e-6, 1e-6, 1e-6}; /* any size: it has no part in the test */
    struct volume v;
    struct density_modes m;
    status s = volume_init(&v, n, voxel_m, err);
    if (s != STATUS_OK) return s;
    s = volume_source_read(source, (all[2] - n_slice) / 2, n_slice, v.density, err);
    if (s == STATUS_OK && density_modes_find(&v, &m, NULL) == STATUS_OK)
        s = noise_refuse(&v, m.separability, o, NULL, err);
    volume_release(&v);
    return s;
}

static status look_in_steps(struct volume_source *source, const struct reconstruct_option *o,
                            const struct warning_sink *warn, struct error *err)
{
    const size_t *n = volume_source_describe(source)->n, n_in_slice = n[0] * n[1];
    size_t first = FIRST_VOXELS / n_in_slice + 1;
    if (first < FIRST_SLICES) first = FIRST_SLICES;
    if (first > n[2]) first = n[2];
    if (first * n_in_slice > MOST_VOXELS) return STATUS_OK;
    status s = look(source, first, o, err);
    if (s != STATUS_INVALID || first == n[2]) return s;
    if (volume_n_voxel(n) <= WHOLE_VOXELS) {
        *err = (struct error){0};
        return look(source, n[2], o, err);
    }
    *err = (struct error){0};
    warning_send(warn, OPTION_SCAN_FILES,
                 "%zu slices in the middle of the scan show nothing but noise: check that this is the right file, and "
                 "its type and byte order",
                 first);
    return STATUS_OK;
}

status noise_refuse_early(const char *const *path, size_t n_path, const struct reconstruct_option *o,
                          const struct warning_sink *warn, struct error *err)
{
    struct volume_source *source = NULL;
    struct error local = {0};
    if (!isnan(o->fiber_diameter_voxel)) return STATUS_OK;
    status s = volume_source_open_declared(path, n_path, &o->raw, &o->part, &source, &local);
    if (s == STATUS_OK) s = look_in_steps(source, o, warn, &local);
    volume_source_close(source);
    if (s != STATUS_OK && err != NULL) *err = local;
    return s;
}
