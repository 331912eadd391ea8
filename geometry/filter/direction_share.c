#include "geometry/filter/direction_share.h"

#include "base/ranks/byte_pack.h"
#include "geometry/filter/filter_choice.h"
#include "geometry/filter/filter_rows.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { VOXEL_BYTES = 5, TASK_BYTES = 1 << 20 };
/* Rows of the largest slab over all, up to which the ranks share the work. */
static const double WORTH_IT = 0.9;

/* Rows that are gathered: a task is a part of a slice of a rank's own rows. */
struct gather {
    const struct volume_slabs *slabs;
    const struct direction_volume *part; /* this rank's; its rows begin at part_row */
    struct direction_volume *whole;      /* the root's */
    size_t part_row, rows_per_task;
    size_t *first; /* task of each rank */
};

/* Consecutive voxels of a task: place of the first in the volume, and their number. */
struct gather_span {
    size_t slice, row, n_voxel;
};

static size_t n_part_of(const struct gather *g, size_t rank)
{
    const struct slab_rows r = volume_slabs_own(g->slabs, rank);
    return (r.end - r.begin + g->rows_per_task - 1) / g->rows_per_task;
}

static struct gather_span span_of(const struct gather *g, size_t i_task)
{
    size_t rank = 0;
    while (i_task >= g->first[rank + 1]) rank++;
    const struct slab_rows r = volume_slabs_own(g->slabs, rank);
    const size_t n_part = n_part_of(g, rank), at = i_task - g->first[rank],
                 row = r.begin + at % n_part * g->rows_per_task;
    const size_t end = row + g->rows_per_task < r.end ? row + g->rows_per_task : r.end;
    return (struct gather_span){at / n_part, row, (end - row) * g->slabs->n[0]};
}

static size_t index_in_part(const struct gather *g, const struct gather_span *s)
{
    return volume_index(g->part->n, 0, s->row - g->part_row, s->slice);
}

static size_t index_in_whole(const struct gather *g, const struct gather_span *s)
{
    return volume_index(g->whole->n, 0, s->row, s->slice);
}

/* In the root: its own rows. A helper has nothing left to do. */
static void take_own(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    const struct gather *g = context;
    if (g->whole == NULL || g->part->density == NULL) return;
    const struct gather_span s = span_of(g, i_task);
    const size_t from = index_in_part(g, &s), to = index_in_whole(g, &s);
    memcpy(g->whole->density + to, g->part->density + from, s.n_voxel);
    memcpy(g->whole->octahedral + 2 * to, g->part->octahedral + 2 * from, 4 * s.n_voxel);
    scratch_keep_within(g->whole->space);
}

static bool all_zero(const void *data, size_t n)
{
    const char *c = data;
    return n == 0 || (c[0] == 0 && memcmp(c, c + 1, n - 1) == 0);
}

/* Nothing for voxels that all are void. */
static size_t pack_rows(void *context, size_t i_task, void *to)
{
    const struct gather *g = context;
    const struct gather_span s = span_of(g, i_task);
    const size_t from = index_in_part(g, &s);
    const int16_t *octahedral = g->part->octahedral + 2 * from;
    if (all_zero(g->part->density + from, s.n_voxel) && all_zero(octahedral, 4 * s.n_voxel)) return 0;
    memcpy(to, g->part->density + from, s.n_voxel);
    memcpy((char *)to + s.n_voxel, octahedral, 4 * s.n_voxel);
    return VOXEL_BYTES * s.n_voxel;
}

static bool unpack_rows(void *context, size_t i_task, const void *from, size_t n_bytes)
{
    const struct gather *g = context;
    const struct gather_span s = span_of(g, i_task);
    if (n_bytes == 0) return true;
    if (n_bytes != VOXEL_BYTES * s.n_voxel) return false;
    const size_t to = index_in_whole(g, &s);
    memcpy(g->whole->density + to, from, s.n_voxel);
    memcpy(g->whole->octahedral + 2 * to, (const char *)from + s.n_voxel, 4 * s.n_voxel);
    scratch_keep_within(g->whole->space);
    return true;
}

