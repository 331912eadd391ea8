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

#include "base/progress.h"
#include "base/thread_pool.h"
#include "geometry/fibers/slices/center.h"

struct center_list {
    size_t n_slice;
    size_t *first;         /* n_slice + 1 entries */
    struct center *center; /* of slice k: first[k] .. first[k + 1] - 1, sorted by v, then u */
};

void center_list_release(struct center_list *l);

/* Finds the centers in all slices of the frame. STATUS_CANCELLED, STATUS_NO_MEMORY. */
status centers_detect(const struct center_search *search, struct thread_pool *pool, const struct progress *progress,
                      struct center_list *list, struct error *err);

#endif
