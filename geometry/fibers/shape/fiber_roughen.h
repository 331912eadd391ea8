/* Fibers whose axes carry more of the noise that a reconstruction leaves in them (axis_fit.h).
 *
 * Waves of a few fixed lengths and random phases are added to each axis. Their spectrum equals the spectrum of the
 * reconstruction's error: k^2 / (1 + (k l)^4) for directions, l being the length over which the axes were smoothed, cut
 * off at k l = 3. The variance of the direction is exact in the mean over a long fiber. Renderings change in proportion
 * to the variance of the directions, whether fibers were smoothed too little or too much, so one measurement serves for
 * both (Cook and Stefanski 1994, "Simulation-extrapolation estimation in parametric measurement error models", section
 * 2). */
#ifndef SELVEDGE_GEOMETRY_FIBER_ROUGHEN_H
#define SELVEDGE_GEOMETRY_FIBER_ROUGHEN_H

#include "geometry/fibers/fiber_set.h"

struct fiber_roughness {
    double length_m;         /* l, above 0 */
    double direction_sd_rad; /* of one component of the direction; 0 adds nothing */
};

/* Moves the vertices of f. Random phases follow from the fiber's index, so the result changes smoothly with r. */
void fiber_roughen(struct fiber_set *f, const struct fiber_roughness *r);

#endif
