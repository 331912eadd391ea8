/* Sections of the fibers of a phantom that are not discs, hollow, flat, and bean-shaped, and radii that vary.
 *
 * A section is an ellipse of the area pi r^2, where r is the radius of the fiber, with half axes r sqrt(aspect) and
 * r / sqrt(aspect). A bean is this ellipse with its long axis bent to a parabola: the point (u, v) of the ellipse moves
 * to v + bean (u^2 / a - a / 4), a the long half axis, which keeps area and centroid. The lumen is the same shape,
 * smaller by the factor `lumen`, and empty.
 *
 * With a taper the radius falls by that share and rises again once on the way through the tile, along x or y, each
 * radius at a place of its own: r (1 - taper (1 - cos p) / 2), p = 2 pi (x / tile + y / tile) + phase, which closes at
 * the faces. */
#ifndef SELVEDGE_GEOMETRY_PHANTOM_SECTION_H
#define SELVEDGE_GEOMETRY_PHANTOM_SECTION_H

#include "geometry/fibers/fiber_set.h"

#include <stdbool.h>
#include <stdint.h>

/* Numbers that the sections of all fibers share. All zero: full discs. */
struct phantom_section_law {
    uint64_t seed;
    double lumen;  /* width of the lumen over the width of the fiber, 0 .. 0.8 */
    double aspect; /* largest ratio of the half axes, 1 .. 4; 0: 1. Each fiber has its own, even between 1 and it. */
    double bean;   /* bend of the long axis, 0 .. 0.5 */
    double turns_per_m; /* by which the section turns along its fiber, either way */
    double taper;       /* share by which the radius falls along a fiber, 0 .. 0.5 */
    /* Each fiber has its own lumen, even between (1 - lumen_spread) lumen and lumen; 0 .. 1. */
    double lumen_spread;
};

/* The section of one fiber. */
struct phantom_section {
    double lumen, aspect, bean;
    /* Angle of the long axis at the first vertex and its change, from the direction that is perpendicular to the fiber
     * and z (to x for fibers of class 2), towards the third axis of a right-handed frame whose first is the fiber. */
    double angle_rad, turn_rad_per_m;
};

/* Whether all sections are full discs, of any radius. */
bool phantom_section_is_disc(const struct phantom_section_law *law);
/* STATUS_INVALID, with err->field "lumen", "aspect", "bean", "turns_per_m", "taper" or
 * "lumen_spread". */
status phantom_section_check(const struct phantom_section_law *law, struct error *err);
/* Writes the sections, lumens and radii along the fibers into the set, if any differ from full discs of one radius.
 * STATUS_NO_MEMORY. */
status phantom_section_shapes(const struct phantom_section_law *law, struct fiber_set *f, struct error *err);
/* Frame of the section's angle for a fiber of a class along the unit vector t: the direction of angle 0, and the
 * third. */
void phantom_section_frame(const double t[3], uint8_t axis_class, double across[2][3]);
/* The section of fiber i. It depends on the law and i only. */
struct phantom_section phantom_section_of(const struct phantom_section_law *law, size_t i_fiber);
/* Factor on the radius at which the fibers of a cloth are pushed apart, for fibers of the mean aspect: the geometric
 * mean of the radius and the long half axis. Crossing fibers then overlap by their tips at most. */
double phantom_section_spacing(const struct phantom_section_law *law);

/* Share of a voxel of width 1 that is inside the section of a fiber of radius r. The voxel is at (u, v), along the long
 * and the short axis; all lengths are in voxels. Distances from the outline are of the first order, the ramp is the
 * same as in phantom_raster.c. */
double phantom_section_share(const struct phantom_section *c, double r, double u, double v);
/* Distance from the axis beyond which the share is 0, in voxels. */
double phantom_section_reach(const struct phantom_section *c, double r);

#endif
