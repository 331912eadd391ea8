/* Ends of lines at the faces of the volume. */
#ifndef SELVEDGE_GEOMETRY_LINE_ENDS_H
#define SELVEDGE_GEOMETRY_LINE_ENDS_H

#include "geometry/fibers/polyline.h"
#include "geometry/volume/volume.h"

/* Extends ends that lie shortly before a face, at most max_voxel, to that face, if there is material (eps_d) on the
 * rest of the way. */
void polylines_reach_faces(struct polyline_set *lines, const struct volume *v, double eps_d, double max_voxel);

/* Copies the lines without vertices at their ends that lie outside of the volume; lines of fewer than min_vertex
 * vertices are left out and counted by the class of the line. STATUS_NO_MEMORY. */
status polylines_keep_inside(const struct polyline_set *in, const size_t n_voxel[3], size_t min_vertex,
                             struct polyline_set *out, size_t n_dropped[3], struct error *err);

/* Number of ends in the middle of material: the `ahead` voxels beyond them are inside of the volume, and their mean
 * density is at least eps_d. A line that ends there has lost its fiber, unless another one touches the fiber's end. */
size_t polylines_count_lost_ends(const struct polyline_set *lines, const struct volume *v, double eps_d, double ahead);

#endif
