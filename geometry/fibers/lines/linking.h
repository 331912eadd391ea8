/* Links the centers in slices to polylines (fabric thesis, 5.6.3).
 *
 * Centers of neighbouring slices are matched as in the paper: an edge has weight exp(-dist^2 / (2 sigma^2)), and
 * there is none beyond the reach; edges are accepted greedily by descending weight, a 1/2-approximation of the
 * heaviest matching; maximal chains become polylines. Differences from the paper: dist is measured after both
 * centers have been moved half a slice along their own fiber directions, known from the direction volume, so that a
 * leaning fiber is not matched to its neighbour. The reach is at most LINK_REACH of the diameter (but at least 1.5
 * voxels) however large sigma is, because bundled fibers touch. */
#ifndef SELVEDGE_GEOMETRY_LINKING_H
#define SELVEDGE_GEOMETRY_LINKING_H

#include "geometry/fibers/polyline.h"
#include "geometry/fibers/slices/centers.h"

#define LINK_REACH 0.2

/* Adds the chains of at least min_vertex centers to lines, as lines of subvolume frame->index. *n_chain: number of
 * chains of two or more centers. STATUS_NO_MEMORY. */
status centers_link(const struct center_list *list, const struct slice_frame *frame, double sigma_voxel,
                    double diameter_voxel, size_t min_vertex, struct polyline_set *lines, size_t *n_chain,
                    struct error *err);

#endif
