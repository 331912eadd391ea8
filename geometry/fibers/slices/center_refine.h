/* Centers moved to the centroids of their own fiber's cross section, free of the neighbours' pull that shifts blob maxima.
 *
 * Each pixel belongs to the nearest center, distances measured perpendicular to that center's fiber (a leaning fiber's section is an
 * ellipse), and counts within WINDOW_RADII of a radius. The center moves to the density-weighted mean of its pixels, some times over.
 * For fibers that touch, the border lies midway, which leaves each its own disk. */
#ifndef SELVEDGE_GEOMETRY_CENTER_REFINE_H
#define SELVEDGE_GEOMETRY_CENTER_REFINE_H

#include "geometry/fibers/slices/centers.h"

/* image: width x height densities of the slice; owner, distance: scratch of the same size. */
void centers_refine(const float *image, size_t width, size_t height, double diameter_voxel, struct center *center,
                    size_t n, float *owner, float *distance);

#endif
