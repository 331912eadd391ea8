/* Makes the pictures of the subvolumes, the slices of a frame, for a slab of slices at a time.
 *
 * A volume is stored with x running fastest, so a picture perpendicular to x touches every page of it. Pictures of
 * neighbouring slices are therefore filled together, in an order that reads the volume once. The result does not
 * depend on the division into slabs. */
#ifndef SELVEDGE_GEOMETRY_SLICE_IMAGE_H
#define SELVEDGE_GEOMETRY_SLICE_IMAGE_H

#include "base/thread_pool.h"
#include "geometry/fibers/slices/slice_frame.h"
#include "geometry/volume/volume.h"

/* Pixels farther than this beyond the faces of the volume are 0; nearer ones repeat the face. */
#define SLICE_OUTSIDE 6.0f

struct slice_source {
    const struct volume *v;
    const uint16_t *mask; /* subvolumes.h */
    const struct slice_frame *frame;
    size_t from[3], to[3]; /* only this part of the volume is shown; the rest counts as void */
};

/* Pixels u0 <= u < u1, v0 <= v < v1; none if u0 >= u1. */
struct pixel_range {
    size_t u0, u1, v0, v1;
};

/* Fills image[n_slice][height][width] with slices first .. first + n_slice - 1: the density where the voxel belongs
 * to the frame, 0 elsewhere, interpolated bilinearly in the plane of the two diagonal axes. own[n_slice]: the pixels
 * that kept voxels of the class reach. STATUS_NO_MEMORY. */
status slice_images_fill(const struct slice_source *source, size_t first, size_t n_slice, struct thread_pool *pool,
                         float *image, struct pixel_range *own, struct error *err);

#endif
