#include "geometry/filter/ridge_assign.h"

#include "geometry/volume/kept_directions.h"

#include <math.h>
#include <string.h>

struct assign_job {
    const struct ridge_assign *rule;
    struct direction_volume *d;
};

/* Whether a voxel of the wanted rows is kept. */
static bool is_kept(const struct ridge_assign *o, size_t at)
{
    const size_t *n = o->v->n, j = at / n[0] % n[1];
    if (j < o->begin || j >= o->end || o->v->density[at] < o->eps_d) return false;
    if (!line_bound_reaches(o->bound, at % n[0], j, at / (n[0] * n[1]))) return false;
    return !(ridge_map_share(o->ridges, ridge_map_top(o->ridges, at)) * o->j_full > (double)o->eps_j);
}

/* The direction of a voxel that is kept: its own if it is a ridge, or its ridge's. */
static const int16_t *code_of(const struct ridge_assign *o, size_t at)
{
    const size_t ridge = ridge_map_is_ridge(o->ridges, at) ? at : ridge_map_top(o->ridges, at);
    return direction_volume_code(&o->ridges->direction, ridge_map_place(o->ridges, ridge));
}

/* Writes the directions of VOXEL_BITS_TASK voxels. Densities are 0 at first. */
static void assign_task(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    const struct assign_job *o = context;
    const size_t n = volume_n_voxel(o->d->n), from = i_task * VOXEL_BITS_TASK;
    scratch_keep_within(o->d->space);
    for (size_t at = from; at < n && at < from + VOXEL_BITS_TASK; at++) {
        if (!is_kept(o->rule, at)) continue;
        const long byte = lrintf(255.0f * o->rule->v->density[at]);
        o->d->density[at] = (uint8_t)(byte < 1 ? 1 : byte > 255 ? 255 : byte);
        memcpy(o->d->octahedral + 2 * at, code_of(o->rule, at), 2 * sizeof *o->d->octahedral);
    }
}

/* Marks the voxels that are kept in a volume of these alone. */
static void mark_task(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    const struct assign_job *o = context;
    struct voxel_bits *kept = &o->d->kept_only->kept;
    const size_t n = volume_n_voxel(o->d->n), from = i_task * VOXEL_BITS_TASK;
    scratch_keep_within(o->d->space);
    for (size_t at = from; at < n && at < from + VOXEL_BITS_TASK; at++)
        if (is_kept(o->rule, at)) voxel_bits_add(kept, at);
}

/* Lists their directions. */
static void list_task(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    const struct assign_job *o = context;
    struct kept_directions *k = o->d->kept_only;
    const size_t n = volume_n_voxel(o->d->n), from = i_task * VOXEL_BITS_TASK;
    scratch_keep_within(o->d->space);
    for (size_t at = from; at < n && at < from + VOXEL_BITS_TASK; at++)
        if (voxel_bits_has(&k->kept, at))
            memcpy(k->octahedral + 2 * voxel_bits_place(&k->kept, at), code_of(o->rule, at), 2 * sizeof *k->octahedral);
}

status ridge_assign_all(const struct ridge_assign *rule, bool kept_only, struct thread_pool *pool,
                        struct direction_volume *d, struct error *err)
{
    const struct volume *v = rule->v;
    const size_t n_task = (volume_n_voxel(v->n) + VOXEL_BITS_TASK - 1) / VOXEL_BITS_TASK;
    struct assign_job job = {rule, d};
    status s = kept_only ? direction_volume_init_kept(d, v->n, v->voxel_size_m, v->space, err)
                         : direction_volume_init_in(d, v->n, v->voxel_size_m, v->space, err);
    if (s == STATUS_OK) s = thread_pool_run(pool, n_task, kept_only ? mark_task : assign_task, &job, NULL);
    if (s == STATUS_OK && kept_only) s = kept_directions_list(d->kept_only, err);
    if (s == STATUS_OK && kept_only) s = thread_pool_run(pool, n_task, list_task, &job, NULL);
    return s;
}
