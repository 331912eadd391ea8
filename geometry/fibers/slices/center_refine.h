/* Moves centers to the centroids of their own fiber's cross section, without the shift by neighbours that the maxima
 * of the blob filter have.
 *
 * Each pixel within WINDOW_RADII of a radius belongs to the nearest center. Distances are measured perpendicular to the
 * center's own fiber, because the section of a leaning fiber is an ellipse; the squared radius of a fiber is taken off
 * its squared distances, so that the border between touching fibers of different thickness is where they touch. The
 * center moves to the density-weighted mean of its pixels; this is repeated a few times. */
#ifndef SELVEDGE_GEOMETRY_CENTER_REFINE_H
#define SELVEDGE_GEOMETRY_CENTER_REFINE_H

#include "geometry/fibers/slices/center.h"

#include <stdbool.h>

struct refine_slice {
    /* width x height densities, and scratch arrays of the same size. Each has LANES more floats (base/lanes.h) that
     * may be read, and written as they are. */
    const float *image;
    size_t width, height;
    float *owner, *distance;
};

/* Returns false when memory is out. */
bool centers_refine(const struct refine_slice *slice, struct center *center, size_t n);

#endif
