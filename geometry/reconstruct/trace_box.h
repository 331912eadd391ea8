/* The part of a scan in which lines are traced for what they tell about all of it. */
#ifndef SELVEDGE_GEOMETRY_TRACE_BOX_H
#define SELVEDGE_GEOMETRY_TRACE_BOX_H

#include "geometry/volume/volume.h"

/* Boxes in which lines are traced: one, and in large scans two more. */
enum { TRACE_N_BOX = 3 };

/* Copies the box of ten diameters (48 to 96 voxels) of v in which `known` has the most material. known: v before its
 * densities were continued into unknown voxels (volume_unknown.h). from: the first voxel of the box in v. The copy has
 * no list of filled voxels. i_box > 0: another box with at least half as much material, a third and two thirds
 * down a list by it; the copy stays empty (n[0] 0) where such boxes are few. STATUS_NO_MEMORY, STATUS_DISK_FULL. */
status trace_box_copy(const struct volume *v, const struct volume *known, double diameter, int i_box,
                      struct volume *box, size_t from[3], struct error *err);

#endif
