/* The grid that fibers are found in.
 *
 * Filters, slices and links work best on fibers of about seven voxels: of finer ones neighbours that touch have no
 * valley between their centers, and of coarser ones the reach of a filter grows with its noise. So fibers much thinner
 * or thicker than that are found in a rescaled volume. The lines that come of it are then fitted to the scan itself. */
#ifndef SELVEDGE_GEOMETRY_TRACE_GRID_H
#define SELVEDGE_GEOMETRY_TRACE_GRID_H

#include "geometry/fibers/polyline.h"
#include "geometry/grade/reconstruct_option.h"

/* Edge of the grid's voxels in voxels of the scan, for fibers of this diameter in a scan of n_voxel: 1 if the scan's
 * own grid serves, or a finer one would be too large. */
double trace_grid_edge(double diameter_voxel, const size_t n_voxel[3]);

/* Options that count in voxels of the scan, in voxels of `edge` times that, and back with 1 / edge. */
void trace_grid_rescale_option(struct reconstruct_option *o, double edge);
/* The same for lines: positions and radii are multiplied by `edge`. */
void trace_grid_rescale_lines(struct polyline_set *lines, double edge);

#endif
