#include "geometry/volume/volume_slabs.h"

#include "base/ranks/byte_pack.h"

#include <stdlib.h>
#include <string.h>

enum { EVERY = 4, ORDER_BYTES = 8 << 20 }; /* slices that are looked at for material; bytes of an order of rows */
/* Work on a voxel of void over that on one of material. */
static const double VOID_SHARE = 0.02;

static size_t columns_in_row(const struct volume_slabs *s) { return (s->n[0] + SLAB_EDGE - 1) / SLAB_EDGE; }

static size_t at_most(size_t value, size_t most) { return value < most ? value : most; }

static struct slab_rows with_halo(const struct volume_slabs *s, size_t begin, size_t end)
{
    const size_t from = begin > s->halo ? begin - s->halo : 0;
    if (begin >= end) return (struct slab_rows){begin, begin, begin, begin};
    return (struct slab_rows){begin, end, from / s->align * s->align, at_most(end + s->halo, s->n[1])};
}

struct slab_rows volume_slabs_touched(const struct volume_slabs *s, size_t rank)
{
    const size_t in_row = columns_in_row(s), begin = s->first[rank], end = s->first[rank + 1];
    if (begin == end) return with_halo(s, 0, 0);
    return with_halo(s, begin / in_row * SLAB_EDGE, at_most((end + in_row - 1) / in_row * SLAB_EDGE, s->n[1]));
}

/* Returns the row at which a column begins, as a part of its band of rows. */
static size_t row_of(const struct volume_slabs *s, size_t column)
{
    return at_most(column * SLAB_EDGE / columns_in_row(s), s->n[1]);
}

struct slab_rows volume_slabs_own(const struct volume_slabs *s, size_t rank)
{
    return with_halo(s, row_of(s, s->first[rank]), row_of(s, s->first[rank + 1]));
}

/* Adds the weights of a row of voxels to its columns. */
static void weigh_row(const float *density, size_t n, double *weight)
{
    for (size_t i = 0; i < n; i += SLAB_EDGE) {
        const size_t end = at_most(i + SLAB_EDGE, n);
        float sum = 0.0f;
        for (size_t x = i; x < end; x++) sum += density[x];
        weight[i / SLAB_EDGE] += (double)sum + VOID_SHARE * (double)(end - i);
    }
}

status volume_slabs_deal(struct volume_slabs *s, const struct volume *v, struct error *err)
{
    const size_t n_column = volume_slabs_n_column(v->n), n_rank = rank_team_n_rank(s->team);
    s->n_rank = n_rank;
    memcpy(s->n, v->n, sizeof s->n);
    double *weight = calloc(n_column, sizeof *weight), all = 0.0, sum = 0.0;
    s->first = calloc(n_rank + 1, sizeof *s->first);
    if (weight == NULL || s->first == NULL) {
        free(weight);
        free(s->first);
        s->first = NULL;
        return error_set(err, STATUS_NO_MEMORY, "cannot deal a volume out to the ranks: out of memory");
    }
    for (size_t k = 0; k < v->n[2]; k += EVERY) {
        for (size_t j = 0; j < v->n[1]; j++)
            weigh_row(v->density + volume_index(v->n, 0, j, k), v->n[0], weight + j / SLAB_EDGE * columns_in_row(s));
        scratch_keep_within(v->space);
    }
    for (size_t c = 0; c < n_column; c++) all += weight[c];
    for (size_t c = 0, rank = 1; c < n_column; c++) {
        sum += weight[c];
        while (rank < n_rank && sum - 0.5 * weight[c] >= all * (double)rank / (double)n_rank) s->first[rank++] = c;
        for (size_t r = rank; c + 1 == n_column && r <= n_rank; r++) s->first[r] = n_column;
    }
    free(weight);
    return STATUS_OK;
}

/* Sends a helper its rows, some slices at a time. */
static status send_rows(const struct volume_slabs *s, const struct volume *v, size_t rank, struct error *err)
{
    const struct slab_rows r = s->halo > 0 ? volume_slabs_own(s, rank) : volume_slabs_touched(s, rank);
    const size_t n_row = r.halo_end - r.with_halo, n = n_row * v->n[0], most = ORDER_BYTES / (sizeof(float) * (n + 1));
    status st = STATUS_OK;
    for (size_t k = 0; n > 0 && k < v->n[2] && st == STATUS_OK;) {
        const struct rows_order head = {k, at_most(most > 0 ? most : 1, v->n[2] - k)};
        struct byte_pack p = {0};
        BYTE_PACK(&p, head);
        for (size_t end = k + head.n_slice; k < end; k++)
            byte_pack_put(&p, v->density + volume_index(v->n, 0, r.with_halo, k), n * sizeof *v->density);
        st = byte_pack_check(&p, err);
        if (st == STATUS_OK) st = rank_team_order_to(s->team, rank, RANK_ORDER_ROWS, p.data, p.n, err);
        byte_pack_release(&p);
        scratch_keep_within(v->space);
    }
    return st;
}

static status send_slab_order(const struct volume_slabs *s, const struct slab_order *head, struct error *err)
{
    struct byte_pack p = {0};
    BYTE_PACK(&p, *head);
    for (size_t r = 0; head->n[0] > 0 && r <= s->n_rank; r++) BYTE_PACK(&p, (uint64_t){s->first[r]});
    status st = byte_pack_check(&p, err);
    if (st == STATUS_OK) st = rank_team_order(s->team, RANK_ORDER_SLAB, p.data, p.n, err);
    byte_pack_release(&p);
    return st;
}

status volume_slabs_send(const struct volume_slabs *s, const struct volume *v, struct error *err)
{
    struct slab_order head = {.halo = s->halo, .align = s->align, .n_rank = s->n_rank};
    for (int a = 0; a < 3; a++) {
        head.n[a] = v->n[a];
        head.voxel_size_m[a] = v->voxel_size_m[a];
    }
    status st = send_slab_order(s, &head, err);
    for (size_t r = 1; r < s->n_rank && st == STATUS_OK; r++) st = send_rows(s, v, r, err);
    return st;
}

status volume_slabs_share(struct volume_slabs *s, struct rank_team *team, struct volume *v, struct error *err)
{
    *s = (struct volume_slabs){.team = team, .align = 1};
    if (team == NULL) return STATUS_OK;
    status st = volume_slabs_deal(s, v, err);
    if (st == STATUS_OK) st = volume_slabs_send(s, v, err);
    if (st == STATUS_OK) v->slabs = s;
    return st;
}

void volume_slabs_release(struct volume_slabs *s)
{
    const struct slab_order nothing = {.n_rank = 0};
    if (s->first != NULL && !rank_team_broken(s->team)) send_slab_order(s, &nothing, NULL);
    free(s->first);
    *s = (struct volume_slabs){0};
}
