#include "geometry/reconstruct/slab_helper.h"

#include "base/ranks/byte_pack.h"
#include "geometry/filter/direction_share.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Voxels along an axis, and of a volume, beyond which an order is wrong. */
static const uint64_t MOST_EDGE = 1 << 20, MOST_VOXEL = 1ull << 40;

static void forget(struct slab_helper *h)
{
    axis_round_free(h->round);
    h->round = NULL;
    if (h->slab.volume.density != NULL) volume_release(&h->slab.volume);
    h->slab.volume = (struct volume){.n = {0}};
    free(h->slab.slabs.first);
    h->slab.slabs = (struct volume_slabs){0};
    h->slab.n_slice = 0;
}

void slab_helper_release(struct slab_helper *h) { forget(h); }

static bool order_makes_sense(const struct slab_order *o, size_t n_rank)
{
    double voxels = 1.0;
    for (int a = 0; a < 3; a++) {
        voxels *= (double)o->n[a];
        if (o->n[a] == 0 || o->n[a] > MOST_EDGE || !isfinite(o->voxel_size_m[a]) || !(o->voxel_size_m[a] > 0.0))
            return false;
    }
    return voxels <= (double)MOST_VOXEL && o->n_rank == n_rank && o->halo <= MOST_EDGE && o->align >= 1 &&
           o->align <= MOST_EDGE;
}

/* Takes the first columns of all ranks, which rise from 0 to the number of columns. */
static bool take_columns(struct volume_slabs *s, const uint64_t *first)
{
    const size_t n_column = volume_slabs_n_column(s->n);
    s->first = calloc(s->n_rank + 1, sizeof *s->first);
    if (s->first == NULL) return false;
    bool right = first[0] == 0 && first[s->n_rank] == n_column;
    for (size_t r = 0; r <= s->n_rank && right; r++) {
        right = first[r] <= n_column && (r == 0 || first[r] >= first[r - 1]);
        s->first[r] = first[r];
    }
    return right;
}

static status take_slab(struct slab_helper *h, struct rank_team *team, const struct rank_order *order,
                        struct error *err)
{
    struct byte_view v = {.data = order->data, .n = order->n_bytes};
    struct slab_order o;
    forget(h);
    h->lacks = (struct error){0};
    BYTE_VIEW(&v, o);
    if (!v.failed && o.n[0] == 0) return byte_view_check(&v, err);
    const size_t rank = rank_team_rank(team), n_rank = rank_team_n_rank(team);
    if (v.failed || !order_makes_sense(&o, n_rank))
        return error_set(err, STATUS_FORMAT, "the slab of another rank is none");
    uint64_t *first = byte_view_array(&v, n_rank + 1, sizeof *first);
    h->slab.slabs = (struct volume_slabs){.team = team, .halo = o.halo, .align = o.align, .n_rank = n_rank};
    for (int a = 0; a < 3; a++) h->slab.slabs.n[a] = o.n[a];
    status s = byte_view_check(&v, err);
    if (s == STATUS_OK && !take_columns(&h->slab.slabs, first))
        s = error_set(err, STATUS_FORMAT, "another rank deals out columns that do not exist");
    free(first);
    if (s != STATUS_OK) return s;
    h->slab.rows = o.halo > 0 ? volume_slabs_own(&h->slab.slabs, rank) : volume_slabs_touched(&h->slab.slabs, rank);
    const size_t n[3] = {o.n[0], h->slab.rows.halo_end - h->slab.rows.with_halo, o.n[2]};
    return n[1] > 0 ? volume_init(&h->slab.volume, n, o.voxel_size_m, err) : STATUS_OK;
}

static status take_rows(struct slab_helper *h, const struct rank_order *order, struct error *err)
{
    struct byte_view v = {.data = order->data, .n = order->n_bytes};
    const size_t *n = h->slab.volume.n, n_slice = n[0] * n[1];
    struct rows_order o;
    BYTE_VIEW(&v, o);
    if (v.failed || h->slab.volume.density == NULL || o.first_slice != h->slab.n_slice ||
        o.n_slice > n[2] - h->slab.n_slice || v.n != o.n_slice * n_slice * sizeof(float))
        return error_set(err, STATUS_FORMAT, "another rank sent densities of a slab that are none");
    byte_view_get(&v, h->slab.volume.density + h->slab.n_slice * n_slice, v.n);
    h->slab.n_slice += o.n_slice;
    return STATUS_OK;
}

/* The slab is there as a whole. A rank may have none. */
static status check_slab(const struct slab_helper *h, struct error *err)
{
    const bool whole =
        h->slab.slabs.first != NULL && (h->slab.volume.density == NULL || h->slab.n_slice == h->slab.volume.n[2]);
    return whole ? STATUS_OK
                 : error_set(err, STATUS_FORMAT, "another rank asks for work on a slab that it has not sent");
}

status slab_helper_follow(struct slab_helper *h, struct rank_team *team, const struct rank_order *order,
                          struct thread_pool *pool, struct error *err)
{
    const bool has_tasks = order->kind == RANK_ORDER_DIRECTIONS || order->kind == RANK_ORDER_BRICKS;
    if (order->kind == RANK_ORDER_SLAB) {
        take_slab(h, team, order, &h->lacks);
        return STATUS_OK;
    }
    if (h->lacks.code == STATUS_OK && order->kind == RANK_ORDER_ROWS) take_rows(h, order, &h->lacks);
    if (h->lacks.code == STATUS_OK && order->kind == RANK_ORDER_AXES && check_slab(h, &h->lacks) == STATUS_OK)
        axis_share_take(&h->slab, &h->round, order, pool, &h->lacks);
    if (!has_tasks) return STATUS_OK;
    if (h->lacks.code != STATUS_OK) {
        *err = h->lacks;
        return h->lacks.code;
    }
    status s = check_slab(h, err);
    if (s != STATUS_OK) return s;
    return order->kind == RANK_ORDER_BRICKS ? axis_share_help(&h->slab, h->round, order, pool, err)
                                            : direction_share_help(&h->slab, order, pool, err);
}
