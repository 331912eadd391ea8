/* A regular grid of X-ray densities in memory, and the direction volume computed from it.
 *
 * Frame: the cloth frame, with x along the weft, y along the warp, and z out of the cloth towards camera and light.
 * The centre of voxel (i, j, k) is at (i + 1/2, j + 1/2, k + 1/2) * voxel_size_m; the corner of the grid is the
 * origin. The index of voxel (i, j, k) is (k * n[1] + j) * n[0] + i. The caller initialises and releases the
 * structs, which own their arrays. The arrays come from the scratch space, which may keep them in files
 * (base/files/scratch_space.h), or from malloc if space is NULL. */
#ifndef SELVEDGE_GEOMETRY_VOLUME_H
#define SELVEDGE_GEOMETRY_VOLUME_H

#include "base/files/scratch_space.h"
#include "base/status.h"

#include <stdbool.h>
#include <stdint.h>

/* Voxels whose density was replaced by 1 because they lie in lumens (lumen_filter.h), by index, with their former
 * densities. */
struct volume_filled {
    size_t n, *voxel;
    float *density;
};

/* Voxels without a measurement (volume_unknown.h), as runs of indices in ascending order. */
struct volume_unknown {
    size_t n;
    struct volume_run {
        size_t first, end;
    } * run;
};

/* Voxels of lighter fibers, whose densities were divided by `density` (light_material.h), as runs of indices in
 * ascending order (voxel_runs.h). */
struct volume_light {
    double density;
    size_t n;
    struct volume_run *run;
};

struct volume_slabs;

struct volume {
    size_t n[3];
    double voxel_size_m[3];
    float *density;              /* n[0]*n[1]*n[2]; in [0, 1] after density_map_apply, raw scanner values before */
    struct volume_filled filled; /* this and the next two members are from the same space */
    struct volume_unknown unknown;
    struct volume_light light;
    struct scratch_space *space; /* not owned */
    /* Which parts of it other ranks have (geometry/volume/volume_slabs.h); NULL: none. Not owned. */
    const struct volume_slabs *slabs;
};

/* Makes a volume of zeros. STATUS_INVALID, STATUS_TOO_LARGE, STATUS_NO_MEMORY; with a space also STATUS_DISK_FULL. */
status volume_init(struct volume *v, const size_t n[3], const double voxel_size_m[3], struct error *err);
status volume_init_in(struct volume *v, const size_t n[3], const double voxel_size_m[3], struct scratch_space *space,
                      struct error *err);
void volume_release(struct volume *v);
/* Makes a copy (uninitialised `to`) with the densities that filled voxels had. STATUS_NO_MEMORY, STATUS_DISK_FULL. */
status volume_copy_unfilled(const struct volume *v, struct volume *to, struct error *err);
/* Fills the voxels whose mark is at least `least` (mark: one for each voxel), and empties all others that were filled.
 * STATUS_NO_MEMORY, STATUS_DISK_FULL. */
status volume_fill_marked(struct volume *v, const uint8_t *mark, uint8_t least, struct error *err);

static inline size_t volume_n_voxel(const size_t n[3]) { return n[0] * n[1] * n[2]; }
static inline size_t volume_index(const size_t n[3], size_t i, size_t j, size_t k) { return (k * n[1] + j) * n[0] + i; }

struct kept_directions;

/* Density in [0, 1] as a byte (0: emptied), and a unit direction as two 16-bit octahedral coordinates: 5 bytes per
 * voxel. A direction and its opposite stand for the same fiber. On fine grids only which voxels are kept, and their
 * directions (kept_directions.h); such a volume is only read. */
struct direction_volume {
    size_t n[3];
    double voxel_size_m[3];
    uint8_t *density;
    int16_t *octahedral;               /* 2 per voxel */
    struct kept_directions *kept_only; /* owned; NULL: the arrays above. Otherwise these are NULL. */
    struct scratch_space *space;       /* not owned */
};

status direction_volume_init(struct direction_volume *v, const size_t n[3], const double voxel_size_m[3],
                             struct error *err);
status direction_volume_init_in(struct direction_volume *v, const size_t n[3], const double voxel_size_m[3],
                                struct scratch_space *space, struct error *err);
/* Makes a volume of kept voxels alone, none at first. STATUS_NO_MEMORY, STATUS_DISK_FULL. */
status direction_volume_init_kept(struct direction_volume *v, const size_t n[3], const double voxel_size_m[3],
                                  struct scratch_space *space, struct error *err);
void direction_volume_release(struct direction_volume *v);
/* Returns whether a voxel has a direction. */
bool direction_volume_is_kept(const struct direction_volume *v, size_t i_voxel);
/* The octahedral coordinates of a voxel that is kept. */
const int16_t *direction_volume_code(const struct direction_volume *v, size_t i_voxel);
/* The direction of a voxel is only meaningful where density > 0. The direction that is set may have any length
 * except 0; that returned is a unit vector with an error below 0.005 degrees. */
void direction_volume_get(const struct direction_volume *v, size_t i_voxel, float d[3]);
void direction_volume_set(struct direction_volume *v, size_t i_voxel, const float d[3]);

#endif
