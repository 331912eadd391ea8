/* The fiber diameter without the blur of the scan, from lines that are traced in a part of it.
 *
 * The scale of the strongest response (fiber_diameter.h) grows with the blur, and more where diameters differ, because
 * it weighs responses by their third power. The fit of axes separates radius and blur (axis_profile.h). So a box with
 * much material is traced with the measured diameter, and traced again with the diameter of the lines that were found,
 * until it stays the same. Where thin and thick fibers lie side by side, their lines at the peak may be several in each
 * thick fiber; a diameter between both then finds one. */
#ifndef SELVEDGE_GEOMETRY_TRACE_DIAMETER_H
#define SELVEDGE_GEOMETRY_TRACE_DIAMETER_H

#include "base/progress.h"
#include "base/thread_pool.h"
#include "geometry/grade/reconstruct_option.h"
#include "geometry/grade/reconstruct_report.h"
#include "geometry/volume/volume.h"

/* Finds the directions of a volume by the diameter in the options, as reconstruct_orientation_again does. */
typedef status trace_orientation(const struct volume *v, struct reconstruct_option *o, struct thread_pool *pool,
                                 const struct progress *progress, struct direction_volume *d,
                                 struct reconstruct_report *report, struct error *err);

/* Replaces report->fiber_diameter_voxel, the diameter of a peak, by the mean diameter of traced lines. A round
 * changes nothing where no lines are found, where their radii differ so much that the box does not resolve its
 * fibers, where the scan is strongly blurred, or where the result is of other fibers: thinner than the peak by
 * FIBER_DIAMETER_FINER, thicker by a tenth, or thicker at all where voxels are interpolated. Of fibers with two
 * diameters, 1.4 times the peak is taken, or 0.62 times where lines of the last round hold several fibers. Where
 * the scan is strongly blurred, option gets a narrower filter (filter_choice.h). Sets
 * report->lost_ends and in_pieces: where 15 % of the ends are lost, lines of the box are traced once more in their own
 * directions, and the scan's will be if these have no worse a score. v: densities; known: the same volume before
 * densities were continued into its unknown voxels (volume_unknown.h). STATUS_CANCELLED, STATUS_NO_MEMORY,
 * STATUS_DISK_FULL. */
status trace_diameter(const struct volume *v, const struct volume *known, trace_orientation *find,
                      struct reconstruct_option *option, struct thread_pool *pool, const struct progress *progress,
                      struct reconstruct_report *report, struct error *err);

#endif
