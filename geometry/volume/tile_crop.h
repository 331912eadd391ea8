/* The box of an aligned volume that repeats in x and y with the least seam, and the seam that a volume has.
 *
 * A box from x0 to x1 tiles well when the slices about x1 look like those about x0: mismatch(x0, x1) is the mean squared difference of up
 * to 8 pairs of slices V(x0 + k), V(x1 + k), -4 <= k < 4, that lie in the volume (slices averaged over blocks of 1/64 of their edges), over
 * the mean of pairs of slices that have nothing to do with each other: 0 for a perfect repeat, 1 for none. A box that leaves no slice
 * outside of it is judged by its first and its last slice. Chosen is the least mismatch plus 0.05 times the share that is cropped, so that of
 * boxes that match alike the largest is taken. Where no box comes below TILE_MOST_MISMATCH nothing is gained by cutting, and the axis keeps
 * all that is valid. z is left as it is.
 * Two passes over the volume, slice by slice: it may be larger than memory.
 */
#ifndef SELVEDGE_GEOMETRY_TILE_CROP_H
#define SELVEDGE_GEOMETRY_TILE_CROP_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

#define TILE_MOST_MISMATCH 0.6

struct tile_crop {
    size_t box[6];   /* x0 y0 z0 x1 y1 z1, ends excluded */
    size_t valid[4]; /* x0 y0 x1 y1: largest box without cells from outside of the scan where there is material */
    double mismatch
        [2]; /* of the best box across x and y, as above, whether it was used or not; NaN where an axis has too few slices to say */
};

/* keep: least share of the valid box's edges that is kept, 0.1 .. 1 (1: only the valid box is cut out). material: value from which on a
 * voxel counts as material, void: what a cell from outside counts as. STATUS_INVALID, field OPTION_CROP, when no column of the volume
 * is valid or there is no material; STATUS_CANCELLED, STATUS_NO_MEMORY (a square of an axis' slices, 4 bytes each, is held). */
status tile_crop_find(const struct volume *v, double material, double void_value, double keep, struct thread_pool *pool,
                      const struct progress *progress, struct tile_crop *crop, struct error *err);

/* Cuts the box out in place (the rest of the array stays allocated). */
void volume_crop(struct volume *v, const size_t box[6]);

/* Seams of a volume with densities in [0, 1]: mean absolute difference between the last and the first slice across x and y, and
 * between neighbouring slices (mean over all pairs), both over all voxels; their ratio is 1 for a cloth that repeats without a seam. */
struct seam_density {
    double across[2], neighbour[2], ratio[2]; /* NaN where an axis has fewer than 2 slices or nothing changes */
};
void seam_density_measure(const struct volume *v, struct seam_density *s);

#endif
