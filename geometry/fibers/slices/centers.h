/* Finds where fibers cross the slices of a subvolume (fabric thesis, 5.6.1 and 5.6.2), as blobs in scale space
 * (Lindeberg 1998).
 *
 * A subvolume shows the density of voxels whose direction is near to the normal of its slices; all other voxels are
 * empty. In the paper three subvolumes share the voxels, and fibers that turn from one to another are broken. Here
 * there are nine slicing directions (slice_frame.h), and a voxel belongs to all within 40 degrees (every direction
 * is within 36 degrees of one). So fibers between two slicing directions are complete in both; the duplicates are
 * removed after linking. */
#ifndef SELVEDGE_GEOMETRY_CENTERS_H
#define SELVEDGE_GEOMETRY_CENTERS_H

#include "base/thread_pool.h"
#include "geometry/fibers/slices/slice_frame.h"
#include "geometry/fibers/slices/subvolumes.h"
#include "geometry/volume/volume.h"

struct center {
    float u, v;             /* in pixels of the frame; the centre of pixel i is at i + 1/2 */
    float slope_u, slope_v; /* du, dv per slice, from the direction volume */
    float radius;           /* of the fiber, from the scale of the strongest response, voxels */
    float strength;         /* scale-normalised response; 0.74 for an isolated disk of density 1 */
};

struct center_list {
    size_t n_slice;
    size_t *first;         /* n_slice + 1 entries */
    struct center *center; /* of slice k: first[k] .. first[k + 1] - 1, sorted by v, then u */
};

void center_list_release(struct center_list *l);

/* Where centers are looked for. */
struct center_search {
    const struct volume *v;
    const struct direction_volume *d; /* of v */
    const struct subvolumes *sub;     /* of d */
    const struct slice_frame *frame;
    double diameter_voxel; /* of the fibers; it determines the scales of the filters */
};

/* Finds the centers in all slices of the frame. STATUS_CANCELLED, STATUS_NO_MEMORY. */
status centers_detect(const struct center_search *search, struct thread_pool *pool, const struct progress *progress,
                      struct center_list *list, struct error *err);

#endif
