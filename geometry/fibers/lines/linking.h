/* From centers in slices to polylines (fabric thesis, 5.6.3).
 *
 * Between neighbouring slices: bipartite matching, edge weight exp(-dist^2 / (2 sigma^2)), no edge beyond the reach; greedy by
 * descending weight (a 1/2-approximation of the heaviest matching); maximal chains become polylines.
 * Differences from the paper: dist is measured after both centers have been moved half a slice along their own fiber
 * directions (known from the direction volume), so that a leaning fiber is not matched to its neighbour, and the
 * reach is at most LINK_REACH of the diameter (1.5 voxels at least) however large sigma is, since bundled fibers touch.
 */
#ifndef SELVEDGE_GEOMETRY_LINKING_H
#define SELVEDGE_GEOMETRY_LINKING_H

#include "geometry/fibers/lines/polyline.h"
#include "geometry/fibers/slices/centers.h"

#define LINK_REACH 0.2

/* Adds the chains of at least min_vertex centers to lines, as lines of subvolume frame->index. *n_chain: chains of two centers and more.
 * STATUS_NO_MEMORY. */
status centers_link(const struct center_list *list, const struct slice_frame *frame, double sigma_voxel,
                    double diameter_voxel, size_t min_vertex, struct polyline_set *lines, size_t *n_chain,
                    struct error *err);

#endif
