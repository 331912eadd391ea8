#include "geometry/filter/filter_directions.h"
#include "base/option_id.h"
#include "geometry/filter/direction_share.h"
#include "geometry/filter/filter_choice.h"
#include "geometry/filter/filter_rows.h"

#include <stdlib.h>

/* Voxels of a slice. */
struct slice_count {
    const struct volume *v;
    const struct direction_volume *d;
    float eps_d;
    size_t *n_material, *n_kept;
};

static void count_slice(void *context, size_t k, size_t i_thread)
{
    (void)i_thread;
    const struct slice_count *c = context;
    const size_t n = c->v->n[0] * c->v->n[1];
    size_t n_material = 0, n_kept = 0;
    scratch_keep_within(c->v->space);
    for (size_t at = k * n; at < (k + 1) * n; at++) {
        n_material += c->v->density[at] >= c->eps_d;
        n_kept += direction_volume_is_kept(c->d, at);
    }
    c->n_material[k] = n_material;
    c->n_kept[k] = n_kept;
}

static status count_voxels(const struct volume *v, const struct direction_volume *d,
                           const struct reconstruct_option *option, struct thread_pool *pool,
                           struct reconstruct_report *report, struct error *err)
{
    const size_t n_slice = v->n[2];
    size_t *n = calloc(2 * n_slice, sizeof *n);
    if (n == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot filter directions: out of memory");
    struct slice_count c = {v, d, (float)option->eps_d, n, n + n_slice};
    thread_pool_run(pool, n_slice, count_slice, &c, NULL);
    report->n_material_voxel = report->n_kept_voxel = 0;
    for (size_t k = 0; k < n_slice; k++) {
        report->n_material_voxel += c.n_material[k];
        report->n_kept_voxel += c.n_kept[k];
    }
    free(n);
    if (report->n_kept_voxel > 0) return STATUS_OK;
    const char *at_fault = report->n_material_voxel > 0 ? OPTION_FILTER_ANSWER : OPTION_FILTER_DENSITY;
    return error_set_field(err, STATUS_INVALID, at_fault,
                           "cannot find fibers: %zu voxels reach the density eps_d %g, none of them J <= eps_j %g",
                           report->n_material_voxel, option->eps_d, option->eps_j);
}

/* Chooses the options, and filters, together with the other ranks where that helps. */
static status filter(const struct volume *v, double diameter_voxel, struct reconstruct_option *option, bool kept_only,
                     struct thread_pool *pool, const struct progress *progress, struct direction_volume *d,
                     struct error *err)
{
    struct volume_slabs slabs = {0};
    const size_t all[2] = {0, v->n[1]};
    *d = (struct direction_volume){0};
    filter_choose(option, v, diameter_voxel);
    status s = filter_check(option, err);
    if (s == STATUS_OK) s = direction_share_deal(&slabs, v, diameter_voxel, option, pool, err);
    if (s != STATUS_OK) return s;
    if (slabs.first != NULL)
        s = direction_share_filter(&slabs, v, diameter_voxel, option, pool, progress, d, err);
    else
        s = filter_rows(v, kept_only ? NULL : all, diameter_voxel, option, pool, progress, d, err);
    volume_slabs_release(&slabs);
    return s;
}

status filter_directions(const struct volume *v, double diameter_voxel, struct reconstruct_option *option,
                         struct thread_pool *pool, const struct progress *progress, struct direction_volume *d,
                         struct reconstruct_report *report, struct error *err)
{
    status s = filter(v, diameter_voxel, option, false, pool, progress, d, err);
    if (s == STATUS_OK) s = count_voxels(v, d, option, pool, report, err);
    if (s != STATUS_OK) direction_volume_release(d);
    return s;
}

status filter_directions_kept(const struct volume *v, double diameter_voxel, struct reconstruct_option *option,
                              struct thread_pool *pool, const struct progress *progress, struct direction_volume *d,
                              struct reconstruct_report *report, struct error *err)
{
    status s = filter(v, diameter_voxel, option, true, pool, progress, d, err);
    if (s == STATUS_OK) s = count_voxels(v, d, option, pool, report, err);
    if (s != STATUS_OK) direction_volume_release(d);
    return s;
}
