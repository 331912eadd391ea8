/* The lumen of a fiber in the fit of axes (axis_fit.h): its part of the fiber's share in each voxel.
 *
 * The lumen is the section of the fiber, smaller by the factor h, whose square is the estimated `area`. It is often
 * narrower than the blur b. Therefore its blurred image is computed as the image of a disc of the same area in a frame
 * whose ratio of axes, and whose blur, give the image the variances A^2 / 4 + b^2 and B^2 / 4 + b^2 of the blurred
 * ellipse (half axes A and B): exact for discs, and to 0.01 of the density for lumens of 0.4 of the width with a ratio
 * of axes of 2.5. */
#ifndef SELVEDGE_GEOMETRY_AXIS_LUMEN_H
#define SELVEDGE_GEOMETRY_AXIS_LUMEN_H

#include "base/lanes.h"
#include "geometry/fibers/axes/model/axis_profile.h"
#include "geometry/fibers/axes/model/fiber_section.h"
#include "geometry/fibers/axes/model/lumen_table.h"

/* The lumen of a segment, prepared for many points. */
struct lumen_view {
    float uu, uv, vv;                  /* its frame, as in section_view */
    float inverse;                     /* one over the blur in this frame */
    float area;                        /* in units of this blur, squared */
    float by_area, by_radius, by_blur; /* derivatives of `area` by the area as a share, and by the radius; 1 / blur */
    float turn;                        /* change of c and s of this frame per change of the section's */
};

/* area: of the lumen over the outline's; negative for a fiber that is denser than others in its middle. */
struct lumen_view lumen_view_make(const struct section_view *section, float radius, float area, float blur);

/* Share of the lumen in LANES voxels and its derivatives; the vector is that by the position of the axis. */
struct lumen_lanes {
    lanes share, by_axis[2], by_radius, by_blur, by_area, by_c, by_s;
};

/* x, y: of the voxels, from the axis along u and v of the section. */
struct lumen_lanes lumen_lanes_at(const struct lumen_view *w, const struct lumen_table *t, lanes x, lanes y);

/* Normal equation of the area of one line, and the terms that it has in common with the radius and with the numbers
 * that all fibers share (axis_profile.h); radius_shared: of the radius with a change of all areas. */
struct lumen_equation {
    float normal, gradient, by_radius, cross[AXIS_N_SHARED], radius_shared;
};

void lumen_equation_add(struct lumen_equation *to, const struct lumen_equation *from);

#endif
