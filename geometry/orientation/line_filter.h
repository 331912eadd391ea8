/* The line filter of Zhao et al. 2011 ("Building volumetric appearance models of fabric using micro CT imaging", section 5):
 *     q(d, p) = -2 exp(-s r^2) + exp(-t r^2),  r the distance of offset p from the line through the origin along d (voxels),
 *     J(x, d) = sum over p in a cube of h^3 voxels of q(d, p) V(x + p).
 * Tables of the taps that matter, one list for each direction of a set, in runs of eight along x.
 *
 * An even h has its outermost layers on both sides at half weight, so that the cube is centred on the voxel.
 * Taps outside of the volume take the value of their mirror image through x (q is even in p, so this is the half
 * of the filter that has data, doubled): directions at the faces are not biased.
 */
#ifndef SELVEDGE_GEOMETRY_LINE_FILTER_H
#define SELVEDGE_GEOMETRY_LINE_FILTER_H

#include "geometry/orientation/direction_set.h"
#include "geometry/volume/volume.h"

#include <stdbool.h>

struct line_filter;

/* For the volume's shape. STATUS_NO_MEMORY; STATUS_INVALID for s, t <= 0 or h < 3 or > 63. */
status line_filter_new(const struct direction_set *set, double s, double t, size_t h, const size_t n[3],
                       struct line_filter **filter, struct error *err);
void line_filter_free(struct line_filter *filter);
/* Floats that a thread needs to hold the surroundings of one voxel. */
size_t line_filter_scratch(const struct line_filter *filter);

/* Everything needed to evaluate J at one voxel for many directions. */
struct line_filter_site {
    const float *centre;
    bool copied;
};
struct line_filter_site line_filter_at(const struct line_filter *filter, const struct volume *v, size_t i, size_t j,
                                       size_t k, float *scratch);
float line_filter_j(const struct line_filter *filter, const struct line_filter_site *site, size_t i_direction);

#endif