static status gather_rows(struct gather *g, struct thread_pool *pool, const struct progress *progress,
                          struct error *err)
{
    const size_t row_bytes = VOXEL_BYTES * g->slabs->n[0], n_rank = g->slabs->n_rank;
    g->rows_per_task = TASK_BYTES > row_bytes ? TASK_BYTES / row_bytes : 1;
    g->first = calloc(n_rank + 1, sizeof *g->first);
    if (g->first == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot filter directions: out of memory");
    for (size_t r = 0; r < n_rank; r++) g->first[r + 1] = g->first[r] + n_part_of(g, r) * g->slabs->n[2];
    const struct rank_work work = {.n_task = g->first[n_rank],
                                   .most_bytes = g->rows_per_task * row_bytes,
                                   .first = g->first,
                                   .run = take_own,
                                   .pack = pack_rows,
                                   .unpack = unpack_rows,
                                   .context = g};
    status s = rank_team_share(g->slabs->team, &work, pool, progress, err);
    free(g->first);
    return s;
}

/* ---- the root ---- */

status direction_share_deal(struct volume_slabs *slabs, const struct volume *v, double diameter_voxel,
                            const struct reconstruct_option *option, struct thread_pool *pool, struct error *err)
{
    size_t most = 0;
    *slabs = (struct volume_slabs){.team = thread_pool_team(pool),
                                   .halo = filter_rows_halo(option, diameter_voxel),
                                   .align = filter_rows_alignment(diameter_voxel)};
    if (slabs->team == NULL) return STATUS_OK;
    status s = volume_slabs_deal(slabs, v, err);
    for (size_t r = 0; s == STATUS_OK && r < slabs->n_rank; r++) {
        const struct slab_rows rows = volume_slabs_own(slabs, r);
        if (rows.halo_end - rows.with_halo > most) most = rows.halo_end - rows.with_halo;
    }
    if (s != STATUS_OK || (double)most <= WORTH_IT * (double)v->n[1]) return s;
    free(slabs->first);
    slabs->first = NULL;
    return STATUS_OK;
}

/* Filters the rows of the root. *part is empty if it has none. */
static status filter_own(const struct volume_slabs *slabs, const struct volume *v, double diameter_voxel,
                         const struct reconstruct_option *option, struct thread_pool *pool,
                         const struct progress *progress, struct direction_volume *part, struct error *err)
{
    const struct slab_rows r = volume_slabs_own(slabs, 0);
    const size_t n[3] = {v->n[0], r.halo_end - r.with_halo, v->n[2]};
    const size_t own[2] = {r.begin - r.with_halo, r.end - r.with_halo};
    struct volume slab;
    if (n[1] == 0) return STATUS_OK;
    status s = volume_init_in(&slab, n, v->voxel_size_m, v->space, err);
    if (s != STATUS_OK) return s;
    for (size_t k = 0; k < n[2]; k++) {
        memcpy(slab.density + volume_index(n, 0, 0, k), v->density + volume_index(v->n, 0, r.with_halo, k),
               n[0] * n[1] * sizeof *v->density);
        scratch_keep_within(v->space);
    }
    s = filter_rows(&slab, own, diameter_voxel, option, pool, progress, part, err);
    volume_release(&slab);
    return s;
}

status direction_share_filter(const struct volume_slabs *slabs, const struct volume *v, double diameter_voxel,
                              const struct reconstruct_option *option, struct thread_pool *pool,
                              const struct progress *progress, struct direction_volume *d, struct error *err)
{
    const struct directions_order o = {.diameter_voxel = diameter_voxel,
                                       .s = option->s,
                                       .t = option->t,
                                       .eps_d = option->eps_d,
                                       .eps_j = option->eps_j,
                                       .h = option->h};
    const atomic_bool stop = true;
    const struct progress quiet = progress_silent(progress), cancelled = {.cancel = &stop};
    struct direction_volume part = {0};
    *d = (struct direction_volume){0};
    status s = volume_slabs_send(slabs, v, err);
    if (s == STATUS_OK) s = rank_team_order(slabs->team, RANK_ORDER_DIRECTIONS, &o, sizeof o, err);
    if (s == STATUS_OK) {
        s = filter_own(slabs, v, diameter_voxel, option, pool, progress, &part, err);
        /* not before: the filter needs its memory */
        if (s == STATUS_OK) s = direction_volume_init_in(d, v->n, v->voxel_size_m, v->space, err);
        struct gather g = {.slabs = slabs, .part = &part, .whole = d, .part_row = volume_slabs_own(slabs, 0).with_halo};
        if (s == STATUS_OK)
            s = gather_rows(&g, pool, &quiet, err);
        else /* the helpers stop, too */
            gather_rows(&g, pool, &cancelled, NULL);
        if (s == STATUS_CANCELLED) error_set(err, s, "finding fiber directions was cancelled");
    }
    direction_volume_release(&part);
    if (s != STATUS_OK) direction_volume_release(d);
    return s;
}

/* ---- a helper ---- */

static bool order_makes_sense(const struct directions_order *o)
{
    const double value[5] = {o->diameter_voxel, o->s, o->t, o->eps_d, o->eps_j};
    for (int i = 0; i < 5; i++)
        if (!isfinite(value[i])) return false;
    return o->diameter_voxel > 0.0 && o->diameter_voxel < 1e4 && o->s > 0.0 && o->t > 0.0 && o->h >= 3 && o->h <= 63;
}

/* Looks for a cancellation by the root as the work goes on. */
static void heed_root(void *team, double fraction)
{
    (void)fraction;
    rank_team_heed(team);
}

status direction_share_help(const struct helper_slab *slab, const struct rank_order *order, struct thread_pool *pool,
                            struct error *err)
{
    struct byte_view v = {.data = order->data, .n = order->n_bytes};
    struct directions_order o;
    struct reconstruct_option option;
    struct direction_volume part = {0};
    struct rank_team *team = slab->slabs.team;
    const struct slab_rows *r = &slab->rows;
    const size_t own[2] = {r->begin - r->with_halo, r->end - r->with_halo};
    BYTE_VIEW(&v, o);
    status s = byte_view_check(&v, err);
    reconstruct_option_default(&option);
    option.s = o.s;
    option.t = o.t;
    option.h = o.h;
    option.eps_d = o.eps_d;
    option.eps_j = o.eps_j;
    const bool right = s == STATUS_OK && order_makes_sense(&o) && filter_check(&option, NULL) == STATUS_OK &&
                       slab->slabs.halo == filter_rows_halo(&option, o.diameter_voxel) &&
                       slab->slabs.align == filter_rows_alignment(o.diameter_voxel);
    if (!right) return error_set(err, STATUS_FORMAT, "another rank asks for directions of fibers that cannot be");
    const struct progress progress = {.report = heed_root, .context = team, .cancel = rank_team_cancel(team)};
    if (slab->volume.density != NULL)
        s = filter_rows(&slab->volume, own, o.diameter_voxel, &option, pool, &progress, &part, err);
    struct gather g = {.slabs = &slab->slabs, .part = &part, .part_row = r->with_halo};
    if (s == STATUS_OK) s = gather_rows(&g, pool, &(struct progress){.cancel = progress.cancel}, err);
    direction_volume_release(&part);
    return s;
}
