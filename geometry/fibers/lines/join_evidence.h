/* Whether the scan shows that two ends belong to one fiber: a likelihood ratio of two pictures of the densities around
 * the gap. In the first, one fiber follows the curve over the gap (join_curve.h). In the second, each fiber goes
 * straight on past its end, as where a line has changed from one fiber to its neighbour. Both have the other lines too,
 * and all fibers have the profile of axis_fit.h. */
#ifndef SELVEDGE_GEOMETRY_JOIN_EVIDENCE_H
#define SELVEDGE_GEOMETRY_JOIN_EVIDENCE_H

#include "geometry/fibers/lines/join_curve.h"
#include "geometry/volume/volume.h"

struct join_scene {
    const struct polyline_set *lines;
    const struct vertex_grid *grid; /* of all vertices */
    const struct volume *v;
    double diameter, blur; /* typical diameter; standard deviation of the profile's edges, voxels */
    float largest_radius;
};

/* Returns (R2 - R1) / D, R1 and R2 being the sums of the squared residuals of the first and the second picture, and D
 * the sum of the squared differences of the pictures: 1 if the scan is exactly as with one fiber, -1 if it is exactly
 * as with two. 0 where both pictures are the same. */
double join_evidence(const struct join_scene *s, const struct join_curve *j, uint32_t a, uint32_t b);

#endif
