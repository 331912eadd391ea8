/* The center of a fiber in a slice, and the volume in which centers are searched for. */
#ifndef SELVEDGE_GEOMETRY_CENTER_H
#define SELVEDGE_GEOMETRY_CENTER_H

#include "geometry/fibers/slices/slice_frame.h"
#include "geometry/fibers/slices/subvolumes.h"
#include "geometry/volume/volume.h"

struct center {
    float u, v;             /* in pixels of the frame; the centre of pixel i is at i + 1/2 */
    float slope_u, slope_v; /* du, dv per slice, from the direction volume */
    float radius;           /* of the fiber, from the scale of the strongest response, voxels */
    float strength;         /* scale-normalised response; 0.74 for an isolated disk of density 1 */
};

/* Where centers are looked for. */
struct center_search {
    const struct volume *v;
    const struct direction_volume *d; /* of v */
    const struct subvolumes *sub;     /* of d */
    const struct slice_frame *frame;
    double diameter_voxel; /* of the fibers; it determines the scales of the filters */
};

#endif
