/* Tests whether two pieces of line are one fiber, by a cubic through the last vertices of one and the first of the
 * other.
 *
 * Extrapolating each end along its tangent fails where fibers bend within a few diameters of the gap. A cubic fitted
 * to both sides at once must describe both. A pair is unlikely if vertices are far from the curve or if the curve
 * bends sharply. Ends may be trimmed by a few vertices, because lines often deviate there. */
#ifndef SELVEDGE_GEOMETRY_JOIN_CURVE_H
#define SELVEDGE_GEOMETRY_JOIN_CURVE_H

#include "geometry/fibers/polyline.h"

#include <stdbool.h>

/* An end of a line is given by an index: 2 l for the first vertex of line l, 2 l + 1 for the last. */
struct join_curve {
    double c[4][3];  /* position = sum of c[k] u^k, voxels */
    double from, to; /* u at the last vertex kept of a, and at the first kept of b */
    double scale;    /* voxels per unit of u */
    double rms;      /* distance of the vertices from the curve, root mean square */
    double bend;     /* largest curvature over the gap and a few vertices on both sides, per voxel */
    double gap;      /* voxels from a to b */
    uint8_t trim[2]; /* number of vertices left out at the ends of a and b */
};

/* Fits the curve to ends a and b with the given trims. Returns false if b is not ahead of a. */
bool join_curve_fit(const struct polyline_set *p, uint32_t a, uint32_t b, const uint8_t trim[2], struct join_curve *j);
void join_curve_at(const struct join_curve *j, double u, double x[3]);
/* Returns the vertex k vertices from an end of a line. */
const float *line_end_vertex(const struct polyline_set *p, uint32_t end, size_t k);

#endif
