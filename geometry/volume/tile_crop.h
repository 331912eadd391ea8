/* Finds the box of an aligned volume that repeats in x and y with the least seam, and measures the seams of a
 * volume.
 *
 * A box from x0 to x1 tiles well if the slices about x1 resemble those about x0. mismatch(x0, x1) is the mean
 * squared difference of up to 8 pairs of slices V(x0 + k), V(x1 + k), -4 <= k < 4, that lie in the volume (slices
 * averaged over blocks of 1/64 of their edges), divided by the mean over pairs of unrelated slices: 0 for a perfect
 * repeat, 1 for none. A box that leaves no slice outside is assessed by its first and last slice. The box with the
 * least mismatch plus 0.05 times the cropped share is chosen, so of equally good boxes the largest wins. If no
 * mismatch is below TILE_MOST_MISMATCH, cropping would not help, and the whole valid range is kept. z is not
 * cropped. The volume is read twice, slice by slice, so it may be larger than memory. */
#ifndef SELVEDGE_GEOMETRY_TILE_CROP_H
#define SELVEDGE_GEOMETRY_TILE_CROP_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

#define TILE_MOST_MISMATCH 0.6

struct tile_crop {
    size_t box[6];   /* x0 y0 z0 x1 y1 z1, ends excluded */
    size_t valid[4]; /* x0 y0 x1 y1: largest box in which no voxel with material comes from outside of the scan */
    /* Of the best box across x and y, as above, whether or not it was used; NaN if an axis has too few slices. */
    double mismatch[2];
};

/* keep: least share of each edge of the valid box that is kept, 0.1 .. 1 (1: only crops to the valid box). material:
 * value from which on a voxel counts as material. void_value: value of voxels from outside. STATUS_INVALID, field
 * OPTION_CROP, if no column of the volume is valid or there is no material; STATUS_CANCELLED, STATUS_NO_MEMORY
 * (needs 4 bytes times the square of the number of slices of an axis). */
status tile_crop_find(const struct volume *v, double material, double void_value, double keep, struct thread_pool *pool,
                      const struct progress *progress, struct tile_crop *crop, struct error *err);

/* Crops the volume to the box in place; the rest of the array stays allocated. */
void volume_crop(struct volume *v, const size_t box[6]);

/* Seams of a volume with densities in [0, 1]: the mean absolute difference between the last and the first slice
 * across x and y, and between neighbouring slices (mean over all pairs). Their ratio is 1 for a cloth that repeats
 * without a seam. */
struct seam_density {
    double across[2], neighbour[2], ratio[2]; /* NaN if an axis has fewer than 2 slices or all densities are equal */
};
void seam_density_measure(const struct volume *v, struct seam_density *s);

#endif
