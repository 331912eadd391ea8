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

/* Pictures of n_slice slices. image[n_slice][height][width]: the density where the voxel belongs to the frame, 0
 * elsewhere, interpolated bilinearly in the plane of the two diagonal axes. kept: a bit for each pixel that kept
 * voxels of the class reach, pixel u of a row in bit u % 8 of byte u / 8, slice_row_bytes bytes a row. own[n_slice]:
 * the range of these pixels. */
struct slice_pictures {
    float *image;
    uint8_t *kept;
    struct pixel_range *own;
};

static inline size_t slice_row_bytes(const struct slice_frame *f) { return (f->width + 7) / 8; }

/* Fills the pictures of slices first .. first + n_slice - 1. STATUS_NO_MEMORY. */
status slice_images_fill(const struct slice_source *source, size_t first, size_t n_slice, struct thread_pool *pool,
                         const struct slice_pictures *pictures, struct error *err);

#endif
