/* Voxels without a measurement, such as those outside of a scanner's round field of view.
 *
 * Their density is 0 in the volume, so that nothing is invented there: they are no material, and no step reports a
 * fiber in them. The steps that find fibers would take the border of the field of view for the surface of fibers. They
 * use a copy in which the densities at the border continue outwards, and their results in these voxels are dropped. */
#ifndef SELVEDGE_GEOMETRY_VOLUME_UNKNOWN_H
#define SELVEDGE_GEOMETRY_VOLUME_UNKNOWN_H

#include "geometry/volume/volume.h"

#include <stdbool.h>

/* Enters the voxels at VOLUME_OUTSIDE (volume_align.h) in v->unknown. STATUS_NO_MEMORY, STATUS_DISK_FULL. */
status volume_mark_unknown(struct volume *v, struct error *err);
/* Returns whether a voxel at most `reach` from x along each axis is unknown. All lengths are in voxels; points on and
 * beyond faces count as their nearest voxels. */
bool volume_unknown_near(const struct volume *v, const float x[3], float reach);
/* Makes a copy (uninitialised `to`) whose unknown voxels within VOLUME_CONTINUED_VOXELS of known ones have densities:
 * layer by layer the mean of those of the 26 neighbours that have one. The copy has no lumens of its own, and no
 * unknown voxels. STATUS_NO_MEMORY, STATUS_DISK_FULL. */
enum { VOLUME_CONTINUED_VOXELS = 32 };
status volume_continue(const struct volume *v, struct volume *to, struct error *err);
/* Empties the unknown voxels of directions that were found in the copy. */
void volume_unknown_empty(const struct volume *v, struct direction_volume *d);
/* Sets the unknown voxels of a copy to a density far from all others. Fits of axes then give them no weight, because
 * their losses are bounded (axis_compare.c). */
#define VOLUME_IGNORED (-1e4f)
void volume_unknown_ignore(const struct volume *v, struct volume *to);

#endif
