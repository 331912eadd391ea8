/* What the paper leaves undone: pieces of one fiber become one polyline.
 *
 * 1. Duplicates: a fiber near 45 degrees is seen in two subvolumes; where two lines pass each other within half a diameter (a voxel at
 *    least), the vertices of the shorter are removed.
 * 2. Joins: two free ends become one line when one smooth curve passes through the last vertices of both (join_curve.h), and the way
 *    between them is short, lies in material and is no other line's. Ends at a face of the volume stay free. Best pairs first. A join
 *    within one subvolume is a bridged gap (a center missed in some slices), one between two subvolumes a fiber that turned from one
 *    to the other.
 */
#ifndef SELVEDGE_GEOMETRY_JOINING_H
#define SELVEDGE_GEOMETRY_JOINING_H

#include "geometry/fibers/lines/polyline.h"
#include "geometry/volume/volume.h"

struct join_counts {
    size_t n_duplicate;             /* vertices removed by the last call */
    size_t n_gap_bridged, n_joined; /* added up over calls: start with zeros */
};

/* lines in, result (initialised, empty) out. eps_d: density that counts as material. min_vertex: pieces shorter than this after
 * duplicates have gone are dropped before joining. STATUS_NO_MEMORY. */
status polylines_remove_duplicates(const struct polyline_set *lines, const size_t n_voxel[3], double diameter_voxel,
                                   size_t min_vertex, struct polyline_set *result, struct join_counts *counts,
                                   struct error *err);
status polylines_join(const struct polyline_set *lines, const struct volume *v, double diameter_voxel, double eps_d,
                      struct polyline_set *result, struct join_counts *counts, struct error *err);

#endif
