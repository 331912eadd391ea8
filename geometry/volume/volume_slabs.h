/* Slabs of a volume over the ranks of a job: every rank has a range of rows y in all slices, since cloth lies flat in x
 * and y and has about as much material in each part of them. The root (rank 0) keeps the whole volume.
 *
 * Columns of bricks of SLAB_EDGE^3 voxels are dealt out in the order (y, x), as many to each rank as hold an equal part
 * of the material. A rank has the rows that its columns touch, and `halo` rows more to both sides. A helper holds 4
 * bytes for each voxel of its slab. */
#ifndef SELVEDGE_GEOMETRY_VOLUME_SLABS_H
#define SELVEDGE_GEOMETRY_VOLUME_SLABS_H

#include "base/ranks/rank_team.h"
#include "geometry/volume/volume.h"

enum { SLAB_EDGE = 32 };

struct volume_slabs {
    struct rank_team *team;
    size_t n[3], halo, align; /* voxels of the volume; rows; the first row of a slab is a multiple of align */
    size_t n_rank;
    size_t *first; /* owned: n_rank + 1 columns; rank r has first[r] .. first[r + 1] - 1 */
};

struct slab_rows {
    size_t begin, end;          /* rows that the rank owns (volume_slabs_own), or touches (volume_slabs_touched) */
    size_t with_halo, halo_end; /* rows that it has */
};

/* The slab that a helper has. All zero: it has none. */
struct helper_slab {
    struct volume_slabs slabs; /* as the root has dealt the volume out */
    struct volume volume;      /* the rows `rows` of it; density NULL: there are none */
    struct slab_rows rows;
    size_t n_slice; /* slices that have come */
};

/* First data of an order RANK_ORDER_SLAB; then come the first columns of all ranks and the number of columns. No
 * voxels: helpers forget their slabs. */
struct slab_order {
    uint64_t n[3], halo, align, n_rank;
    double voxel_size_m[3];
};

/* First data of an order RANK_ORDER_ROWS: the densities of the rank's rows in n_slice slices follow. */
struct rows_order {
    uint64_t first_slice, n_slice;
};

static inline size_t volume_slabs_n_column(const size_t n[3])
{
    return (n[0] + SLAB_EDGE - 1) / SLAB_EDGE * ((n[1] + SLAB_EDGE - 1) / SLAB_EDGE);
}
/* The rows that the bricks of a rank touch. Rows of two ranks may overlap. */
struct slab_rows volume_slabs_touched(const struct volume_slabs *s, size_t rank);
/* Returns the rows that `rank` owns. The owned rows of all ranks partition the volume. */
struct slab_rows volume_slabs_own(const struct volume_slabs *s, size_t rank);

/* Deals the columns out, without sending anything; the caller has set team, halo and align. STATUS_NO_MEMORY. */
status volume_slabs_deal(struct volume_slabs *s, const struct volume *v, struct error *err);
/* Root: sends every helper its slab. The rows are given by volume_slabs_touched, or by volume_slabs_own where there is
 * a halo. STATUS_IO, STATUS_NO_MEMORY. */
status volume_slabs_send(const struct volume_slabs *s, const struct volume *v, struct error *err);
/* Root: deals and sends a volume without a halo, and sets v->slabs = s. team NULL: does nothing. */
status volume_slabs_share(struct volume_slabs *s, struct rank_team *team, struct volume *v, struct error *err);
/* Root: the helpers forget their slabs. s may be all zero. */
void volume_slabs_release(struct volume_slabs *s);

#endif
