/* Where fibers cross the slices of a subvolume (fabric thesis, 5.6.1 and 5.6.2): blobs in scale space (Lindeberg 1998).
 *
 * The subvolume of an axis shows the density of voxels whose direction is nearest to that axis, all others emptied. Here a voxel
 * belongs to an axis when its direction's component is at least CLASS_TOLERANCE of the largest, so that fibers near 45 degrees
 * are seen whole in both subvolumes (duplicates are removed after linking). In-plane coordinates u, v are the two other
 * axes in rising order; a pixel's centre is at (i + 1/2).
 */
#ifndef SELVEDGE_GEOMETRY_CENTERS_H
#define SELVEDGE_GEOMETRY_CENTERS_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

#define CLASS_TOLERANCE 0.8f

struct center {
    float u, v;
    float slope_u, slope_v; /* du, dv per slice, from the direction volume */
    float sigma;            /* scale of the strongest response, voxels: radius hint is sigma * sqrt 2 */
    float strength;         /* scale-normalised response; 0.74 for a lone disk of density 1 */
};

struct center_list {
    size_t n_slice;
    size_t *first; /* n_slice + 1 */
    struct center *center;
};

void center_list_release(struct center_list *l);

/* One byte a voxel: bit a set when the voxel belongs to axis a (within tolerance), bits 4+a for the strictly nearest axis;
 * 0 for emptied voxels. mask has room for all voxels; n_class_voxel counts strict membership. */
status class_mask(const struct direction_volume *d, struct thread_pool *pool, uint8_t *mask, size_t n_class_voxel[3],
                  struct error *err);

/* Bits of axes along x, y of a slice perpendicular to axis. */
static inline int slice_axis_u(int axis) { return axis == 0 ? 1 : 0; }
static inline int slice_axis_v(int axis) { return axis == 2 ? 1 : 2; }

/* Centers of all slices perpendicular to axis. diameter_voxel sets the scales. STATUS_CANCELLED, STATUS_NO_MEMORY. */
status centers_detect(const struct volume *v, const struct direction_volume *d, const uint8_t *mask, int axis,
                      double diameter_voxel, struct thread_pool *pool, const struct progress *progress,
                      struct center_list *list, struct error *err);

#endif
