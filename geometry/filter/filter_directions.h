/* Directions of the fibers on one grid (head of filter_rows.c). */
#ifndef SELVEDGE_GEOMETRY_FILTER_DIRECTIONS_H
#define SELVEDGE_GEOMETRY_FILTER_DIRECTIONS_H

#include "base/progress.h"
#include "base/thread_pool.h"
#include "geometry/grade/reconstruct_option.h"
#include "geometry/grade/reconstruct_report.h"
#include "geometry/volume/volume.h"

/* Computes d from v, whose fibers are diameter_voxel thick. Options that are left to the data are chosen from v and
 * written back. Counts the voxels of material and those kept. STATUS_INVALID when no voxel is kept (reconstruct.h);
 * STATUS_CANCELLED, STATUS_NO_MEMORY, STATUS_DISK_FULL. */
status filter_directions(const struct volume *v, double diameter_voxel, struct reconstruct_option *option,
                         struct thread_pool *pool, const struct progress *progress, struct direction_volume *d,
                         struct reconstruct_report *report, struct error *err);
/* The same, for directions that are only read: d may have kept voxels alone (volume.h), which takes less memory. */
status filter_directions_kept(const struct volume *v, double diameter_voxel, struct reconstruct_option *option,
                              struct thread_pool *pool, const struct progress *progress, struct direction_volume *d,
                              struct reconstruct_report *report, struct error *err);

#endif
