/* Transforms a scan to the cloth frame: axis permutation and flips, a 3x3 matrix, a crop box, cubic voxels. (Fabric
 * thesis, section 5.7.1: samples were rotated, Silk was sheared, and all were cropped to tile.) */
#ifndef SELVEDGE_GEOMETRY_VOLUME_ALIGN_H
#define SELVEDGE_GEOMETRY_VOLUME_ALIGN_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

/* The axis of the file that becomes each of cloth x, y, z, and whether it is reversed. */
struct axis_map {
    int source[3];
    bool flip[3];
};

/* Parses "xyz", "xzy", "-zx-y": three different letters, each with an optional sign. STATUS_INVALID, field
 * OPTION_AXES. */
status axis_map_parse(const char *text, struct axis_map *map, struct error *err);

/* Value of voxels that the matrix brings in from outside of the scan. It is below every density. */
#define VOLUME_OUTSIDE (-INFINITY)

/* Computes out(x) = in(c + M^-1 (x - c)) by six-point interpolation along each axis, where c is the centre of `in` and
 * lengths are in metres from the corner of the volume, which is the same for both. `out` has the voxels of the box
 * (x0 y0 z0 x1 y1 z1) of a grid of the extent of `in` to half a voxel, with cubic voxels of edge voxel_m (the smallest
 * spacing of `in`). A wave of four voxels loses 5 % at most; with linear interpolation it would lose 29 % halfway
 * between the slices of the file. Uses the scratch space of `in`. STATUS_INVALID, field OPTION_MATRIX, for a matrix
 * that cannot be inverted; STATUS_CANCELLED, and as volume_init_in. */
status volume_resample(const struct volume *in, const double matrix[9], double voxel_m, const size_t box[6],
                       struct thread_pool *pool, const struct progress *progress, struct volume *out,
                       struct error *err);
/* The same for a volume that exists: fills its densities. Voxel (0, 0, 0) is `first` of that grid. */
status volume_resample_to(const struct volume *in, const double matrix[9], const size_t first[3],
                          struct thread_pool *pool, const struct progress *progress, struct volume *out,
                          struct error *err);
/* Computes the shape of the whole resampled grid: extents of `in` over voxel_m, rounded. */
void volume_resampled_shape(const size_t n_in[3], const double voxel_size_m[3], double voxel_m, size_t n_out[3]);

#endif
